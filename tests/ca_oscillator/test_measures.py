"""Measures of signals whose measures are known."""

import math

import numpy as np
import pytest

from ca_damper import Oscillator
from ca_damper.measures import COLUMNS, Cycles, peak
from ca_damper.plot import Box, FilmMeasures
from ca_damper.record import Frame

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
    assert record.shape[1] == len(COLUMNS)
    return Cycles(np.array([OMEGA / (2.0 * math.pi)]), np.array([STEPS]), record[None])


def nothing(t, _=None):
    return 0.0 * t


def test_response_of_two_harmonics_and_a_mean():
    # RMS about the mean: sqrt((A^2 + B^2) / 2), by sums that are exact for harmonics below n / 2.
    def x(t):
        return 0.4 + 2.0 * np.cos(OMEGA * t + 0.3) + 0.5 * np.sin(3.0 * OMEGA * t)

    cycles = cycles_of(x, nothing, nothing)
    assert cycles.rms == pytest.approx(math.sqrt((4.0 + 0.25) / 2.0), rel=1e-13)
    assert cycles.mean == pytest.approx(0.4, rel=1e-13)
    assert cycles.harmonic("x") == pytest.approx(2.0 * np.exp(0.3j), rel=1e-13)
    assert cycles.harmonic_by_cycle("x").mean(axis=1) == pytest.approx(cycles.harmonic("x"))
    assert cycles.energy == pytest.approx(4.5)


def test_a_motion_of_half_the_frequency_counts_about_the_mean_of_all_cycles():
    """The mean of each cycle takes half of it away; that of all cycles takes nothing."""
    cycles = cycles_of(lambda t: 0.2 + np.sin(0.5 * OMEGA * t), nothing, nothing)
    assert cycles.rms_about_all == pytest.approx(math.sqrt(0.5), rel=1e-6)
    # Mean of half a wave: 2 / pi.
    assert cycles.rms == pytest.approx(math.sqrt(0.5 - (2.0 / math.pi) ** 2), rel=1e-4)


def test_both_rms_agree_for_whole_waves():
    cycles = cycles_of(lambda t: 0.4 + 2.0 * np.cos(OMEGA * t + 0.3), nothing, nothing)
    assert cycles.rms_about_all == pytest.approx(cycles.rms, rel=1e-13)


def test_amplitude_is_half_the_range():
    cycles = cycles_of(lambda t: 0.1 + 2.0 * np.sin(OMEGA * t), nothing, nothing)
    # Quarter cycles are steps here, so the extremes are samples.
    assert cycles.amplitude == pytest.approx(2.0, rel=1e-13)


def test_a_mean_that_drifts_from_cycle_to_cycle_is_no_response():
    def x(t):
        return np.floor(OMEGA * t / (2.0 * math.pi) + 1e-9) + 2.0 * np.sin(OMEGA * t)

    assert cycles_of(x, nothing, nothing).rms == pytest.approx(math.sqrt(2.0), rel=1e-13)


@pytest.mark.parametrize(("mass", "damping"), [(0.01, 0.0), (0.0, 0.3), (-0.002, 0.05)])
def test_apparent_mass_and_damping_are_those_of_a_mass_and_a_dashpot(mass, damping):
    # f = -(m a + c v); its mean over a step is that of the differences of v and x.
    def x(t):
        return 0.02 * np.sin(OMEGA * t + 0.5)

    def v(t):
        return 0.02 * OMEGA * np.cos(OMEGA * t + 0.5)

    def f(begin, end):
        return -(mass * (v(end) - v(begin)) + damping * (x(end) - x(begin))) / (end - begin)

    cycles = cycles_of(x, v, f)
    assert cycles.apparent_mass == pytest.approx(mass, rel=1e-11, abs=1e-14)
    assert cycles.apparent_damping == pytest.approx(damping, rel=1e-11, abs=1e-13)
    power = 0.5 * (0.02 * OMEGA) ** 2 * (damping + 1j * OMEGA * mass)
    assert cycles.complex_power == pytest.approx(power, rel=1e-11)
    loss = damping / (OMEGA * (0.086 + mass))
    assert cycles.loss_factor(0.086) == pytest.approx(loss, rel=1e-11, abs=1e-12)
    ratio = (0.08 + damping) / (2.0 * math.sqrt(123.4 * (0.086 + mass)))
    assert cycles.damping_ratio(0.086, 123.4, 0.08) == pytest.approx(ratio, rel=1e-11)


def test_what_the_base_gives_the_dashpot_and_the_filling_take():
    """In the steady state of the empty container, by its transfer function."""
    o, frequency = Oscillator(), 6.3
    x, w = o.base_amplitude * o.transfer(frequency), 2.0 * np.pi * frequency
    record = np.zeros((1, 1, len(COLUMNS)))
    for name, value in (("x", -1j * x), ("v", w * x)):
        record[0, 0, COLUMNS.index(f"{name}_cos")] = 50.0 * value.real
        record[0, 0, COLUMNS.index(f"{name}_sin")] = -50.0 * value.imag
    cycles = Cycles(np.array([frequency]), np.array([100]), record)
    powers = cycles.powers(o.base_amplitude, o.stiffness, o.damping)
    assert (
        powers["base"][0] == pytest.approx(powers["dashpot"][0], rel=1e-12) and powers["base"] > 0
    )
    assert powers["filling"][0] == 0.0


