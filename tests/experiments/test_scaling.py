"""Work shared among simulated workers loses nothing, and none waits less than the paper's do."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from _scaling import Workers, Workload, even_cuts, share_costs

# Whole numbers: their sums have no rounding, so bounds hold to the last bit.
COSTS = arrays(float, st.integers(1, 60), elements=st.integers(0, 1000).map(float))


@given(COSTS, st.integers(1, 70))
def test_shares_hold_everything_once_and_no_more_than_the_mean_and_one_item(cost, workers):
    """A cut lies less than an item before its place on the curve, the next at most on its own.

    Rounding: the places on the curve are products and quotients of the total, exact to 2 eps.
    """
    cuts = even_cuts(cost, workers)
    assert len(cuts) == workers + 1 and cuts[0] == 0 and cuts[-1] == len(cost)
    assert (np.diff(cuts) >= 0).all()
    slack = 4.0 * np.finfo(float).eps * cost.sum()
    assert share_costs(cost, cuts).max() <= cost.sum() / workers + cost.max() + slack


def test_the_papers_static_shares():
    """Element i meets at most n - i others: with n = 5, half of 4 + 3 + 2 + 1 + 0 is 5."""
    cost = np.arange(4, -1, -1)
    cuts = even_cuts(cost, 2)
    assert cuts.tolist() == [0, 1, 5] and share_costs(cost, cuts).tolist() == [4.0, 6.0]


# Two classes of ticks: all are due at the first, the last quarter also at three ticks between.
BODIES, INTERVALS, TICKS = 40, 5, (10, 30)


@pytest.fixture
def workers():
    """Simulated workers on a workload whose prices are known: 2 s a bond and nothing else."""
    counts = np.zeros((INTERVALS, BODIES, 2, 3), dtype=int)
    counts[:, :, 0, 0] = TICKS[0]
    counts[:, -BODIES // 4 :, 1, 0] = TICKS[1]
    seconds = 2.0 * counts[..., 0].sum(axis=(1, 2))
    # All intervals are alike: with ticks the fit could charge them instead of the bonds.
    time_s = np.arange(1, INTERVALS + 1) * 1e-6
    return Workers(Workload(time_s, counts, np.zeros((INTERVALS, 2)), seconds, 0 * time_s))


@pytest.mark.parametrize("way", ["static", "polyline", "rebalanced"])
def test_simulated_workers_do_all_the_work_and_wait_for_the_slowest(workers, way):
    total = 2.0 * INTERVALS * (10 * BODIES + 30 * BODIES // 4)
    for count in (1, 5, 24):
        shared = workers.share(way, count)
        assert shared.seconds.sum() == pytest.approx(total, rel=1e-12)
        assert total / count <= shared.elapsed * (1.0 + 1e-12)
        assert shared.elapsed <= total * (1.0 + 1e-12)


def test_balance_over_an_interval_is_not_balance_at_each_tick(workers):
    """Bodies cost 10, the last ten 40, 700 in all: half is 350, after 31 of them.

    At the ticks of all the first worker then has 31 of 40, at the others the second 9 of 10. The
    fixed shares of the first interval: 39 + 38 + ... + 29 = 374 of 780, the twelfth is too much.
    """
    shared = workers.share("rebalanced", 2)
    assert shared.cuts[:2].tolist() == [[0, 11, 40], [0, 31, 40]]
    first, later = 2.0 * (10 * 29 + 30 * 10), 2.0 * (10 * 31 + 30 * 9)
    assert shared.elapsed == pytest.approx(first + (INTERVALS - 1) * later, rel=1e-12)
