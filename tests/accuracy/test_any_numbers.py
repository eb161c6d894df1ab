"""Whatever the runs give, an answer or a sentence comes of it: never another exception, never NaN.

Values are drawn over all numbers there are: zero, the smallest, the largest, equal ones, any sign.
"""

import math

import numpy as np
import pytest

from taichi_dem import goals
from taichi_dem.accuracy.runs import _share
from tests.accuracy.made_up_runs import searched
from tests.accuracy.test_search import job

SIZES = (0.0, 5e-324, 1e-310, 1e-200, 1e-16, 1.0, 1.0 + 2e-16, 3.0, 1e16, 1e155, 1e282, 1.7e308)


def numbers(random, count):
    """Numbers of all sizes and signs, of few kinds at a time so that some are equal."""
    some = random.choice(SIZES, int(random.integers(1, 4)))
    return [float(one) for one in random.choice([-1.0, 1.0], count) * random.choice(some, count)]


def check(answer):
    """An answer is printed, and no bar that is not a number counts as reached."""
    assert str(answer) and repr(answer)
    assert not math.isnan(answer.error) and (math.isfinite(answer.error) or not answer.reached)


@pytest.mark.parametrize("seed", range(5))
def test_a_search_ends_in_an_answer(monkeypatch, seed):
    random = np.random.default_rng(seed)
    for _ in range(20):
        values, drawn = {}, numbers(random, 3)
        many, events = bool(random.integers(2)), bool(random.integers(2))
        diverges = 0.1 * float(random.integers(2))

        def formula(level, twin, values=values, random=random, drawn=drawn, diverges=diverges):
            if (level, twin) not in values:
                lost = twin and random.random() < diverges
                values[level, twin] = None if lost else float(random.choice(drawn))
            return values[level, twin]

        change = abs(numbers(random, 1)[0])
        asked = goals.displacement("right")
        question = job(float(random.choice([1e-12, 0.01, 1.0])), asked.mean() if many else asked)
        more = {"events": events, "change_between": lambda a, b, change=change: change}
        answer = searched(monkeypatch, question, formula, **more)
        check(answer)


def test_a_change_within_rounding_is_none_and_one_of_bodies_at_rest_is_finite():
    """A usual body rests in the finer run, and has moved by less or more than rounding before."""
    size, rest = np.full(5, 1e-18), np.zeros(5)
    assert _share(size, rest, 1e-16) == 0.0 == _share(rest, rest, 0.0)
    assert _share(1e6 * size, rest, 1e-16) == pytest.approx(1e4)
    assert _share(size, 1e-17 + rest, 1e-20) == pytest.approx(0.1)
