"""Solved dashpots on a bonded pair: the scheme to round-off, its order.

Solved dashpots against explicit ones with a tiny step: small scenes, side by side in a mesh.
"""

import numpy as np
import pytest

from taichi_dem import CONCRETE, ImplicitDashpots, Scene, Simulation, Uniform, effects
from taichi_dem.kit.allocation import assign
from taichi_dem.mesh.shapes import bar, pair, placed_together, single
from taichi_dem.state.timeline import MACRO_TICKS
from tests.structures import filled
from tests.verification.test_limits import Rig

EPS = np.finfo(float).eps
#: So tight that the sweeps add nothing to what is measured.
TIGHT = {"sweeps": (2, 200), "tolerance": 1e-12}
#: Stretch of the pair [m], and how well openings are known: differences of positions of 0.02 m.
STRETCH = 1e-6
NOISE = 4 * 0.02 * EPS
#: Distance of the scenes from each other [m]: they never meet.
APART = 2.0
#: Speeds [m/s]: of the fragment, of two bodies that collide, of the halves of a pair pulled apart.
SHOT, MEETING, PULL = [5.0, 1.0, 0.5], [3.0, 2.0, 0.0], [5.0, 0.0, 0.0]
UNTIL, STEP, TINY = 4e-5, 1e-7, 5e-10
#: All effects of the paper, for its kernels.
EFFECTS = [
    effects.BondDamping(),
    effects.Softening(),
    effects.ShearSlip(),
    effects.SphereContact(outer_faces=True),
    effects.Friction(),
    effects.GasPressure("pressed_left", peak=1e8, rise=2e-5),
]
METHODS = {
    "explicit": Uniform(TINY, 1.0),
    # The sweeps add nothing to what is measured.
    "solved": ImplicitDashpots(STEP, sweeps=(2, 200), tolerance=1e-9),
}


@pytest.fixture(scope="module")
def rigs():
    """A damped bonded pair, compiled once, by theta."""
    made = Rig(pair(), filled("bonds", effects.BondDamping()), ImplicitDashpots(1e-9, **TIGHT))

    def rig(theta):
        made.simulation.reset(method=ImplicitDashpots(1e-9, theta=theta, **TIGHT))
        made.simulation.start()
        return made

    return rig


def damped(rig, share):
    """Give the dashpots a share of the material's coefficients; rates of the normal mode.

    Returns the square of the frequency 2 k A / m and the damping rate 2 c A / m, in 1/s^2 and 1/s.
    """
    law = share * np.array([CONCRETE.normal_damping, CONCRETE.shear_damping])
    coefficient = rig.simulation.tables.dashpot.coefficient
    assign(coefficient, np.tile(law, (rig.simulation.model.bond_count, 1)))
    per_mass = 2.0 * 3.0 * rig.simulation.tables.unit_area[0] / rig.simulation.model.body_mass[0]
    return CONCRETE.normal_stiffness * per_mass, law[0] * per_mass


def openings(rig, dt, marks, speed=0.0):
    """Opening [m] after numbers of steps, from STRETCH and a speed at which the bodies part."""
    apart = np.array([[-0.5, 0.0, 0.0], [0.5, 0.0, 0.0]])
    found = []
    for steps in marks:
        rig.speeds(dt, steps, rig.centre + STRETCH * apart, speed * apart, np.zeros((2, 3)))
        place = rig.state.position
        found.append(place[1][0] - place[0][0] - np.diff(rig.centre[:, 0])[0])
    return np.array(found)


def recurrence(dt, steps, stiff, rate, theta, speed=0.0):
    """v' = v - dt stiff u - dt rate (theta v' + (1 - theta) v), u' = u + dt v'; all openings."""
    opening, found = STRETCH, [STRETCH]
    for _ in range(steps):
        kept = (1.0 - (1.0 - theta) * dt * rate) * speed - dt * stiff * opening
        speed = kept / (1.0 + theta * dt * rate)
        opening += dt * speed
        found.append(opening)
    return np.array(found)


@pytest.mark.parametrize("theta", [0.5, 1.0])
def test_an_overdamped_pair_follows_the_recurrence_to_round_off(rigs, theta):
    """At 20 times the step that explicit dashpots bear, where an error of the block would show.

    A step rounds the opening by NOISE; dashpots this strong hold it, so that roundings add up.
    """
    rig = rigs(theta)
    stiff, rate = damped(rig, 10.0)
    dt, marks = 20.0 * 2.0 / rate, [1, 2, 3, 10, 100]
    assert dt**2 * stiff < 4.0
    expected = recurrence(dt, marks[-1], stiff, rate, theta)[marks]
    found = openings(rig, dt, marks)
    assert expected[-1] < 0.9 * STRETCH
    assert np.all(np.abs(found - expected) < np.array(marks) * NOISE)


