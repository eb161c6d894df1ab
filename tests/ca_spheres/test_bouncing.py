"""A grain that bounces on a shaken base, beside a ball whose impacts take no time."""

import numpy as np
import pytest
from scipy.optimize import brentq

from ca_damper import Spheres
from ca_damper.spheres.contact_law import contact_duration, wall_numbers
from tests.ca_spheres.rig import Rig

G, F, RESTITUTION, DT = 9.8, 25.0, 0.5, 2e-5
OMEGA, PERIOD, STEPS = 2.0 * np.pi * F, 1.0 / F, 2000


def balls_flights(ratio):
    """Two flights in turn [periods] of a ball, on a base of an acceleration of ratio times g."""
    amplitude = ratio * G / OMEGA**2
    time, speed = 1e-3, 0.5 * G * PERIOD
    times = []
    for _ in range(1000):

        def gap(t, time=time, speed=speed):
            risen = amplitude * (np.sin(OMEGA * (time + t)) - np.sin(OMEGA * time))
            return speed * t - 0.5 * G * t * t - risen

        flight = brentq(gap, 0.5 * PERIOD, 1.5 * PERIOD, xtol=1e-12)
        time, base = time + flight, amplitude * OMEGA * np.cos(OMEGA * (time + flight))
        speed = base - RESTITUTION * (speed - G * flight - base)
        times.append(time)
    return np.sort(np.diff(times)[-2:]) * F


def flights(ratios):
    """Flights in turn [periods] of a grain at the default step, long after its start."""
    options = Spheres(restitution=RESTITUTION, wall_restitution=RESTITUTION)
    amplitude, count = np.array(ratios) * G / OMEGA**2, len(ratios)
    rig = Rig(options, [1] * count, DT, frequency=F, amplitude=list(amplitude))
    # Of one period: the base leaves an impact with (1 - e) / (1 + e) of the grain's speed g T / 2.
    share = (1.0 - RESTITUTION) / (1.0 + RESTITUTION)
    start = np.arccos(share * 0.5 * G * PERIOD / (amplitude * OMEGA)) / OMEGA
    for s, (a, t) in enumerate(zip(amplitude, start)):
        speed = 0.5 * G * PERIOD + G * t
        height = a * np.sin(OMEGA * t) - 0.5 * G * PERIOD * t - 0.5 * G * t * t
        rig.put((0.03, 0.5 * options.diameter + height), (0.0, speed - a * OMEGA - G * PERIOD), s)
    # Seen in the middle of flights, each a parabola: they meet where impacts are.
    rig.run(200 * STEPS + int((start.mean() + 0.5 * PERIOD) / DT))
    seen = []
    for _ in range(13):
        t, (place, speed) = rig.done * DT, (x[:, 0, 1] for x in rig.states())
        place = place + rig.in_use(rig.device.bodies.floor)
        seen.append((speed + G * t, place - speed * t - 0.5 * G * t * t))
        rig.run(STEPS)
    slope, height = np.diff(np.array(seen), axis=0).transpose(1, 2, 0)
    return np.diff(-height / slope) * F, options


def test_a_grain_on_a_shaken_base_doubles_its_period_where_a_ball_does():
    """Below and above the acceleration at which flights of one period become unstable, 1.527 g.

    Gamma^2 = (pi (1 - e) / (1 + e))^2 + (2 (1 + e^2) / (1 + e)^2)^2 of a ball. A flight of the
    grain begins and ends somewhere within an impact: it differs by two of them at most.
    """
    ratios = (1.51, 1.557)
    found, options = flights(ratios)
    wanted = np.array([balls_flights(ratio) for ratio in ratios])
    assert wanted[0] == pytest.approx(1.0, abs=1e-4) and np.diff(wanted[1])[0] > 0.1
    numbers = wall_numbers(options)
    # Seen from the base the grain arrives with g T / (1 + e).
    speed = G * PERIOD / (1.0 + RESTITUTION)
    impact = contact_duration(numbers["mass"], numbers["stiffness"], speed) * F
    for last in (slice(-2, None), slice(-3, -1)):
        assert np.sort(found[:, last]) == pytest.approx(wanted, abs=2.0 * impact)
