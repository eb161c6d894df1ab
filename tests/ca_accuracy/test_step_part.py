"""Values at several steps with a known error: of an order, in no order, and blurred by chance."""

import numpy as np
import pytest

from taichi_dem.kit.bars.step import step_part

THREE = (1.0, 2.0, 4.0)
FIVE = (1.0, 2.0**0.5, 2.0, 8.0**0.5, 4.0)


def told(steps, values, error=0.0, order=1.0):
    """What values of one place say, each with the same standard error."""
    made = np.reshape(values, (-1, 1))
    return step_part(steps, made, np.full_like(made, error), order, 0.95)


@pytest.mark.parametrize("power", [0.6, 1.0, 2.0])
def test_an_order_is_seen_and_believed_up_to_that_of_the_method(power):
    found = told(THREE, [1.0 + 0.01 * k**power for k in THREE])
    assert found.is_regular and found.is_seen and found.value[0] == 1.01
    of_finest = 0.01 * (2.0**power - 1.0) / (2.0 ** min(power, 1.0) - 1.0)
    assert found.error[0] == pytest.approx(1.25 * of_finest) and found.error[0] >= 0.01


def test_two_steps_have_the_order_of_the_method():
    found = told((1.0, 2.0), [1.1, 1.2])
    assert found.is_regular and found.error[0] == pytest.approx(0.125)
    assert told((1.0, 2.0), [1.1, 1.2], order=2.0).error[0] == pytest.approx(1.25 * 0.1 / 3.0)
    assert not told((1.0, 2.0), [1.1, 1.1]).is_seen


@pytest.mark.parametrize("values", [(1.0, 1.3, 1.0), (1.0, 1.01, 1.3), (1.3, 1.0, 0.99)])
def test_changes_that_do_not_shrink_have_no_order(values):
    """To and fro, a second change much smaller than the first, and one that is larger."""
    found = told(THREE, values)
    assert not found.is_regular and found.value[0] == pytest.approx(np.mean(values))
    # Student's t of two degrees of freedom, of one more draw.
    half = 4.3027 * np.std(values, ddof=1) * (4.0 / 3.0) ** 0.5
    assert found.error[0] == pytest.approx(half, rel=1e-4)


def test_chance_hides_an_order_and_is_not_taken_for_none():
    found = told(THREE, [1.0, 1.3, 1.0], 0.2)
    assert found.is_regular and not found.is_seen
    assert told(THREE, [1.0, 1.0 + 1e-12, 1.0]).is_regular


@pytest.mark.parametrize("steps", [THREE, FIVE])
def test_a_bar_of_steps_without_an_order_holds_another_step(steps):
    """2000 cases. Three draws look like an order in 9 % of cases, which are then held by half."""
    rng, held = np.random.default_rng(3), 0
    for _ in range(2000):
        *draws, other = rng.normal(size=len(steps) + 1)
        found = told(steps, draws)
        held += bool(abs(found.value[0] - other) <= found.error[0])
    assert 0.89 <= held / 2000 <= 0.975