@pytest.mark.parametrize("theta, order", [(0.5, 2), (1.0, 1)])
def test_the_slow_decay_is_met_in_the_order_of_theta(rigs, theta, order):
    """exp(-l t), l the smaller root of l^2 - 2 c A / m l + 2 k A / m = 0.

    Velocities live half a step behind: the run begins with that of -dt / 2, on the slow solution
    itself. Half the step, 1 / 2^order of the error; terms of the next order are the share
    l dt = 0.08 of it at the largest step, or its square where the scheme is symmetric in time.
    """
    rig = rigs(theta)
    stiff, rate = damped(rig, 1.0)
    slow = 0.5 * rate - np.sqrt(0.25 * rate**2 - stiff)
    steps, errors = 10, []
    time_s = steps * 4e-6
    for part in (1, 2, 4):
        dt = time_s / (steps * part)
        start = -slow * STRETCH * np.exp(0.5 * slow * dt)
        found = openings(rig, dt, [steps * part], start)[0]
        errors.append(found / STRETCH - np.exp(-slow * time_s))
    assert rate * 4e-6 > 5.0 and 1e-5 < abs(errors[0]) < (slow * 4e-6) ** order
    ratios = np.array(errors[:-1]) / errors[1:]
    assert ratios == pytest.approx([2.0**order] * 2, rel=0.08)


def driven(velocity, step, steps, speed=0.0, frequency=0.0):
    """Places [m] of a pair after some steps, less those at the start; its left side is driven.

    speed: of both bodies at first [m/s].
    """
    drive = effects.PrescribedMotion("left", velocity, frequency)
    scene = Scene(pair(), CONCRETE, [effects.BondDamping(), drive])
    simulation = Simulation(scene, ImplicitDashpots(step, **TIGHT))
    centre = simulation.model.centre
    simulation.state.set_motion(centre, [1.0, 0.0, 0.0, 0.0], speed)
    simulation.advance_to(steps)
    return simulation.values(simulation.state.position) - centre


def test_a_driven_body_gives_way_no_more_than_a_fixed_one():
    """Seen from a support with a constant velocity, a pair moves as beside one at rest.

    Places grow to 1e-4 m and round in each of the steps; the dashpots hand on what they get.
    """
    steps, step, found = 50, 1e-6, []
    for speed in np.array([[0.0, 0.0, 0.0], [3.0, -2.0, 1.0]]):
        moved = driven(speed, step, steps, speed + np.array([[0.0], [0.1]]))
        found.append(moved - speed * steps * step)
    assert np.abs(found[0][1]).max() > 1e-7
    assert np.abs(found[1] - found[0]).max() < 100 * steps * 0.02 * EPS


def test_a_body_beside_a_driven_one_follows_it_to_second_order():
    """Steps h, h/2, h/4: the differences of the neighbour's way have the ratio 4.

    A drive that the sweeps see half a step off would be of first order, ratio 2.
    """
    still = np.zeros((2, 3))
    places = [
        driven((0.3, 0.0, 0.1), 1e-6 / 2**k, 40 * 2**k, still, frequency=5e3)[1] for k in range(3)
    ]
    ratio = np.linalg.norm(places[0] - places[1]) / np.linalg.norm(places[1] - places[2])
    assert np.log2(ratio) == pytest.approx(2.0, abs=0.05)


def assembled():
    """One mesh of all parts, APART along x, with a group of bodies for each."""
    parts = {
        "stretched": bar(0.3, 0.1, (3, 1, 1)),
        "target": bar(0.2, 0.1, (2, 1, 1)),
        "fragment": single(),
        "first": single(),
        "second": single(),
        "pulled": pair(0.4),
        "pressed": bar(0.2, 0.1, (2, 1, 1)),
    }
    apart = [(APART * place, 0.0, 0.0) for place in range(len(parts))]
    return placed_together(dict(zip(parts, zip(parts.values(), apart))))


def closed(model, place, mover, partner, gap):
    """Shift `mover` along x towards `partner` until the smallest gap of their spheres is `gap`."""
    size = 4 * model.spheres.per_face
    spheres = model.spheres
    ball = np.concatenate([spheres.centre, spheres.radius[..., None]], axis=-1)
    sphere = ball.reshape(-1, 4)
    centre = sphere[:, :3] + np.repeat(place, size, axis=0)
    own = np.concatenate([np.arange(size * b, size * b + size) for b in mover])
    others = np.concatenate([np.arange(size * b, size * b + size) for b in partner])
    apart = centre[others][None] - centre[own][:, None]
    reach = sphere[own, 3][:, None] + sphere[others, 3][None] + gap
    across = reach**2 - (apart[..., 1:] ** 2).sum(axis=-1)
    way = apart[..., 0][across > 0.0] - np.sqrt(across[across > 0.0])
    place[mover, 0] += way.min()


