"""One bonded pair moved by hand against the laws of Konno et al., section 2.1.

Every opening is a difference of positions of the size of the pair (0.05 m) with eight operations,
so it is known to OPENING_ERROR; tractions are then known to stiffness times that.
"""

import numpy as np
import pytest

from taichi_dem import CONCRETE, effects
from taichi_dem.mesh import shapes as mesh_shapes
from tests.probe import BondProbe
from tests.scenes import matrix, product, quaternion
from tests.structures import filled

EDGE = 0.05
EPS = np.finfo(float).eps
OPENING_ERROR = 8 * EPS * EDGE
K_N, K_S = CONCRETE.normal_stiffness, CONCRETE.shear_stiffness
STRENGTH, COHESION, FRICTION = CONCRETE.tensile_strength, CONCRETE.cohesion, CONCRETE.friction
ONSET, FAILURE = STRENGTH / K_N, 2.0 * CONCRETE.fracture_energy / STRENGTH
PULL_ERROR = K_N * OPENING_ERROR
SHEAR_ERROR = K_S * OPENING_ERROR + FRICTION * PULL_ERROR


@pytest.fixture(scope="module")
def built():
    """The pair with everything a bond can have; at rest the dashpots give nothing."""
    laws = effects.BondDamping(), effects.Softening(), effects.ShearSlip()
    return BondProbe(mesh_shapes.pair(EDGE), filled("paper", *laws, effects.SphereContact()))


@pytest.fixture
def pair(built):
    """The same pair without history."""
    built.reset()
    return built


def envelope(opening):
    """Traction of the first opening: linear to the strength, then straight down to zero."""
    fall = STRENGTH * (FAILURE - opening) / (FAILURE - ONSET)
    return np.where(opening <= ONSET, K_N * opening, fall)


def test_material_gives_the_numbers_of_the_paper():
    """u_E = 14.80 um and u_f = 29.93 um, to their last digit."""
    assert ONSET == pytest.approx(14.80e-6, abs=0.5e-8)
    assert FAILURE == pytest.approx(29.93e-6, abs=0.5e-8)


def test_tension_follows_the_envelope_and_fails_at_its_end(pair):
    """Peak f_t at u_E, area under the curve G_f, no failure before u_f."""
    opening = np.concatenate([np.linspace(0, ONSET, 50), np.linspace(ONSET, FAILURE, 50)[1:-1]])
    pull = np.array([pair.open([u, 0, 0])[0] for u in opening])
    assert np.abs(pull - envelope(opening)).max() < PULL_ERROR
    assert pull.max() == pytest.approx(STRENGTH, abs=PULL_ERROR)
    pair.open([FAILURE - OPENING_ERROR, 0, 0])
    assert not pair.broken
    assert np.array_equal(pair.open([FAILURE + OPENING_ERROR, 0, 0]), np.zeros(3))
    assert pair.broken
    # A broken line integrates exactly by the trapezoidal rule on its own corners.
    curve_u, curve_f = np.append(opening, FAILURE), np.append(pull, 0.0)
    work = np.sum(0.5 * (curve_f[1:] + curve_f[:-1]) * np.diff(curve_u))
    assert work == pytest.approx(CONCRETE.fracture_energy, abs=PULL_ERROR * FAILURE)


def test_unloading_and_reloading_stay_on_the_secant(pair):
    """Down to zero and up again on f(u_max) / u_max, then on along the envelope."""
    reached = 20e-6
    pair.open([reached, 0, 0])
    secant = envelope(reached) / reached
    for u in (*np.linspace(reached, 0, 7), *np.linspace(0, reached, 7)):
        assert pair.open([u, 0, 0])[0] == pytest.approx(secant * u, abs=PULL_ERROR)
    assert pair.open([25e-6, 0, 0])[0] == pytest.approx(envelope(25e-6), abs=PULL_ERROR)


def test_compression_keeps_the_full_stiffness_after_softening(pair):
    pair.open([25e-6, 0, 0])
    assert pair.open([-7e-6, 0, 0])[0] == pytest.approx(-K_N * 7e-6, abs=PULL_ERROR)


