"""Bars of values whose chance, sampling and step error are drawn from known distributions."""

import numpy as np
import pytest

from ca_damper import Goal, InputError, goals
from ca_damper.accuracy.goal_estimate import SeedValues, estimate

GOAL = Goal("any", "m", "extreme", lambda found: found.rms[0, 0])
NOTHING = np.zeros(1)


def values_of(rng, seeds, between, within, mean=1.0):
    """A value of each seed; its variance by sampling known from 7 degrees of freedom a seed."""
    made = mean + between * rng.normal(size=(seeds, 1)) + within * rng.normal(size=(seeds, 1))
    freedom = 7 * seeds
    variance = np.array([within**2 * rng.chisquare(freedom) / freedom])
    return SeedValues(made, variance, freedom, NOTHING)


@pytest.mark.parametrize(("between", "within"), [(0.0, 0.01), (0.02, 0.001), (0.0, 0.0)])
@pytest.mark.parametrize("seeds", [3, 8])
def test_a_bar_of_seeds_and_sampling_holds_the_mean(between, within, seeds):
    """400 cases: 95 % is 380 with a standard deviation of 4.4."""
    rng, held = np.random.default_rng(5), 0
    for _ in range(400):
        found = values_of(rng, seeds, between, within)
        sampling, chance = found.bars(0.95)
        held += bool(abs(found.mean[0] - 1.0) <= np.hypot(sampling, chance)[0] + 1e-12)
    assert 366 <= held <= 400


def test_seeds_that_differ_a_little_cannot_hide_behind_their_sampling():
    """Chance as large as the sampling is seen by 8 seeds of 7 degrees of freedom now and then."""
    rng, held = np.random.default_rng(6), 0
    for _ in range(400):
        found = values_of(rng, 8, 0.01, 0.01)
        held += bool(abs(found.mean[0] - 1.0) <= np.hypot(*found.bars(0.95))[0])
    assert held >= 340


def test_one_seed_has_no_chance_to_tell():
    found = SeedValues(np.ones((1, 1)), np.array([0.04]), 7, np.array([0.3]))
    sampling, chance = found.bars(0.95)
    assert chance[0] == 0.0 and sampling[0] == pytest.approx(np.hypot(2.3646 * 0.2, 0.3), rel=1e-4)


def test_an_estimate_has_the_value_of_the_finest_step_and_the_parts_of_all():
    """Values 1 + h, 1 + 2 h and 1 + 4 h, order 1: the finest is off by h, times 1.25."""
    levels = [
        SeedValues(np.full((3, 1), v), np.array([1e-6]), 21, NOTHING) for v in (1.1, 1.2, 1.4)
    ]
    found = estimate(GOAL, (1.0, 2.0, 4.0), levels, np.array([0.3]), 1.0, 0.95)
    assert found.value[0] == pytest.approx(1.1) and found.fine is levels[0]
    assert found.step.error[0] == pytest.approx(0.125) and found.step.is_seen
    own = 2.0796 * 1e-3 / 3.0**0.5
    assert found.parts.sampling[0] == pytest.approx(np.hypot(own, 0.3), rel=1e-4)


def test_a_bar_holds_the_limit_where_the_step_s_error_is_like_that_of_chance():
    """2400 cases, standard deviation 0.4 %; squares of both parts alone would hold it in 89 %."""
    rng, sigma, steps = np.random.default_rng(4), 0.01, (1.0, 2.0, 4.0)
    held = []
    for shift in (0.0, 0.5, 1.0, 2.0, 5.0, 10.0):
        for _ in range(400):
            means = 1.0 + sigma * (shift * np.array(steps) + rng.normal(size=3))
            one = np.array([sigma**2])
            levels = [SeedValues(np.array([[mean]]), one, 200, NOTHING) for mean in means]
            found = estimate(GOAL, steps, levels, NOTHING, 1.0, 0.95)
            held.append(bool(abs(found.value[0] - 1.0) <= found.parts.total[0]))
    assert 0.93 <= np.mean(held) <= 0.97


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Goal("", "m", "value", len, (1.0,)), "name of a goal must be text"),
        (lambda: Goal("a", "m", "mean", len, (1.0,)), "kind of a goal must be one of"),
        (lambda: Goal("a", "m", "value", 3, (1.0,)), "must be a function of a Response"),
        (lambda: Goal("a", "m", "value", len), "ratios of a goal must hold at least one"),
        (lambda: Goal("a", "m", "curve", len, (1.0, 0.9)), "must ascend"),
        (lambda: Goal("a", "m", "extreme", len, (1.0,)), "must be left out"),
        (lambda: goals.rms_at(0.0), "ratio must be a positive"),
        (lambda: goals.response_curve([]), "at least one"),
    ],
)
def test_goals_that_mean_nothing_are_refused(make, words):
    with pytest.raises(InputError, match=words):
        make()