def start(model, bodies):
    """Places [m] and velocities [m/s] at the start."""
    place, velocity = model.centre.copy(), np.zeros_like(model.centre)
    stretched = bodies["stretched"]
    place[stretched, 0] += 1e-5 * (place[stretched, 0] - place[stretched, 0].mean())
    place[bodies["fragment"]] += [-APART - 0.1, 0.03, 0.04]
    closed(model, place, bodies["fragment"], bodies["target"], 2e-5)
    place[bodies["second"], 0] = place[bodies["first"], 0] + 0.2
    place[bodies["second"], 1:] += [0.004, 0.002]
    closed(model, place, bodies["first"], bodies["second"], 2e-5)
    velocity[bodies["fragment"]], velocity[bodies["first"]] = SHOT, MEETING
    velocity[bodies["pulled"]] = np.outer([-1.0, 1.0], PULL)
    return place, velocity


@pytest.fixture(scope="module")
def parts():
    """Bodies of each part by name."""
    return assembled().body_groups


@pytest.fixture(scope="module")
def runs(parts):
    """What both methods say at UNTIL: explicit, solved."""
    return [ended(assembled(), parts, method) for method in METHODS.values()]


def ended(mesh, bodies, method):
    """A run; what the tests below ask for, by name."""
    simulation = Simulation(Scene(mesh, CONCRETE, EFFECTS), method)
    place, velocity = start(simulation.model, bodies)
    simulation.state.set_motion(place, velocity=velocity)
    simulation.start()
    first = simulation.readings.bonds()
    simulation.advance_to(round(UNTIL / method.dt0))
    bonds, motion = simulation.readings.bonds(), simulation.motion()
    # Half a step of the dashpots is booked at the start.
    bonds[:, 1] -= first[:, 1]
    return {
        "moved": motion["position"] - place,
        "broken_s": simulation.values(simulation.state.broken_tick) / MACRO_TICKS * method.dt0,
        "bonds": bonds,
        "account": simulation.energy_balance.account(),
        "velocity": motion["velocity"],
        "model": simulation.model,
    }


def test_displacements_agree_with_tiny_explicit_steps(runs, parts):
    """To 0.1 % of the largest, at 200 times the step: both schemes tend to the same motion.

    Without contact the error is of second order, (w dt)^2 of the motion, w < 1e5 1/s; contacts are
    met up to a step late, of the hundreds that follow.
    """
    for name, bodies in parts.items():
        if name != "pulled":
            first, second = (run["moved"][bodies] for run in runs)
            assert np.abs(first - second).max() < 1e-3 * np.abs(first).max(), name


def test_the_scenes_are_what_they_are_called(runs, parts):
    """Contacts met, slid and stopped; gas pushed; just the pulled pair broke."""
    for run in runs:
        account = run["account"]
        assert min(account[name] for name in ("friction", "sphere_dashpot")) > 1e-3
        assert account["load_work"] > 0.0
        speed = {name: run["velocity"][of] for name, of in parts.items()}
        assert speed["fragment"][0, 0] < 0.5 * SHOT[0]
        assert np.abs(speed["target"]).max() > 0.01
        assert abs(speed["second"][0, 0] - speed["first"][0, 0]) < 0.1 * MEETING[0]
        assert 0.1 < speed["second"][0, 1] < speed["first"][0, 1] < MEETING[1]
        assert (run["broken_s"] > 0.0).sum() == 1


def test_softening_and_release_inside_a_step(runs, parts):
    """A pair pulled apart spends its fracture energy and breaks in the step in which it must.

    Kinetic energy falls by what the dashpots took and by that. Springs work with the means of the
    velocities: a trapezoidal rule along the envelope. Its error is that at the kink, of
    (k + slope) du^2 / 8 an area at most, and half of the last step's overshoot, less than that.
    """
    model, pulled = runs[1]["model"], parts["pulled"]
    bond = model.topology.master.tolist().index(pulled[0])
    broken = [run["broken_s"][bond] for run in runs]
    assert broken[0] > 30 * STEP
    assert abs(broken[1] - broken[0]) <= STEP
    area = 3.0 * model.bonds["area"][bond]
    fracture = area * CONCRETE.fracture_energy
    for run in runs:
        dashpot, _, release, softening = run["bonds"][bond][1:]
        assert softening + release == pytest.approx(fracture, rel=1e-9)
        assert dashpot > fracture
    mass = model.body_mass[pulled]
    first = 0.5 * mass.sum() * PULL[0] ** 2
    dashpot = runs[1]["bonds"][bond][1]
    last = 0.5 * (mass * (runs[1]["velocity"][pulled] ** 2).sum(axis=1)).sum()
    opened = 2.0 * PULL[0] * STEP
    bound = 2.0 * area * (CONCRETE.normal_stiffness + CONCRETE.softening_slope) * opened**2 / 8.0
    assert bound < 1e-2 * fracture
    # Half a step of the dashpots is booked at time zero, to second order in their rate.
    rate = 2.0 * CONCRETE.normal_damping * area / mass[0]
    bound += 0.25 * (STEP * rate) ** 2 * first
    assert abs(first - last - dashpot - fracture) < bound