def unit_openings(pair, tilt, lift):
    """Normal openings of the units with the slave tilted about eta through the face, and lifted.

    Returns them with the slave's position and orientation.
    """
    axis = pair.frame[2]
    q = quaternion(axis, tilt)
    middle = pair.model.mesh.points[pair.model.topology.vertices[0]].mean(axis=0)
    arm = pair.centre[1] - middle
    centre = middle + matrix(q) @ arm + lift * pair.frame[0]
    corners = pair.model.mesh.points[pair.model.topology.vertices[0]]
    moved = centre + (corners - pair.centre[1]) @ matrix(q).T
    position = np.array([pair.centre[0], centre])
    orientation = np.array([[1.0, 0, 0, 0], q])
    return (moved - corners) @ pair.frame[0], position, orientation


def test_one_failed_unit_releases_the_face_without_force(pair):
    """Slave tilted so that one unit opens past u_f and two do not.

    Ledger: softening has spent G_f in the failed unit and the area between envelope and secant
    in the others; release is what the other two still stored on their secants. Tilting slides
    the units by less than the opening squared over the arm, 1e-7 of it.
    """
    opening, position, orientation = unit_openings(pair, 7e-4, 14e-6)
    opening_error = OPENING_ERROR + 7e-4**2 * EDGE * EPS
    assert (opening > FAILURE).sum() == 1 and (opening < FAILURE - 1e-6).sum() == 2
    wrench = pair.move(position, orientation)
    assert pair.broken
    assert np.array_equal(wrench, np.zeros((2, 6)))
    reached = np.clip(opening, ONSET, FAILURE)
    spent = 0.5 * (STRENGTH * reached - envelope(reached) * ONSET)
    assert np.abs(pair.spent() - spent).max() < STRENGTH * opening_error
    stiffness = np.where(opening > 0, envelope(reached) / reached, K_N)
    normal = 0.5 * stiffness * np.where(opening > FAILURE, 0.0, opening) ** 2
    slid = 0.5 * K_S * (7e-4**2 * EDGE) ** 2
    release = pair.area / 3 * normal.sum()
    assert abs(pair.heat[2] - release) < pair.area * (slid + 2 * STRENGTH * opening_error)
    assert np.array_equal(pair.move(position, orientation), np.zeros((2, 6)))
    assert pair.stored() == 0.0


@pytest.mark.parametrize("pressure", [10e6, -3e6])
def test_shear_ends_in_the_coulomb_plateau(pair, pressure):
    """tau = min(k_s d, c + sigma tan phi), sigma positive in compression; back with slope k_s."""
    normal, limit = -pressure / K_N, COHESION + FRICTION * pressure
    for d in np.linspace(0, 3 * limit / K_S, 25):
        shear = pair.open([normal, 0, d])[2]
        assert shear == pytest.approx(min(K_S * d, limit), abs=SHEAR_ERROR)
    back = pair.open([normal, 0, 2.5 * limit / K_S])[2]
    assert back == pytest.approx(0.5 * limit, abs=25 * SHEAR_ERROR)
    assert not pair.broken


def test_shear_limit_does_not_fall_below_zero(pair):
    """With friction 2 a tension of 6 MPa leaves c - 12 MPa < 0: no shear at all."""
    pair.tables.bond.shear.law[0, 1] = 2.0
    traction = pair.open([6e6 / K_N, 3e-5, 4e-5])
    pair.tables.bond.shear.law[0, 1] = FRICTION
    assert np.abs(traction[1:]).max() <= SHEAR_ERROR


def test_slip_follows_equation_2_on_any_path(pair):
    """u0 += d (|d| - limit / k_s) / |d| with d = u - u0, along a random path under pressure."""
    path = np.cumsum(np.random.default_rng(1).normal(scale=6e-5, size=(40, 2)), axis=0)
    limit, slip = COHESION + FRICTION * 5e6, np.zeros(2)
    for count, sliding in enumerate(path, 1):
        elastic = sliding - slip
        reach = np.hypot(*elastic)
        slip = slip + elastic * max(0.0, reach - limit / K_S) / reach
        expected = K_S * (sliding - slip)
        found = pair.open([-5e6 / K_N, *sliding])[1:]
        # Slip remembers every rounding of the way; each is one opening error.
        assert np.abs(found - expected).max() < count * SHEAR_ERROR
    found = pair.simulation.values(pair.state.fields()["shear_slip_slip"])
    assert np.abs(found - slip).max() < len(path) * SHEAR_ERROR / K_S
    assert np.hypot(*slip) > limit / K_S


