"""Error bars of both packages: what chance does, what falling steps tell, exact or cautious."""

import math

import numpy as np
import pytest

from taichi_dem.kit.bars.answer import branches_of
from taichi_dem.kit.bars.chance import clusters_of, f_outside, t_outside, t_quantile
from taichi_dem.kit.bars.step import SAFETY, step_error, step_part

SEEDS = tuple(range(1, 13))
STEPS = ([1.0, 0.5, 0.25], [1.0, 0.25, 0.125], [1.0, 0.5, 0.125], [3.0, 1.0, 0.5])
THREE = (1.0, 2.0, 4.0)
FIVE = (1.0, 2.0**0.5, 2.0, 8.0**0.5, 4.0)


@pytest.mark.parametrize(
    ("confidence", "freedom", "wanted"),
    [(0.95, 1, 12.706), (0.95, 7, 2.365), (0.99, 10, 3.169), (0.95, math.inf, 1.960)],
)
def test_quantiles_are_those_of_the_tables_in_textbooks(confidence, freedom, wanted):
    assert t_quantile(confidence, freedom) == pytest.approx(wanted, abs=6e-4)
    assert t_outside(t_quantile(confidence, freedom), freedom) == pytest.approx(1.0 - confidence)
    assert f_outside(4.256, 2, 9) == pytest.approx(0.05, rel=1e-3)


def test_two_motions_are_told_apart_with_their_shares():
    rng = np.random.default_rng(1)
    values = np.where(np.arange(12) % 3 == 0, 7.5, 9.3) + 0.02 * rng.normal(size=12)
    clusters = clusters_of(values, 0.02, 0.05)
    assert [len(one) for one in clusters] == [8, 4]
    first, second = branches_of(values, clusters, SEEDS, 0.02, 2.0)
    assert first.value == pytest.approx(9.3, abs=0.05) and second.seeds == (1, 4, 7, 10)
    assert first.error >= abs(first.value - 9.3) and 0.0 < first.error < 0.05
    # Wilson's interval of 8 in 12 at 95 %: 0.39 to 0.86.
    assert first.share == 8 / 12 and first.share_error == pytest.approx(0.235, abs=5e-3)


@pytest.mark.parametrize("seed", range(5))
def test_one_motion_with_chance_is_one_cluster(seed):
    values = np.random.default_rng(seed).normal(size=12)
    assert len(clusters_of(values, 0.3, 0.0)) == 1
    # A gap has to stand out from the errors of the seeds, and to matter.
    pair = np.where(np.arange(12) < 6, 0.0, 1.0)
    assert len(clusters_of(pair, 0.25, 0.0)) == len(clusters_of(pair, 0.0, 1.5)) == 1


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


def test_two_runs_tell_a_difference_of_first_order_or_of_the_declared_one():
    assert step_error([1.0, 1.3]).error == pytest.approx(0.3)
    assert step_error([1.0, 1.3], steps=[4.0, 1.0]).error == pytest.approx(0.1)
    assert step_error([1.0, 1.3], smooth=True).error == pytest.approx(1.1 * 0.3 / 3.0)
    assert step_error([1.0, 1.3], 1.0, smooth=True).error == pytest.approx(1.1 * 0.3)


def blurred(steps, values, error=0.0, order=1.0):
    """What values of one place say, each with the same standard error."""
    made = np.reshape(values, (-1, 1))
    return step_part(steps, made, np.full_like(made, error), order, 0.95)


@pytest.mark.parametrize("power", [0.6, 1.0, 2.0])
def test_an_order_is_seen_and_believed_up_to_that_of_the_method(power):
    found = blurred(THREE, [1.0 + 0.01 * k**power for k in THREE])
    assert found.is_regular and found.is_seen and found.value[0] == 1.01
    of_finest = 0.01 * (2.0**power - 1.0) / (2.0 ** min(power, 1.0) - 1.0)
    assert found.error[0] == pytest.approx(1.25 * of_finest) and found.error[0] >= 0.01


@pytest.mark.parametrize("values", [(1.0, 1.3, 1.0), (1.0, 1.01, 1.3), (1.3, 1.0, 0.99)])
def test_changes_that_do_not_shrink_have_no_order(values):
    """To and fro, a second change much smaller than the first, and one that is larger."""
    found = blurred(THREE, values)
    assert not found.is_regular and found.value[0] == pytest.approx(np.mean(values))
    # Student's t of two degrees of freedom, of one more draw.
    half = 4.3027 * np.std(values, ddof=1) * (4.0 / 3.0) ** 0.5
    assert found.error[0] == pytest.approx(half, rel=1e-4)


@pytest.mark.parametrize("steps", [THREE, FIVE])
def test_a_bar_of_steps_without_an_order_holds_another_step(steps):
    """2000 cases. Three draws look like an order in 9 % of cases, which are then held by half."""
    rng, held = np.random.default_rng(3), 0
    for _ in range(2000):
        *draws, other = rng.normal(size=len(steps) + 1)
        found = blurred(steps, draws)
        held += bool(abs(found.value[0] - other) <= found.error[0])
    assert 0.89 <= held / 2000 <= 0.975
