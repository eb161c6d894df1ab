"""Whatever the runs give, an answer or a sentence comes of it: never another exception, never NaN.

Values are drawn over all numbers there are: zero, the smallest, the largest, equal ones, any sign.
"""

import math

import numpy as np
import pytest

from taichi_dem import goals
from taichi_dem.accuracy.runs import _share
from taichi_dem.kit.accuracy.answer import Answer, ErrorParts, Plan, rounded
from taichi_dem.kit.accuracy.branches import clusters_of
from taichi_dem.kit.accuracy.step_error import step_error
from taichi_dem.outcome import Outcome, displacement_error, energy_error, faces_error
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


@pytest.mark.parametrize("seed", range(10))
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
        assert all(one.seconds >= 0.0 and str(one) for one in answer.cost_curve)


@pytest.mark.parametrize("seed", range(5))
def test_an_error_of_the_step_is_a_number_or_infinite(seed):
    random = np.random.default_rng(seed)
    for _ in range(50):
        values = numbers(random, int(random.integers(2, 6)))
        found = step_error(values, least=abs(numbers(random, 1)[0]))
        assert found.error >= abs(values[-1] - values[-2]) / 4.0 or found.regular


@pytest.mark.parametrize("seed", range(5))
def test_a_bar_is_as_wide_as_its_widest_part_and_is_printed(seed):
    random = np.random.default_rng(seed)
    for _ in range(50):
        parts = [abs(one) for one in (*numbers(random, 3), random.choice([0.0, math.inf]))]
        for made in (ErrorParts(*parts), ErrorParts(*(np.array([one]) for one in parts))):
            assert max(parts) <= made.total and (made.total <= 3.0 * max(parts))
            value = numbers(random, 1)[0]
            plan = Plan("a method", 2, 1.0, 1.0)
            answer = Answer("a goal", "m", value, ErrorParts(*parts), 0.01, 0.95, plan)
            assert str(answer) and str(made) and answer.share >= 0.0


def test_a_number_has_no_more_digits_than_there_are():
    assert rounded(3.0, 1e-300) == "3" and rounded(0.5, 0.01) == "0.50"
    assert rounded(1.7e308, 5e-324).count("0") < 17


@pytest.mark.parametrize("seed", range(5))
def test_clusters_are_those_of_all_values(seed):
    random = np.random.default_rng(seed)
    for _ in range(20):
        values = numbers(random, 8)
        found = clusters_of(values, 0.0, 0.0)
        assert sorted(np.concatenate(found).tolist()) == list(range(8))


def test_a_change_within_rounding_is_none_and_one_of_bodies_at_rest_is_finite():
    """A usual body rests in the finer run, and has moved by less or more than rounding before."""
    size, rest = np.full(5, 1e-18), np.zeros(5)
    assert _share(size, rest, 1e-16) == 0.0 == _share(rest, rest, 0.0)
    assert _share(1e6 * size, rest, 1e-16) == pytest.approx(1e4)
    assert _share(size, 1e-17 + rest, 1e-20) == pytest.approx(0.1)


def test_runs_beside_a_reference_at_rest_are_equal_or_infinitely_far():
    """No loads, nothing moved and nothing broke."""
    energy = dict.fromkeys(
        ("kinetic", "bond_strain", "sphere_strain", "bond_dashpot", "softening", "release", "slip",
         "sphere_dashpot", "friction", "injected", "load_work"), 0.0
    )  # fmt: skip
    rest = Outcome([[0.0] * 3], [], energy, 1, 0.0, 0.0, 0.0, 0.0, 0.0)
    moved = Outcome([[1.0] * 3], [0], {**energy, "kinetic": 1.0}, 1, 0.0, 0.0, 0.0, 0.0, 0.0)
    for error in (displacement_error, energy_error):
        assert error(rest, rest) == 0.0 and error(moved, rest) == math.inf
    assert faces_error(moved, rest) == 1.0