def test_slip_energy_is_exact_at_any_step(pair):
    """A slip s in one jump takes (limit + k_s s / 2) s: what the spring loses."""
    limit, first, steps = COHESION, COHESION / K_S, 3
    way = np.linspace(first, 4 * first, steps + 1)
    for d in way:
        pair.open([0, d, 0])
    jump = 3 * first / steps
    expected = pair.area * steps * (limit + 0.5 * K_S * jump) * jump
    assert pair.heat[1] == pytest.approx(expected, abs=2 * pair.area * SHEAR_ERROR * 4 * first)
    assert pair.stored() == pytest.approx(
        pair.area * 0.5 * limit**2 / K_S, abs=pair.area * SHEAR_ERROR * 4 * first
    )


def test_strained_and_slipped_pair_turns_with_its_force(pair):
    """Rotated by 2 rad and given a rigid velocity, force and torque turn along, to 1e-11.

    The openings (2e-5 m) are differences of positions of 0.05 m: 1e-16 * 0.05 / 2e-5 = 3e-13,
    and some ten operations. An unstrained pair would pass even if normals never turned.
    """
    still = np.tile([1.0, 0.0, 0.0, 0.0], (2, 1))
    tilt = quaternion([0.3, 1.0, -0.5], 2e-4)
    shift = pair.frame.T @ [8e-6, 1.2e-4, 0.9e-4]
    orientation = np.array([still[0], tilt])
    position = pair.centre + np.outer([0, 1], shift)
    pair.move(position, orientation)
    slip = pair.simulation.values(pair.state.fields()["shear_slip_slip"])
    assert np.abs(slip).max() > 1e-5 and not pair.broken
    resting = pair.move(position, orientation)
    q = quaternion([1.0, -2.0, 0.7], 2.0)
    turn, spin, drift = matrix(q), np.array([3.0, -1.0, 2.0]), np.array([0.4, 5.0, -2.0])
    turned = np.array([q, product(q, tilt)])
    velocity = drift + np.cross(spin, position @ turn.T)
    wrench = pair.move(position @ turn.T, turned, velocity, np.tile(spin, (2, 1)))
    expected = (resting.reshape(-1, 3) @ turn.T).reshape(2, 6)
    force, torque = np.abs(resting[:, :3]).max(), np.abs(resting[:, 3:]).max()
    assert np.abs(wrench - expected)[:, :3].max() < 1e-11 * force
    assert np.abs(wrench - expected)[:, 3:].max() < 1e-11 * torque


def test_pair_force_acts_at_one_point(pair):
    """Opposite forces, and torques that cancel about any point: nothing can spin up a free pair."""
    position = pair.centre + np.outer([0, 1], pair.frame.T @ [8e-6, 3e-5, 4e-5])
    wrench = pair.move(position, None, np.array([[1.0, 2, 3], [-2, 0.5, 1]]), np.ones((2, 3)))
    scale = np.abs(wrench[:, :3]).max()
    assert np.array_equal(wrench[0, :3], -wrench[1, :3])
    about_origin = wrench[:, 3:] + np.cross(position, wrench[:, :3])
    assert np.abs(about_origin.sum(axis=0)).max() < 8 * EPS * scale * EDGE


NORMAL, TANGENT = CONCRETE.normal_damping, CONCRETE.shear_damping
#: Relative error of a product of three factors and a sum of three units.
PRODUCT = 16 * EPS


def test_dashpots_act_with_their_full_coefficient(pair):
    """c_n v and c_s v on top of the springs, also while softening and slipping."""
    opening = (2e-5, 2e-4, 0.0)
    pair.open(opening)
    resting = pair.open(opening)
    velocity = np.array([0.3, -0.2, 0.1])
    before = pair.heat
    moving = pair.open(opening, velocity)
    drag = np.array([NORMAL, TANGENT, TANGENT]) * velocity
    # Velocities are taken at the slave's vertex: no error of theirs scales with the size.
    assert np.abs(moving - resting - drag).max() < PRODUCT * (STRENGTH + drag.max()) + PULL_ERROR
    spent = (pair.heat - before)[0] / 2.0**-20
    assert spent == pytest.approx(pair.area * drag @ velocity, rel=1e-12)


def test_dashpots_resist_twist_about_the_normal(pair):
    """Torque c_s w A r^2, with r = edge / sqrt(3) the distance of the units from the centroid."""
    spin = 5.0
    pair.open([0, 0, 0], spin=(spin, 0, 0))
    wrench = pair.evaluate()
    torque = pair.frame @ wrench[1, 3:]
    expected = -TANGENT * spin * pair.area * EDGE**2 / 3
    assert torque[0] == pytest.approx(expected, rel=PRODUCT)
    assert np.abs(torque[1:]).max() < abs(expected) * 1e-9
