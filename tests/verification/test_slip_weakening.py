"""Bonds whose cohesion falls with slip, against the closed form of the linear law.

Errors of an opening, and of a traction, are those of ``test_bond_law``.
"""

import numpy as np
import pytest

from taichi_dem import CONCRETE, effects
from taichi_dem.kit.allocation import assign, values
from taichi_dem.mesh.shapes import pair as pair_mesh
from tests.probe import BondProbe
from tests.verification.test_bond_law import EDGE, OPENING_ERROR, SHEAR_ERROR

K_N, K_S = CONCRETE.normal_stiffness, CONCRETE.shear_stiffness
COHESION, FRICTION = CONCRETE.cohesion, CONCRETE.friction
#: Fracture energy of mode II [J/m^2], and the slip at which no cohesion is left [m].
ENERGY = 1000.0
CRITICAL = 2.0 * ENERGY / COHESION
SLOPE = COHESION / CRITICAL


@pytest.fixture(scope="module")
def built():
    listed = [effects.BondDamping(), effects.Softening(), effects.SlipWeakening(ENERGY)]
    return BondProbe(pair_mesh(EDGE), listed)


@pytest.fixture
def bonded(built):
    """The same pair without history."""
    built.reset()
    assign(built.state.fields()["slip_weakening_unit"], 0.0)
    return built


def traction_at(sliding, pressure):
    """Shear traction [Pa] and slip [m] of a monotonic test: the law k (d - s) = limit(s)."""
    peak = COHESION + FRICTION * pressure
    if K_S * sliding <= peak:
        return K_S * sliding, 0.0
    slip = (K_S * sliding - peak) / (K_S - SLOPE)
    if slip < CRITICAL:
        return peak - SLOPE * slip, slip
    rest = FRICTION * pressure
    return rest, sliding - rest / K_S


def test_shear_follows_the_closed_form_to_the_friction_that_remains(bonded):
    """Up k_s, down with the slope k_s c / (k_s d_c - c), then friction alone, in any direction."""
    pressure = 5e6
    way = np.linspace(0.0, 3.0 * CRITICAL, 61)
    along = np.array([0.6, 0.8])
    for d in way:
        found = bonded.open([-pressure / K_N, *(d * along)])[1:]
        expected, _ = traction_at(d, pressure)
        # In softening an error of the opening comes back enlarged by k_s / (k_s - slope).
        bound = 61 * SHEAR_ERROR * K_S / (K_S - SLOPE)
        assert np.abs(found - expected * along).max() < bound
    assert not bonded.broken


def test_unloading_is_elastic_and_reloading_meets_the_reduced_limit(bonded):
    """From half the critical slip back with k_s, and again up to the limit left there.

    On the way back the reversed limit, of the same reduced cohesion, is not reached.
    """
    pressure, reached = 5e6, 0.5 * CRITICAL
    normal = -pressure / K_N
    limit = COHESION - SLOPE * reached + FRICTION * pressure
    top = reached + limit / K_S
    bonded.open([normal, 0.0, top])
    heat = bonded.heat[1]
    for d in np.linspace(top, top - 1.9 * limit / K_S, 9):
        found = bonded.open([normal, 0.0, d])[2]
        assert found == pytest.approx(limit - K_S * (top - d), abs=9 * SHEAR_ERROR)
    assert bonded.heat[1] == heat
    again = bonded.open([normal, 0.0, top + 10e-6])[2]
    expected = traction_at(top + 10e-6, pressure)[0]
    assert again == pytest.approx(expected, abs=99 * SHEAR_ERROR)


def test_slip_to_and_fro_accumulates(bonded):
    """Back at zero residual slip the cohesion is that of the whole way."""
    pressure, size = 2e6, 0.2 * CRITICAL
    limit = COHESION - SLOPE * size + FRICTION * pressure
    bonded.open([-pressure / K_N, size + limit / K_S, 0.0])
    limit -= SLOPE * size
    bonded.open([-pressure / K_N, -limit / K_S, 0.0])
    unit = bonded.simulation.values(bonded.state.fields()["slip_weakening_unit"])
    assert np.abs(unit[:, 0]).max() < 99 * OPENING_ERROR
    assert unit[:, 2] == pytest.approx([2 * size] * 3, abs=99 * OPENING_ERROR)


def test_decohered_face_rubs_while_it_is_pressed_and_opens_free(bonded):
    """Pressed it holds and rubs; without pressure it is released, where an intact one holds."""
    far = [-1e-6, 2.0 * CRITICAL, 0.0]
    bonded.open(far)
    assert not bonded.broken
    assert bonded.open(far)[1] == pytest.approx(FRICTION * 1e-6 * K_N, abs=99 * SHEAR_ERROR)
    gap = 1e-9
    assert np.array_equal(bonded.open([gap, 2.0 * CRITICAL, 0.0]), np.zeros(3))
    assert bonded.broken
    # What the unit still held in tension is lost, and booked as released.
    release = 0.5 * K_N * gap**2 * bonded.area
    assert bonded.heat[2] == pytest.approx(release, rel=3 * OPENING_ERROR / gap)


def test_energy_stored_plus_spent_is_the_work_done_on_any_way(bonded):
    """Work of a jump is the change of the spring's energy before it slips: exact at any step."""
    draw = np.random.default_rng(3)
    way = np.cumsum(draw.normal(scale=0.4 * CRITICAL, size=(60, 2)), axis=0)
    unit = bonded.state.fields()["slip_weakening_unit"]
    normal = -5e6 / K_N
    bonded.open([normal, 0.0, 0.0])
    work = bonded.stored()
    for sliding in way:
        slip = values(unit)[0, :2]
        before = bonded.stored()
        trial = 0.5 * K_S * ((sliding - slip) ** 2).sum() + 0.5 * K_N * normal**2
        work += bonded.area * trial - before
        bonded.open([normal, *sliding])
    size = bonded.area * 60 * SHEAR_ERROR * np.abs(way).max()
    assert bonded.stored() + bonded.heat[1] == pytest.approx(work, abs=size)
