"""Measures of signals whose measures are known: RMS, apparent mass and damping, power, peaks."""

import math

import numpy as np
import pytest

from ca_damper import Oscillator
from ca_damper.report.measures import Cycles, peak

STEPS, COUNT, OMEGA = 500, 4, 2.0 * math.pi * 6.0


def cycles_of(x, v, f):
    """Cycles of one scene; x, v: functions of time, f: of the step's begin and end (its mean)."""
    dt = 2.0 * math.pi / OMEGA / STEPS
    t = dt * np.arange(COUNT * STEPS).reshape(COUNT, STEPS)
    cos, sin = np.cos(OMEGA * t), np.sin(OMEGA * t)
    middle = OMEGA * (t + dt / 2.0)
    xs, vs, fs = x(t), v(t), f(t, t + dt)
    products = (xs, xs**2, xs * cos, xs * sin, vs * cos, vs * sin)
    forces = (fs, fs * np.cos(middle), fs * np.sin(middle))
    sums = [part.sum(axis=1) for part in (*products, *forces)]
    record = np.stack([*sums, xs.max(axis=1), xs.min(axis=1), 3.0 * np.arange(COUNT)], axis=1)
    return Cycles(np.array([OMEGA / (2.0 * math.pi)]), np.array([STEPS]), record[None])


def nothing(t, _=None):
    return 0.0 * t


def test_response_of_two_harmonics_and_a_mean():
    # RMS about the mean: sqrt((A^2 + B^2) / 2), by sums that are exact for harmonics below n / 2.
    def x(t):
        return 0.4 + 2.0 * np.cos(OMEGA * t + 0.3) + 0.5 * np.sin(3.0 * OMEGA * t)

    cycles = cycles_of(x, nothing, nothing)
    assert cycles.rms == pytest.approx(math.sqrt((4.0 + 0.25) / 2.0), rel=1e-13)
    assert cycles.rms_about_all == pytest.approx(cycles.rms, rel=1e-13)
    assert cycles.mean == pytest.approx(0.4, rel=1e-13)
    assert cycles.harmonic("x") == pytest.approx(2.0 * np.exp(0.3j), rel=1e-13)
    assert cycles.energy == pytest.approx(4.5)


def test_apparent_mass_and_damping_are_those_of_a_mass_and_a_dashpot():
    # f = -(m a + c v); its mean over a step is that of the differences of v and x.
    mass, damping = -0.002, 0.05

    def x(t):
        return 0.02 * np.sin(OMEGA * t + 0.5)

    def v(t):
        return 0.02 * OMEGA * np.cos(OMEGA * t + 0.5)

    def f(begin, end):
        return -(mass * (v(end) - v(begin)) + damping * (x(end) - x(begin))) / (end - begin)

    cycles = cycles_of(x, v, f)
    assert cycles.apparent_mass == pytest.approx(mass, rel=1e-11)
    assert cycles.apparent_damping == pytest.approx(damping, rel=1e-11)
    power = 0.5 * (0.02 * OMEGA) ** 2 * (damping + 1j * OMEGA * mass)
    assert cycles.complex_power == pytest.approx(power, rel=1e-11)
    loss = damping / (OMEGA * (0.086 + mass))
    assert cycles.loss_factor(0.086) == pytest.approx(loss, rel=1e-11)
    ratio = (0.08 + damping) / (2.0 * math.sqrt(123.4 * (0.086 + mass)))
    assert cycles.damping_ratio(0.086, 123.4, 0.08) == pytest.approx(ratio, rel=1e-11)
    assert np.isnan(cycles_of(nothing, nothing, nothing).apparent_mass).all()


@pytest.mark.parametrize("damping", [0.0006, 0.05])
@pytest.mark.parametrize("offset", np.linspace(0.0, 1.0, 4))
def test_peak_of_an_oscillator_from_a_grid_of_one_percent(damping, offset):
    """To (2 z)^2, the share of the base's velocity in its pull, and to the cube of the spacing.

    The numerator 1 + (2 z r)^2 of the transfer function makes a cubic of (2 z)^2 times that of the
    squares, 0.02 apart; the grid falls anywhere.
    """
    o = Oscillator(damping=2.0 * damping * math.sqrt(123.4 * 0.086))
    ratios = 0.95 + 0.01 * (np.arange(11) + offset)
    found = peak(ratios, o.rms(ratios * o.natural_frequency))
    assert found == pytest.approx(o.peak(), rel=4.0 * damping**2 + 0.02**3)


def test_noise_is_no_resonance_between_the_points():
    """Points of a noisy curve [mm] that a narrow resonance would put at 27 mm, but for the next."""
    curve = [8.85, 4.13, 11.55, 10.93, 7.31]
    ratios = np.linspace(0.96, 1.04, 5)
    assert peak(ratios[1:4], curve[1:4])[1] > 2.0 * max(curve)
    ratio, height = peak(ratios, curve)
    assert 1.0 < ratio < 1.02 and max(curve) < height < 1.1 * max(curve)
