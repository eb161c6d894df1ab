"""Error bars of both packages: what chance does, what falling steps tell, exact or cautious."""

import math

import numpy as np
import pytest

from taichi_dem.kit.bars.answer import branches_of
from taichi_dem.kit.bars.chance import clusters_of, f_outside, t_outside, t_quantile
from taichi_dem.kit.bars.step import SAFETY, step_error

SEEDS = tuple(range(1, 13))
STEPS = ([1.0, 0.5, 0.25], [1.0, 0.25, 0.125], [1.0, 0.5, 0.125], [3.0, 1.0, 0.5])


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
    first, second = branches_of(values, clusters, SEEDS, 2.0 * 0.02)
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
