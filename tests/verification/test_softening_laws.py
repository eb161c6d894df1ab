"""Bonded pairs with the law of mixed modes and with weakening by slip, against closed forms.

Along a way of fixed direction the force of mixed modes is that of a triangle: stiffness K up to
x_0, a straight line down to zero at x_1, with K x_0^2 = e_0, K x_0 x_1 = 2 G, and by Benzeggagh and
Kenane

    B = k_s s^2 / K,  G = G_I + (G_II - G_I) B^n,
    e_0 = f_t^2 / k_n + (c^2 / k_s - f_t^2 / k_n) B^n.

Errors of an opening, and of a traction, are those of ``test_bond_law``; the line falls no steeper
than K where x_1 is at least 2 x_0.
"""

import numpy as np
import pytest

from taichi_dem import CONCRETE, effects
from taichi_dem.kit.allocation import assign, values
from taichi_dem.mesh.shapes import pair as pair_mesh
from tests.probe import BondProbe
from tests.verification.test_bond_law import EDGE, K_N, K_S, OPENING_ERROR, SHEAR_ERROR

FIRST = CONCRETE.tensile_strength**2 / K_N, CONCRETE.cohesion**2 / K_S
G_I, EXPONENT = CONCRETE.fracture_energy, 1.75
G_II = max(2.0 * G_I, 2.0 * FIRST[1])
ERROR = max(K_N, K_S) * OPENING_ERROR
#: Directions of the way: pure opening, pure sliding, 45 degrees, and one without a symmetry.
WAYS = {"I": (1, 0, 0), "II": (0, 0.6, -0.8), "45": (1, 1, 0), "other": (0.3, -0.5, 0.7)}


@pytest.fixture(scope="module")
def mixed():
    return BondProbe(pair_mesh(EDGE), [effects.MixedMode(G_II, EXPONENT)])


@pytest.fixture
def pair(mixed):
    """The pair without history."""
    mixed.reset()
    return mixed


class Way:
    """Closed form along a direction; x: length of the way [m]."""

    def __init__(self, name):
        self.along = np.array(WAYS[name]) / np.linalg.norm(WAYS[name])
        stiffness = np.array([K_N, K_S, K_S])
        self.pull = stiffness * self.along
        self.stiffness = self.pull @ self.along
        mixity = K_S * (self.along[1:] @ self.along[1:]) / self.stiffness
        share = mixity**EXPONENT
        self.energy = G_I + (G_II - G_I) * share
        begin = FIRST[0] + (FIRST[1] - FIRST[0]) * share
        self.onset = np.sqrt(begin / self.stiffness)
        self.end = 2.0 * self.energy / (self.stiffness * self.onset)

    def secant(self, x):
        """Share of the first stiffness that is left once the way has reached x."""
        beyond = np.maximum(x, self.onset)
        return self.onset * (self.end - beyond) / (beyond * (self.end - self.onset))

    def traction(self, x):
        return self.secant(x)[..., None] * x[..., None] * self.pull


@pytest.mark.parametrize("name", WAYS)
def test_the_way_to_failure_is_the_triangle_of_its_mode(pair, name):
    """Its area, by the trapezoidal rule on its own corners, is G of the mode; it is spent."""
    way = Way(name)
    assert way.end > 2.0 * way.onset
    x = np.append(np.linspace(0, way.onset, 20), np.linspace(way.onset, way.end, 30)[1:-1])
    found = np.array([pair.open(each * way.along) for each in x])
    assert np.abs(found - way.traction(x)).max() < 2.0 * ERROR
    assert not pair.broken
    share = (x[-1] - way.onset) / (way.end - way.onset)
    assert np.abs(pair.spent() - share * way.energy).max() < 2.0 * ERROR * way.end
    pair.open((way.end + 4.0 * OPENING_ERROR) * way.along)
    assert pair.broken
    force = np.append(found @ way.along, 0.0)
    work = np.sum(0.5 * (force[1:] + force[:-1]) * np.diff(np.append(x, way.end)))
    assert work == pytest.approx(way.energy, abs=2.0 * ERROR * way.end)


def test_damage_never_heals_in_whatever_direction_the_unit_is_moved(pair):
    """After 45 degrees half way down, opening alone meets the same share of its stiffness."""
    way = Way("45")
    reached = 0.5 * (way.onset + way.end)
    left = way.secant(np.array(reached))
    pair.open(reached * way.along)
    for jump in ([3e-6, 0, 0], [0, 2e-6, -1e-6], 0.5 * reached * way.along):
        expected = left * np.array([K_N, K_S, K_S]) * jump
        assert np.abs(pair.open(jump) - expected).max() < 2.0 * ERROR
    assert pair.open([-5e-6, 0, 0])[0] == pytest.approx(-K_N * 5e-6, abs=ERROR)


COHESION, FRICTION = CONCRETE.cohesion, CONCRETE.friction
#: Fracture energy of mode II [J/m^2], and the slip at which no cohesion is left [m].
ENERGY = 1000.0
CRITICAL = 2.0 * ENERGY / COHESION
SLOPE = COHESION / CRITICAL


@pytest.fixture(scope="module")
def weakening():
    listed = [effects.BondDamping(), effects.Softening(), effects.SlipWeakening(ENERGY)]
    return BondProbe(pair_mesh(EDGE), listed)


@pytest.fixture
def bonded(weakening):
    """The same pair without history."""
    weakening.reset()
    assign(weakening.state.fields()["slip_weakening_unit"], 0.0)
    return weakening


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
