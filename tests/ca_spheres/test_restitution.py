"""Rebound of one sphere from a wall and of two from each other: speed, duration, order."""

import math

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp

from ca_damper.spheres import Spheres
from ca_damper.spheres.contact_law import POWERS, contact_duration, pair_numbers, wall_numbers
from ca_damper.spheres.restitution import damping_number, restitution_of
from tests.ca_spheres.rig import Rig

# Every speed with a step of 5e-6 and of 1e-6 s.
SPEEDS = np.array([0.2, 0.5, 1.5] * 2)
STEPS = np.repeat([5e-6, 1e-6], 3)
WALL = {"gravity": 0.0, "start": [(0.03, 0.0035)]}
PAIR = {"gravity": 0.0, "start": [(0.027, 0.05), (0.034, 0.05)]}


def rebound_by_scipy(alpha, power):
    """Restitution in units where mass, stiffness and speed are one; the force ends the contact."""

    def fall(t, y):
        depth = max(y[0], 0.0)
        return [y[1], -(depth**1.5 + alpha * depth**power * y[1])]

    def force(t, y):
        return fall(t, y)[1] if t > 0.5 else -1.0

    force.terminal, force.direction = True, 1.0
    run = solve_ivp(fall, (0.0, 50.0), [0.0, 1.0], rtol=1e-11, atol=1e-13, events=force)
    return -run.y_events[0][0][1]


@pytest.mark.parametrize("power", [0.25, 0.5])
@pytest.mark.parametrize("alpha", [0.05, 0.25, 1.5])
def test_restitution_of_a_dashpot_is_that_of_an_independent_solver(alpha, power):
    # Both solvers err less than 1e-7 (fourth order with 256 steps a unit; d^(1/4) limits scipy's).
    assert restitution_of(alpha, power) == pytest.approx(rebound_by_scipy(alpha, power), abs=1e-6)


@pytest.mark.parametrize("power", [0.25, 0.5])
@pytest.mark.parametrize("restitution", [0.01, 0.3, 0.75, 0.99])
def test_dashpot_gives_the_restitution_asked_for(restitution, power):
    # Bisection ends 2^-40 from the root.
    number = damping_number(restitution, power)
    assert restitution_of(number, power) == pytest.approx(restitution, abs=1e-9)


def scale(numbers, speed):
    """Time D / v of a contact [s], D^(5/2) = m v^2 / k."""
    return (numbers["mass"] * speed**2 / numbers["stiffness"]) ** 0.4 / speed


def wall_rebound(options, speeds, dts):
    """Speeds after over speeds before, one a scene."""
    speeds, dts = np.broadcast_arrays(speeds, dts)
    rig = Rig(options, np.ones(len(speeds), int), dts)
    for s, speed in enumerate(speeds):
        rig.throw([0.0, -speed], s)
    rig.run(int((5e-4 + 1e-3 / min(speeds)) / min(dts)))
    return rig.states()[1][:, 0, 1] / speeds


def pair_rebound(options, speeds, dts):
    speeds, dts = np.broadcast_arrays(speeds, dts)
    rig = Rig(options, np.full(len(speeds), 2), dts)
    for s, speed in enumerate(speeds):
        rig.throw([[0.5 * speed, 0.0], [-0.5 * speed, 0.0]], s)
    rig.run(int((5e-4 + 1e-3 / min(speeds)) / min(dts)))
    across = rig.states()[1][:, :, 0]
    return (across[:, 1] - across[:, 0]) / speeds


CASES = {"wall": (WALL, wall_rebound, wall_numbers), "pair": (PAIR, pair_rebound, pair_numbers)}


def error_bound(numbers, damping, speed, dt):
    """How far off the restitution may be with a step dt [s], in steps h per contact time D / v.

    The dashpot's force begins like t^p, of which sums over steps miss up to a quarter of h^(1+p);
    the rest is smooth, of second order, with less than a tenth of h^2.
    """
    power = POWERS[damping]
    h = dt / scale(numbers, speed)
    return 0.25 * damping_number(0.75, power) * h ** (1.0 + power) + 0.1 * h**2


