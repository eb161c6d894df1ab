"""Solved dashpots on a bonded pair: the scheme to round-off, and its order."""

import numpy as np
import pytest

from taichi_dem import CONCRETE, ImplicitDashpots, Scene, Simulation, effects
from taichi_dem.kit.allocation import assign
from taichi_dem.mesh.shapes import pair, placed_together
from tests.structures import POST, filled
from tests.verification.test_limits import Rig

EPS = np.finfo(float).eps
#: So tight that the sweeps add nothing to what is measured.
TIGHT = {"sweeps": (2, 200), "tolerance": 1e-12}
#: Stretch of the pair [m], and how well openings are known: differences of positions of 0.02 m.
STRETCH = 1e-6
NOISE = 4 * 0.02 * EPS


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
    """v' = v - dt stiff u - dt rate (theta v' + (1 - theta) v), u' = u + dt v'; all openings.

    And the heat of all steps up to each one per reduced mass, dt rate (theta v' + (1 - theta) v)^2.
    """
    opening, heat, found = STRETCH, 0.0, [(STRETCH, 0.0)]
    for _ in range(steps):
        kept = (1.0 - (1.0 - theta) * dt * rate) * speed - dt * stiff * opening
        before, speed = speed, kept / (1.0 + theta * dt * rate)
        opening += dt * speed
        heat += dt * rate * (theta * speed + (1.0 - theta) * before) ** 2
        found.append((opening, heat))
    return np.transpose(found)


@pytest.mark.parametrize("theta", [0.5, 1.0])
def test_an_overdamped_pair_follows_the_recurrence_to_round_off(rigs, theta):
    """At 20 times the step that explicit dashpots bear, where an error of the block would show.

    A step rounds the opening by NOISE; dashpots this strong hold it, so that roundings add up. The
    pair moves at the start: no heat is booked of a step before that. Heats are known as speeds are,
    from differences of openings.
    """
    rig = rigs(theta)
    stiff, rate = damped(rig, 10.0)
    dt, marks = 20.0 * 2.0 / rate, [1, 2, 3, 10, 100]
    assert dt**2 * stiff < 4.0
    speed = -0.01 * STRETCH / dt
    expected, heats = recurrence(dt, marks[-1], stiff, rate, theta, speed)[:, marks]
    found = openings(rig, dt, marks, speed)
    assert expected[-1] < 0.9 * STRETCH
    assert np.all(np.abs(found - expected) < np.array(marks) * NOISE)
    heat = rig.state.bond_drag[0] / (0.5 * rig.simulation.model.body_mass[0])
    known = 2.0 * marks[-1] * NOISE / (STRETCH - expected[-1])
    assert heat == pytest.approx(heats[-1], rel=known)


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
    mesh = placed_together({"pair": (pair(), (0.0, 0.0, 0.0))} | POST)
    laws = filled("supports", effects.BondDamping(), drive, group="post_base")
    given = np.zeros((3, 3))
    given[:2] = speed
    simulation = Simulation(
        Scene(mesh, CONCRETE, laws, velocity=given), ImplicitDashpots(step, **TIGHT)
    )
    simulation.advance_to(steps)
    return (simulation.motion()["position"] - simulation.model.centre)[:2]


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
    places = [driven((0.3, 0.0, 0.1), 1e-6 / 2**k, 40 * 2**k, frequency=5e3)[1] for k in range(3)]
    ratio = np.linalg.norm(places[0] - places[1]) / np.linalg.norm(places[1] - places[2])
    assert np.log2(ratio) == pytest.approx(2.0, abs=0.05)
