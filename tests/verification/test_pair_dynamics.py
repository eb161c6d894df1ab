"""Two bodies: the normal mode of a bond, and the forces between contact spheres."""

import numpy as np
import pytest

from taichi_dem import CONCRETE, Scene, Simulation, Uniform, effects
from taichi_dem.mesh.mesh import checked_mesh
from taichi_dem.mesh.shapes import pair
from tests.probe import ContactProbe
from tests.structures import filled

EPS = np.finfo(float).eps
K, C, MU = CONCRETE.contact_stiffness, CONCRETE.contact_damping, CONCRETE.friction
#: First stretch of the pair [m], and how well openings are known: differences of positions 0.01 m.
STRETCH = 1e-6
NOISE = 4 * 0.02 * EPS


def stretched(listed, dt):
    """A mirror-symmetric pair pulled apart along its normal, at rest."""
    scene = Scene(pair(), CONCRETE, filled("bonds", *listed))
    simulation = Simulation(scene, Uniform(dt))
    place = simulation.model.centre.copy()
    place[1, 0] += STRETCH
    simulation.state.set_motion(place, np.tile([1.0, 0.0, 0.0, 0.0], (2, 1)))
    return simulation


def openings(simulation, marks):
    """Distance of the centres beyond the unstrained one after these numbers of steps [m]."""
    rest = np.diff(simulation.model.centre[:, 0])[0]
    found = []
    for step in marks:
        simulation.advance_to(step)
        position = simulation.state.position
        found.append(position[1][0] - position[0][0] - rest)
    return np.array(found)


def mass_and_area(simulation):
    """Mass of a body [kg], area of the bond [m^2]."""
    return simulation.model.body_mass[0], 3.0 * simulation.tables.unit_area[0]


def test_normal_mode_has_its_frequency():
    """m/2 u'' = -k_n A u, by kick and drift from rest: u_n = u_0 cos(n p).

    With w = sqrt(2 k_n A / m), the recurrence u_{n+1} - 2 u_n + u_{n-1} = -(w dt)^2 u_n has the
    phase p = 2 asin(w dt / 2) a step: the period error of the scheme is (w dt)^2 / 24. A run begins
    half a step back, u_1 = (1 - (w dt)^2 / 2) u_0 = u_0 cos p. Each of n steps adds a rounding of
    the position, which the recurrence carries on at most n-fold.
    """
    dt, steps = 4e-7, 300
    simulation = stretched([], dt)
    mass, area = mass_and_area(simulation)
    rate = np.sqrt(2.0 * CONCRETE.normal_stiffness * area / mass)
    n = np.arange(0, steps + 1, 10)
    found = openings(simulation, n.tolist())
    phase = 2.0 * np.arcsin(0.5 * rate * dt)
    expected = STRETCH * np.cos(n * phase)
    assert steps * phase > 6 * np.pi
    assert np.abs(found - expected).max() < steps * NOISE / np.sin(phase)
    # The bound tells the scheme's period from the exact one.
    assert steps * (phase - rate * dt) * STRETCH > 100 * steps * NOISE / np.sin(phase)


def test_table_1_dashpots_overdamp_the_normal_mode():
    """Two decay rates, roots of m/2 l^2 - c A l + k A = 0, and no oscillation.

    Late on only the slow one is left: it gives its own rate and, taken off the early openings,
    leaves the fast one. A step multiplies by 1 - l dt, so that a measured rate -log(1 - l dt) / dt
    is too large by l dt / 2, and as much again for the other first-order terms.
    """
    dt = 2e-8
    simulation = stretched([effects.BondDamping()], dt)
    mass, area = mass_and_area(simulation)
    damping, stiffness = CONCRETE.normal_damping * area, CONCRETE.normal_stiffness * area
    root = np.sqrt(damping**2 - 2.0 * mass * stiffness)
    slow, fast = (damping - root) / mass, (damping + root) / mass
    marks = [0, 12, 500, 600]
    found = openings(simulation, marks)
    assert fast > 50 * slow and fast * marks[2] * dt > 13
    assert np.all(np.diff(found) < 0.0) and found[-1] > 0.0
    measured = -np.log(found[3] / found[2]) / (100 * dt)
    noise = 2 * NOISE / STRETCH / (100 * dt * slow)
    assert measured == pytest.approx(slow, rel=slow * dt + noise)
    left = found[:2] - found[2] * np.exp(measured * dt * (500 - np.array(marks[:2])))
    # From rest the fast part starts as slow / (fast - slow) of the stretch, against it, less
    # fast dt / 2 of itself: the first half of a step knows no velocity to damp.
    start = -STRETCH * slow / (fast - slow) * (1.0 - 0.5 * fast * dt)
    assert left[0] == pytest.approx(start, rel=2.0 * (fast * dt) ** 2 + slow * dt)
    assert -np.log(left[1] / left[0]) / (12 * dt) == pytest.approx(fast, rel=fast * dt)


@pytest.fixture(scope="module")
def probe():
    """Two different tetrahedra far apart; every face carries spheres."""
    first = np.array([[0, 0, 0], [0.05, 0, 0], [0, 0.06, 0], [0, 0, 0.055]])
    second = np.array([[0, 0, 0], [0.045, 0.01, 0], [0, 0.05, 0.01], [0.01, 0, 0.06]])
    points = np.vstack([first, second + np.array([0.5, 0, 0])])
    mesh = checked_mesh(points, [[0, 1, 2, 3], [4, 5, 6, 7]], {"base": [[0, 1, 2]]})
    touch = effects.SphereContact(outer_faces=True), effects.Friction()
    listed = filled("paper", *touch, group="base")
    return ContactProbe(mesh, listed)