@pytest.mark.parametrize("partner", CASES)
def test_tsuji_keeps_the_restitution_at_every_speed(partner):
    place, rebound, numbers = CASES[partner]
    options = Spheres(damping="tsuji", **place)
    bounds = error_bound(numbers(options), "tsuji", SPEEDS, STEPS)
    assert np.all(np.abs(rebound(options, SPEEDS, STEPS) - 0.75) < bounds)


@pytest.mark.parametrize("speed", [0.2, 1.5])
@pytest.mark.parametrize("partner", CASES)
def test_printed_law_keeps_it_at_the_reference_speed(partner, speed):
    place, rebound, numbers = CASES[partner]
    options = Spheres(damping="printed", reference_speed=speed, **place)
    bounds = error_bound(numbers(options), "printed", speed, STEPS)
    assert np.all(np.abs(rebound(options, speed, STEPS) - 0.75) < bounds)


def test_printed_law_rebounds_less_at_higher_speed():
    # alpha = c D^(3/2) / (m v) grows like v^(1/5) for one c.
    options = Spheres(damping="printed", **WALL)
    alphas = damping_number(0.75, 0.5) * (SPEEDS / options.reference_speed) ** 0.2
    wanted = np.array([restitution_of(alpha, 0.5) for alpha in alphas])
    bounds = error_bound(wall_numbers(options), "printed", SPEEDS, STEPS)
    assert np.all(np.abs(wall_rebound(options, SPEEDS, STEPS) - wanted) < bounds)
    assert wanted[0] - wanted[-1] > 0.05


def test_wall_and_pair_have_their_own_restitution():
    options = {"restitution": 0.9, "wall_restitution": 0.4}
    (wall,) = wall_rebound(Spheres(**WALL, **options), [0.5], [1e-6])
    (pair,) = pair_rebound(Spheres(**PAIR, **options), [0.5], [1e-6])
    # The bound of 3/4 grows with the dashpot's strength, four times as large at 0.4.
    bound = error_bound(wall_numbers(Spheres()), "tsuji", 0.5, 1e-6)
    assert (wall, pair) == pytest.approx((0.4, 0.9), abs=4 * bound)


def test_the_default_step_gives_the_restitution_to_three_hundredths():
    # Seven steps a contact; the bound at the highest speed is 0.06, for the worst phase.
    options, speeds = Spheres(**WALL), np.array([0.1, 0.5, 1.5])
    rebounds = wall_rebound(options, speeds, [options.default_dt])
    bounds = error_bound(wall_numbers(options), "tsuji", speeds, options.default_dt)
    assert np.all(np.abs(rebounds - 0.75) < np.minimum(bounds, 0.03))


def phases(options, dts, speed=0.5, count=16):
    """Rebounds in which the wall is met at ``count`` phases of a step; arrays (dts, count).

    Returns speed after over speed before, and the time spent in contact [s].
    """
    table = np.repeat(dts, count)
    rig = Rig(options, np.ones(len(table), int), table)
    gaps = 0.5e-3 + np.tile(np.arange(count) / count, len(dts)) * speed * table
    for s, gap in enumerate(gaps):
        rig.throw([0.0, -speed], s)
        rig.shift([0.0, gap - 0.5e-3], s)
    steps = int(2e-3 / min(dts))
    rig.run(steps)
    places, velocities = rig.states()
    out, height = velocities[:, 0, 1], places[:, 0, 1] - options.radius
    contact = steps * table - gaps / speed - height / out
    return (out / speed).reshape(-1, count), contact.reshape(-1, count)


DTS = 1e-5 * 0.5 ** np.arange(5)


def slope(dts, errors):
    """Order: of the root mean square over phases, as single phases scatter."""
    return np.polyfit(np.log(dts), np.log(np.sqrt((errors**2).mean(axis=1))), 1)[0]