def test_a_container_at_rest_has_no_impedance():
    assert np.isnan(cycles_of(nothing, nothing, nothing).apparent_mass).all()


def test_peak_is_exact_where_one_over_rms_squared_is_a_parabola_of_the_ratio_squared():
    x = np.array([0.8, 0.9, 0.97, 1.0, 1.02, 1.1])
    response = (0.1 + 50.0 * (x**2 - 0.983**2) ** 2) ** -0.5
    assert peak(x, response) == pytest.approx((0.983, 0.1**-0.5), rel=1e-12)


@pytest.mark.parametrize("damping", [0.0006, 0.01228, 0.05])
@pytest.mark.parametrize("offset", np.linspace(0.0, 1.0, 7))
def test_peak_of_an_oscillator_from_a_grid_of_one_percent(damping, offset):
    """To (2 z)^2, the share of the base's velocity in its pull, and to the cube of the spacing.

    The numerator 1 + (2 z r)^2 of the transfer function makes a cubic of (2 z)^2 times that of the
    squares, 0.02 apart; the grid falls anywhere.
    """
    o = Oscillator(damping=2.0 * damping * math.sqrt(123.4 * 0.086))
    ratios = 0.95 + 0.01 * (np.arange(11) + offset)
    found = peak(ratios, o.rms(ratios * o.natural_frequency))
    assert found == pytest.approx(o.peak(), rel=4.0 * damping**2 + 0.02**3)


@pytest.mark.parametrize(
    "response",
    [
        *([3.0, 2.0, 1.0], [1.0, 2.0, 3.0], [2.0, 2.0, 2.0], [0.0, 0.0, 0.0]),
        *([math.nan, 2.0, 1.0], [1.0, 2.0, math.nan], [2.0, math.nan, 1.0]),
    ],
)
def test_a_peak_at_an_end_or_beside_nan_is_outside(response):
    assert np.isnan(peak([0.9, 1.0, 1.1], response)).all()


def test_peak_of_a_plateau_and_beside_rest():
    ratio, height = peak([0.9, 1.0, 1.1], [1.0, 2.0, 2.0])
    assert 1.0 < ratio < 1.1 and 2.0 < height < 3.0
    assert peak([0.9, 1.0, 1.1], [0.0, 2.0, 1.0]) == (1.0, 2.0)


def test_peak_of_points_too_far_apart_for_one_resonance():
    """1 / response^2 would fall below zero between them: the curve's own parabola is taken."""
    ratio, height = peak([0.5, 1.0, 1.1], [0.01, 1.0, 0.999])
    assert 0.5 < ratio < 1.1 and 1.0 <= height < 2.0


def test_noise_is_no_resonance_between_the_points():
    """Points of a noisy curve [mm] that a narrow resonance would put at 27 mm, but for the next."""
    curve = [8.85, 4.13, 11.55, 10.93, 7.31]
    ratios = np.linspace(0.96, 1.04, 5)
    assert peak(ratios[1:4], curve[1:4])[1] > 2.0 * max(curve)
    ratio, height = peak(ratios, curve)
    assert 1.0 < ratio < 1.02 and max(curve) < height < 1.1 * max(curve)
    # A point near rest farther away leaves the range of numbers, and changes nothing.
    far = peak([0.9, *ratios], [1e-200, *curve])
    assert far == (ratio, height)


def test_no_peak_without_numbers():
    assert np.isnan(peak([1.0, 2.0], [math.nan, math.nan])).all()


def test_film_measures_of_particles_on_the_floor_and_below_the_ceiling():
    box = Box(0.05, 0.02, 0.004)
    low = np.column_stack([np.linspace(0.01, 0.04, 3), np.full(3, 0.002)])
    high = low + np.array([0.0, 0.016])
    frames = [Frame(0.0, x, 0.0, place, 0.0 * place) for x, place in ((0.003, low), (0.0, high))]
    found = FilmMeasures.of(box, [frames, frames], np.array([0.0, 0.5]))
    assert found.height_mm == pytest.approx(np.array([[3.0, 16.0]] * 2))
    assert found.above_floor_mm == pytest.approx(np.array([[0.0, 16.0]] * 2))
    assert found.floor.tolist() == [[1.0, 0.0]] * 2 and found.ceiling.tolist() == [[0.0, 1.0]] * 2


def test_the_swing_of_filmed_particles_is_that_of_their_mean():
    phase = np.arange(8) / 8.0
    height = 5.0 + 3.0 * np.sin(2.0 * np.pi * (phase - 0.125))
    cycles = np.array([height + 1.0, height - 1.0])
    assert FilmMeasures(phase, cycles, cycles, cycles, cycles).swing() == pytest.approx((3.0, 45.0))