SPHERES = (3, 24 + 8)
NORMAL = np.array([2.0, -1.0, 2.0]) / 3.0
SIDE = np.array([1.0, 2.0, 0.0]) / np.sqrt(5.0)


def placed(probe, overlap):
    """Positions of the bodies at which the two spheres overlap along NORMAL by overlap [m]."""
    first, second = probe.sphere[SPHERES[0]], probe.sphere[SPHERES[1]]
    apart = (first[3] + second[3] - overlap) * NORMAL
    return np.array([np.zeros(3), first[:3] + apart - second[:3]])


def middle(probe, overlap):
    """Middle of the overlap, in the world."""
    first = probe.sphere[SPHERES[0]]
    return first[:3] + (first[3] - 0.5 * overlap) * NORMAL


OVERLAP = 1e-4
#: Relative error of the overlap: a difference of lengths of 0.1 m, ten operations.
OVERLAP_ERROR = 10 * EPS * 0.1 / OVERLAP
FORCE_ERROR = 2 * OVERLAP_ERROR * K * OVERLAP


@pytest.mark.parametrize("factor", [-2.0, 0.5, 5.0])
def test_normal_force_is_spring_less_dashpot_and_never_pulls(probe, factor):
    """max(0, k overlap - c v_n), v_n the speed of parting, in units of k overlap / c."""
    rate = factor * K * OVERLAP / C
    wrench, heat = probe.evaluate(
        SPHERES, placed(probe, OVERLAP), None, np.array([0 * NORMAL, rate * NORMAL])
    )
    expected = max(0.0, K * OVERLAP - C * rate)
    assert np.abs(wrench[1, :3] - expected * NORMAL).max() < 6 * FORCE_ERROR
    # The dashpot takes what the spring's force less the contact's does along the way.
    taken = (K * OVERLAP - expected) * rate
    assert heat[0] == pytest.approx(taken, abs=6 * FORCE_ERROR * abs(rate))


@pytest.mark.parametrize("factor", [0.5, 20.0])
def test_friction_is_the_smaller_of_coulomb_and_dashpot(probe, factor):
    """min(mu F_n, c |v_t|) against the sliding; both meet at factor 1."""
    push = K * OVERLAP
    speed = factor * MU * push / C
    wrench, heat = probe.evaluate(
        SPHERES, placed(probe, OVERLAP), None, np.array([0 * SIDE, speed * SIDE])
    )
    rub = min(MU * push, C * speed)
    # SIDE is normal to NORMAL but for one rounding, which the dashpot turns into C speed EPS.
    error = 6 * FORCE_ERROR + 8 * EPS * C * speed
    assert np.abs(wrench[1, :3] - (push * NORMAL - rub * SIDE)).max() < error
    assert heat[1] == pytest.approx(rub * speed, abs=error * speed)


def test_action_is_reaction_at_the_middle_of_the_overlap(probe):
    """Opposite forces, both at one point: the torques are that arm times the force."""
    position = placed(probe, OVERLAP)
    velocity = np.array([[1.0, 0.5, -0.2], [-0.3, 0.4, 0.1]])
    spin = np.array([[30.0, -20.0, 5.0], [10.0, 0.0, -40.0]])
    wrench, _ = probe.evaluate(SPHERES, position, None, velocity, spin)
    assert np.array_equal(wrench[0, :3], -wrench[1, :3])
    assert np.linalg.norm(wrench[1, :3]) > K * OVERLAP
    arm = middle(probe, OVERLAP) - position
    expected = np.cross(arm, wrench[:, :3])
    scale = np.linalg.norm(wrench[1, :3]) * np.linalg.norm(arm, axis=1).max()
    # The point is known to one rounding of its place.
    assert np.abs(wrench[:, 3:] - expected).max() < 20 * EPS * scale
    speed = velocity + np.cross(spin, arm)
    slide = (speed[1] - speed[0]) - (speed[1] - speed[0]) @ NORMAL * NORMAL
    push = K * OVERLAP - C * (speed[1] - speed[0]) @ NORMAL
    rub = min(MU * push, C * np.linalg.norm(slide)) / np.linalg.norm(slide)
    force = push * NORMAL - rub * slide
    error = 6 * FORCE_ERROR + 100 * EPS * C * np.linalg.norm(spin, axis=1).max() * 0.1
    assert np.abs(wrench[1, :3] - force).max() < error


def test_heat_that_waits_in_a_pair_is_in_the_account(probe):
    """A pair keeps what its steps took until its first body books it [J]."""
    simulation = probe.simulation
    simulation.start()
    probe.state.set_motion(placed(probe, OVERLAP), [1.0, 0.0, 0.0, 0.0])
    simulation.broad_phase.search()
    taken = {"sphere_dashpot": 1.0, "friction": 2.0, "injected": 4.0, "hysteresis": 8.0}
    before = simulation.energy_balance.account()
    probe.store.heat[probe.store.near_slot[0]] = list(taken.values())
    after = simulation.energy_balance.account()
    gained = {name: after[name] - before[name] for name in taken}
    assert gained == pytest.approx(taken, rel=8 * EPS)
