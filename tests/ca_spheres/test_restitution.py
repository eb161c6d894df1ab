"""Rebound of one sphere from a wall and of two from each other: speed, duration, order."""

import math

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp

from ca_damper.spheres import Spheres
from ca_damper.spheres.contact_law import (
    POWERS,
    contact_duration,
    damping_number,
    pair_numbers,
    restitution_of,
    wall_numbers,
)
from tests.ca_spheres.rig import Rig

# Every speed with a step of 5e-6 and of 1e-6 s.
SPEEDS = np.array([0.2, 0.5, 1.5] * 2)
STEPS = np.repeat([5e-6, 1e-6], 3)
DTS = 1e-5 * 0.5 ** np.arange(5)
# Speed at which orders are found [m/s].
SPEED = 0.5


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


@pytest.mark.parametrize(("restitution", "power"), [(0.01, 0.5), (0.3, 0.25), (0.75, 0.5)])
def test_a_dashpot_gives_the_restitution_asked_for_as_an_independent_solver_finds(
    restitution, power
):
    # Both solvers err less than 1e-7 (fourth order with 256 steps a unit; d^(1/4) limits scipy's);
    # bisection ends 2^-40 from the root.
    number = damping_number(restitution, power)
    assert restitution_of(number, power) == pytest.approx(restitution, abs=1e-9)
    assert rebound_by_scipy(number, power) == pytest.approx(restitution, abs=1e-6)


def test_stiffness_is_that_of_equations_5_and_6():
    # Written as in the paper, with moduli and Poisson's ratios that differ.
    e, e0, s, s0, r = 2e9, 0.7e9, 0.25, 0.4, 4e-3
    options = Spheres(young=e, wall_young=e0, poisson=s, wall_poisson=s0, diameter=2 * r)
    wall = 4 * np.sqrt(r) / 3 * e * e0 / ((1 - s**2) * e0 + (1 - s0**2) * e)
    pair = np.sqrt(2 * r) / 3 * e / (1 - s**2)
    assert wall_numbers(options)["stiffness"] == pytest.approx(wall, rel=1e-14)
    assert pair_numbers(options)["stiffness"] == pytest.approx(pair, rel=1e-14)


def scale(numbers, speed):
    """Time D / v of a contact [s], D^(5/2) = m v^2 / k."""
    return (numbers["mass"] * speed**2 / numbers["stiffness"]) ** 0.4 / speed


def wall_rebound(options, speeds, dts):
    """Speeds after over speeds before, one a scene."""
    rig = Rig(options, np.ones(len(speeds), int), dts)
    for s, speed in enumerate(speeds):
        rig.put((0.03, 0.0035), (0.0, -speed), s)
    rig.run(int((5e-4 + 1e-3 / min(speeds)) / min(dts)))
    return rig.states()[1][:, 0, 1] / speeds


PAIR = [(0.027, 0.05), (0.034, 0.05)]


def pair_rebound(options, speeds, dts):
    rig = Rig(options, np.full(len(speeds), 2), dts)
    for s, speed in enumerate(speeds):
        rig.put(PAIR, [(0.5 * speed, 0.0), (-0.5 * speed, 0.0)], s)
    rig.run(int((5e-4 + 1e-3 / min(speeds)) / min(dts)))
    across = rig.states()[1][:, :, 0]
    return (across[:, 1] - across[:, 0]) / speeds


CASES = {"wall": (wall_rebound, wall_numbers), "pair": (pair_rebound, pair_numbers)}


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
    rebound, numbers = CASES[partner]
    options = Spheres(damping="tsuji", gravity=0.0)
    bounds = error_bound(numbers(options), "tsuji", SPEEDS, STEPS)
    assert np.all(np.abs(rebound(options, SPEEDS, STEPS) - 0.75) < bounds)


@pytest.mark.parametrize("partner", CASES)
def test_printed_law_rebounds_less_at_higher_speed(partner):
    # alpha = c D^(3/2) / (m v) grows like v^(1/5) for one c, and keeps e at the reference speed.
    rebound, numbers = CASES[partner]
    options = Spheres(damping="printed", gravity=0.0, reference_speed=0.5)
    alphas = damping_number(0.75, 0.5) * (SPEEDS / 0.5) ** 0.2
    wanted = np.array([restitution_of(alpha, 0.5) for alpha in alphas])
    bounds = error_bound(numbers(options), "printed", SPEEDS, STEPS)
    assert np.all(np.abs(rebound(options, SPEEDS, STEPS) - wanted) < bounds)
    assert wanted[0] - wanted[-1] > 0.05 and wanted[1] == pytest.approx(0.75, abs=1e-9)


def phases(options, dt):
    """Rebounds in which the wall is met at 16 phases of a step, eight scenes at a time.

    Returns speed after over speed before, and the time spent in contact [s]; arrays (16,).
    """
    gaps = 0.5e-3 + np.arange(16) / 16 * SPEED * dt
    return np.hstack([met(options, some, dt) for some in gaps.reshape(2, 8)])


def met(options, gaps, dt):
    """The same of spheres thrown at the wall from so far [m]."""
    rig = Rig(options, [1] * len(gaps), dt)
    for s, gap in enumerate(gaps):
        rig.put((0.03, options.radius + gap), (0.0, -SPEED), s)
    places, velocities = rig.run(round(2e-3 / dt)).states()
    out, height = velocities[:, 0, 1], places[:, 0, 1] - options.radius
    return out / SPEED, rig.done * dt - gaps / SPEED - height / out


def halvings(options):
    """Rebounds and contacts at falling steps, arrays (steps, 16)."""
    return map(np.array, zip(*(phases(options, dt) for dt in DTS)))


def slope(dts, errors):
    """Order: of the root mean square over phases, as single phases scatter."""
    return np.polyfit(np.log(dts), np.log(np.sqrt((errors**2).mean(axis=1))), 1)[0]


def test_duration_of_a_contact_is_hertzs_with_an_error_of_second_order():
    options = Spheres(wall_restitution=1.0, gravity=0.0)
    numbers = wall_numbers(options)
    wanted = contact_duration(numbers["mass"], numbers["stiffness"], SPEED)
    # Hertz: 2 D' / v times the integral below, with D' = (5/4)^(2/5) D; quad errs by 1e-9.
    integral = quad(lambda x: 2.0 / math.sqrt(1.0 - x**2.5), 0.0, 1.0)[0]
    assert wanted == pytest.approx(integral * 1.25**0.4 * scale(numbers, SPEED), rel=1e-8)
    _, contact = halvings(options)
    # The bisected dashpot of restitution 1 is off by 1e-12 at most; 0.2 tells 2 from 1 and 3.
    assert slope(DTS, contact / wanted - 1.0) == pytest.approx(2.0, abs=0.2)
    assert np.abs(contact[-1] / wanted - 1.0).max() < 0.2 * (DTS[-1] / scale(numbers, SPEED)) ** 2


@pytest.mark.parametrize("damping", POWERS)
def test_restitution_converges_with_the_order_of_the_dashpots_onset(damping):
    # The force begins like t^p: order 1 + p, 5/4 or 3/2, as the leapfrog's 2 is higher.
    rebounds, _ = halvings(Spheres(damping=damping, gravity=0.0))
    assert slope(DTS, rebounds - 0.75) == pytest.approx(1.0 + POWERS[damping], abs=0.15)
