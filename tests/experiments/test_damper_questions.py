"""Questions to the damper that are drawn at random, and their references."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from _accuracy_damper import FILLINGS, damper_fixed, damper_question, damper_reference
from _damper_reference import _without_one
from ca_damper import Empty, Oscillator, RigidMass, goals, solve_response


def test_a_seed_is_a_question_and_many_are_of_all_kinds():
    asked = [damper_question(seed) for seed in range(200)]
    assert str(asked[7]) == str(damper_question(7)) and asked[7].seed == 7
    assert {str(one.filling) for one in asked} == {str(filling) for filling, _ in FILLINGS}
    assert len({one.goal.name.split(" at ")[0] for one in asked}) == 5
    assert all(0.003 <= one.tolerance <= 0.1 for one in asked)
    for one in asked:
        is_empty = isinstance(one.filling, Empty)
        assert one.particles == 0 if is_empty else 3 <= one.particles <= 40


@pytest.mark.parametrize("name", ["peak ratio", "RMS at"])
def test_a_question_without_grains_has_an_exact_reference(name):
    asked = next(
        one
        for one in map(damper_question, range(200))
        if isinstance(one.filling, RigidMass) and one.goal.name.startswith(name)
    )
    answer = solve_response(**asked.arguments())
    assert answer.reached and abs(answer.value - damper_reference(asked, answer)) <= answer.error
    assert damper_fixed(asked) > 0.0


@pytest.mark.parametrize(("goal", "place"), [(goals.peak_rms(), 1), (goals.peak_ratio(), 0)])
def test_the_peak_of_a_reference_is_that_of_the_mean_curve(goal, place):
    """A linear oscillator, a little off from seed to seed."""
    o = Oscillator(damping=2.0 * 0.03 * math.sqrt(123.4 * 0.086))
    ratios = np.linspace(0.97, 1.03, 7)
    curve = o.rms(ratios * o.natural_frequency)
    seeds = 1.0 + 0.01 * np.random.default_rng(1).normal(size=(7, 5))
    values = _without_one(SimpleNamespace(rms=(curve[:, None] * seeds)[None], ratios=ratios), goal)
    off = abs(values.mean() - o.peak()[place])
    assert off <= 3.0 * values.std() / math.sqrt(5.0) + 1e-3 * o.peak()[place]