def test_duration_of_a_contact_is_hertzs_with_an_error_of_second_order():
    options = Spheres(wall_restitution=1.0, **WALL)
    numbers = wall_numbers(options)
    wanted = contact_duration(numbers["mass"], numbers["stiffness"], 0.5)
    # Hertz: 2 D' / v times the integral below, with D' = (5/4)^(2/5) D; quad errs by 1e-9.
    integral = quad(lambda x: 2.0 / math.sqrt(1.0 - x**2.5), 0.0, 1.0)[0]
    assert wanted == pytest.approx(integral * 1.25**0.4 * scale(numbers, 0.5), rel=1e-8)
    _, contact = phases(options, DTS)
    # The bisected dashpot of restitution 1 is off by 1e-12 at most; 0.2 tells 2 from 1 and 3.
    assert slope(DTS, contact / wanted - 1.0) == pytest.approx(2.0, abs=0.2)
    assert np.abs(contact[-1] / wanted - 1.0).max() < 0.2 * (DTS[-1] / scale(numbers, 0.5)) ** 2


@pytest.mark.parametrize("damping", POWERS)
def test_restitution_converges_with_the_order_of_the_dashpots_onset(damping):
    # The force begins like t^p: order 1 + p, 5/4 or 3/2, as the leapfrog's 2 is higher.
    rebounds, _ = phases(Spheres(damping=damping, **WALL), DTS)
    assert slope(DTS, rebounds - 0.75) == pytest.approx(1.0 + POWERS[damping], abs=0.15)


def test_spheres_never_pull_each_other():
    # A dashpot this strong would pull while the spheres part; the clamped force only pushes.
    rig = Rig(Spheres(restitution=0.05, **PAIR), 2, 1e-6)
    rig.throw([[0.25, 0.0], [-0.25, 0.0]])
    before = 0.5
    for _ in range(300):
        velocity = rig.run(20).state()[1]
        approach = velocity[0, 0] - velocity[1, 0]
        # One rounding a step at most raises it.
        assert approach <= before + 20 * 1e-16
        before = approach
    assert before < 0.0


def test_stiffness_is_that_of_equations_5_and_6():
    # Written as in the paper, with moduli and Poisson's ratios that differ.
    e, e0, s, s0, r = 2e9, 0.7e9, 0.25, 0.4, 4e-3
    options = Spheres(young=e, wall_young=e0, poisson=s, wall_poisson=s0, diameter=2 * r)
    wall = 4 * np.sqrt(r) / 3 * e * e0 / ((1 - s**2) * e0 + (1 - s0**2) * e)
    pair = np.sqrt(2 * r) / 3 * e / (1 - s**2)
    assert wall_numbers(options)["stiffness"] == pytest.approx(wall, rel=1e-14)
    assert pair_numbers(options)["stiffness"] == pytest.approx(pair, rel=1e-14)


@pytest.mark.parametrize("partner", CASES)
def test_energy_in_a_contact_goes_to_its_spring_and_back(partner):
    # Half a contact on, all speed is gone; the leapfrog swings by h^2 about the energy it keeps.
    place, _, numbers = CASES[partner]
    options, dt = Spheres(restitution=1.0, wall_restitution=1.0, **place), 1e-6
    numbers = numbers(options)
    half = 0.5 * contact_duration(numbers["mass"], numbers["stiffness"], 0.5)
    gap = 0.5e-3 if partner == "wall" else 1e-3
    rig = Rig(options, len(place["start"]), dt)
    rig.throw([[0.0, -0.5]] if partner == "wall" else [[0.25, 0.0], [-0.25, 0.0]])
    before = 0.5 * numbers["mass"] * 0.5**2
    rig.run(round((gap / 0.5 + half) / dt))
    # The turning point is missed by a step at most: by the largest deceleration times dt in speed.
    deepest = (1.25 * numbers["mass"] * 0.5**2 / numbers["stiffness"]) ** 0.4
    fastest = numbers["stiffness"] * deepest**1.5 / numbers["mass"] * dt
    assert np.abs(rig.state()[1]).max() < fastest
    bound = (dt / scale(numbers, 0.5)) ** 2
    assert rig.energy() == pytest.approx(before, rel=bound)
    assert rig.run(round(half / dt) + 5).energy() == pytest.approx(before, rel=bound)
