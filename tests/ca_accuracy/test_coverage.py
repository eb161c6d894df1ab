"""Bars hold the mean of endless runs as often as they say."""

import numpy as np
import pytest

from ca_damper import Goal
from ca_damper.accuracy.estimate import SeedValues, estimate

GOAL = Goal("any", "m", lambda found: found.rms[0, 0], "extreme")
NOTHING = np.zeros(1)


def values_of(rng, seeds, between, within, mean=1.0):
    """A value of each seed; its variance by sampling known from 7 degrees of freedom a seed."""
    made = mean + between * rng.normal(size=(seeds, 1)) + within * rng.normal(size=(seeds, 1))
    freedom = 7 * seeds
    variance = np.array([within**2 * rng.chisquare(freedom) / freedom])
    return SeedValues(made, variance, freedom, NOTHING)


@pytest.mark.parametrize(
    ("between", "within", "seeds"), [(0.0, 0.01, 3), (0.02, 0.001, 8), (0.0, 0.0, 3)]
)
def test_a_bar_of_seeds_and_sampling_holds_the_mean(between, within, seeds):
    """400 cases: 95 % is 380 with a standard deviation of 4.4."""
    rng, held = np.random.default_rng(5), 0
    for _ in range(400):
        found = values_of(rng, seeds, between, within)
        sampling, chance = found.bars(0.95)
        held += bool(abs(found.mean[0] - 1.0) <= np.hypot(sampling, chance)[0] + 1e-12)
    assert 366 <= held <= 400


def test_a_bar_holds_the_limit_where_the_step_s_error_is_like_that_of_chance():
    """1200 cases, standard deviation 0.6 %; squares of both parts alone would hold it in 89 %."""
    rng, sigma, steps = np.random.default_rng(4), 0.01, (1.0, 2.0, 4.0)
    held = []
    for shift in (0.0, 0.5, 1.0, 2.0, 5.0, 10.0):
        for _ in range(200):
            means = 1.0 + sigma * (shift * np.array(steps) + rng.normal(size=3))
            one = np.array([sigma**2])
            levels = [SeedValues(np.array([[mean]]), one, 200, NOTHING) for mean in means]
            found = estimate(GOAL, steps, levels, NOTHING, 0.95)
            held.append(bool(abs(found.value[0] - 1.0) <= found.parts.total[0]))
    assert 0.93 <= np.mean(held) <= 0.97


@pytest.mark.parametrize("steps", [(1.0, 2.0), (1.0, 2.0, 4.0)])
def test_two_steps_support_no_bar_below_a_third_of_the_tolerance(steps):
    """Three that agree do: their error is that of their changes, of first order."""
    levels = [SeedValues(np.array([[2.0 + 1e-6 * k]]), np.zeros(1), 200, NOTHING) for k in steps]
    found = estimate(GOAL, steps, levels, NOTHING, 0.95, tolerance=0.03)
    third = 0.03 * found.value[0] / 3.0
    assert found.parts.step[0] == pytest.approx(third if len(steps) == 2 else 1.25e-6)
    assert found.parts.total[0] <= found.allowed(0.03)
