"""Error of the step from runs at falling steps: exact for powers, cautious for anything else."""

import math

import pytest

from taichi_dem.kit.bars.step import SAFETY, step_error

STEPS = ([1.0, 0.5, 0.25], [1.0, 0.25, 0.125], [1.0, 0.5, 0.125], [3.0, 1.0, 0.5])


def powers(steps, order, limit=3.0, factor=0.7):
    """Values that go to a limit as a power of the step."""
    return [limit + factor * step**order for step in steps]


@pytest.mark.parametrize("steps", STEPS)
@pytest.mark.parametrize("order", [0.75, 1.0, 1.5, 2.0])
def test_an_order_is_seen_and_the_error_is_that_of_the_power_law(steps, order):
    found = step_error(powers(steps, order), 2.0, steps)
    assert found.regular and found.order == pytest.approx(order, abs=1e-6)
    assert found.error == pytest.approx(SAFETY * 0.7 * steps[-1] ** order, rel=1e-6)


def test_an_order_above_the_declared_one_is_not_trusted():
    """Differences that shrink by five are taken for those of the declared order."""
    found = step_error([5.0 + 1.0, 5.0 + 0.2, 5.0 + 0.04], 2.0)
    assert found.order == 2.0 and found.error == pytest.approx(SAFETY * 0.16 / 3.0)


@pytest.mark.parametrize("values", [[1.0, 2.0, 1.5], [1.0, 1.1, 1.3], [1.0, 2.0, 2.0]])
def test_no_order_is_seen_where_differences_change_sign_grow_or_vanish(values):
    found = step_error(values)
    assert math.isnan(found.order) and not found.regular
    assert found.error == pytest.approx(abs(values[-1] - values[-2]))


def test_two_runs_tell_a_difference_of_first_order_or_of_the_declared_one():
    assert step_error([1.0, 1.3]).error == pytest.approx(0.3)
    assert step_error([1.0, 1.3], steps=[4.0, 1.0]).error == pytest.approx(0.1)
    assert step_error([1.0, 1.3], smooth=True).error == pytest.approx(1.5 * 0.3 / 3.0)
    assert step_error([1.0, 1.3], 1.0, smooth=True).error == pytest.approx(1.5 * 0.3)


def test_a_difference_that_may_be_small_by_chance_counts_as_much_as_is_likely():
    assert step_error([1.0, 1.0], least=0.2).error == pytest.approx(0.2)
    seen = powers([1.0, 0.5, 0.25], 2.0)
    assert step_error(seen, least=10.0).error == pytest.approx(SAFETY * 10.0 / 3.0)
