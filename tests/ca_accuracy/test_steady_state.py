"""Series whose transient and mean are known: constants, steps, exponentials, noise with memory."""

import math

import numpy as np
import pytest

from ca_damper.report.steady_state import FALSE_ALARMS, mean_and_error, period, steady_part
from taichi_dem.kit.bars.chance import t_quantile


def remembering(count, near, rng):
    """Autoregressive series of unit variance; near: correlation of neighbours."""
    kicks = rng.normal(size=count)
    x = np.empty(count)
    x[0] = kicks[0]
    for k in range(1, count):
        x[k] = near * x[k - 1] + math.sqrt(1.0 - near**2) * kicks[k]
    return x


def run_until_steady(series, allowed, error=math.inf):
    """(the steady part, cycles gone) of a series, as solve_response goes on.

    error: half-width of the bar of sampling that is to be reached.
    """
    gone = 64
    while gone < 50_000:
        part = steady_part(series[:gone], allowed)
        if part.is_steady and t_quantile(0.95, part.freedom) * part.error <= error:
            return part, gone
        gone += max(part.more, 32)
    raise AssertionError("never steady")


@pytest.mark.parametrize("end", [10, 20, 40])
def test_a_step_is_cut_off(end):
    x = np.where(np.arange(128) < end, 0.0, 5.0) + 1e-3 * remembering(
        128, 0.3, np.random.default_rng(end)
    )
    part = steady_part(x, 1e-3)
    assert part.is_steady and end <= part.begin < 96
    assert part.mean == pytest.approx(5.0, abs=4e-3)


@pytest.mark.parametrize("near", [0.0, 0.5])
def test_steady_noise_is_sent_on_as_often_as_stated(near):
    """400 series: 5 % are 20, with a standard deviation of 4.4."""
    rng = np.random.default_rng(7)
    alarms = sum(not steady_part(9.0 + remembering(128, near, rng)).is_steady for _ in range(400))
    count = 400 * FALSE_ALARMS
    assert abs(alarms - count) < 3.0 * math.sqrt(count)


@pytest.mark.parametrize("near", [0.0, 0.8])
def test_the_error_of_a_mean_covers_it_as_often_as_it_says(near):
    """300 series: 95 % with a standard deviation of 1.3 %; short ones of long memory a bit less."""
    rng, held = np.random.default_rng(3), 0
    for _ in range(300):
        mean, error, freedom = mean_and_error(remembering(256, near, rng))
        held += abs(mean) < t_quantile(0.95, freedom) * error
    assert 0.91 <= held / 300 <= 0.985


@pytest.mark.parametrize("time", [20, 265])
@pytest.mark.parametrize("allowed", [0.01, 0.002])
def test_a_slow_approach_goes_on_until_little_is_left(time, allowed):
    """265 cycles: an empty container of damping ratio 0.0006, 54 % low after 150 cycles."""
    series = 1.0 - np.exp(-np.arange(60_000) / time)
    part, gone = run_until_steady(series, allowed)
    assert abs(part.mean - 1.0) <= 1.05 * allowed and part.drift <= allowed
    # The window is an eighth of the run at least, so that no more than this is needed.
    assert gone < time * (math.log(1.0 / allowed) + 3.0) * 8.0 / 7.0 + 96.0


def test_how_much_is_left_is_told_before_the_end():
    part = steady_part(1.0 - np.exp(-np.arange(400) / 265.0))
    # Its half-width has two standard errors of the limit beside the way to it.
    assert not part.is_steady and 1.0 <= part.mean + part.drift < 1.05


@pytest.mark.parametrize(("time", "noise"), [(30, 0.01), (100, 0.01), (265, 0.03)])
def test_a_slow_approach_in_noise_ends_within_its_bar(time, noise):
    """20 runs: at 95 % it happens once in 400 that fewer than 16 bars hold the limit."""
    held = 0
    for seed in range(20):
        made = noise * remembering(40_000, 0.4, np.random.default_rng(seed))
        part, _ = run_until_steady(1.0 - np.exp(-np.arange(40_000) / time) + made, 0.0025)
        half = math.hypot(t_quantile(0.95, part.freedom) * part.error, part.drift)
        held += abs(part.mean - 1.0) <= half
    assert held >= 16


@pytest.mark.parametrize("cycles", [1, 2, 6])
def test_a_periodic_series_is_seen_with_its_period(cycles):
    values = np.exp(1j * np.arange(cycles)) + 2.0
    series = np.tile(values, 20)[:20]
    assert period(series, 1e-9) == cycles
    # A difference in a single cycle, twice what is allowed, is enough.
    series[7] += 2e-3 * np.abs(series).max()
    assert period(series, 1e-3) == 0
