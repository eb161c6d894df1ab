"""Shares of a row of work: nothing lost, neighbours together, none dearer than it may be."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from taichi_dem.kit.errors import InputError
from taichi_dem.mesh.partition import even_cuts, imbalance, recut, share_costs

# Whole numbers: their sums have no rounding, so bounds hold to the last bit.
COSTS = arrays(float, st.integers(1, 60), elements=st.integers(0, 1000).map(float))
WORKERS = st.integers(1, 70)


def assert_runs(cuts, workers, count):
    """Cuts begin and end with the row and never fall: shares are runs, each item is in one."""
    assert len(cuts) == workers + 1 and cuts[0] == 0 and cuts[-1] == count
    assert cuts.dtype.kind == "i" and (np.diff(cuts) >= 0).all()


@given(COSTS, WORKERS)
def test_shares_are_runs_that_hold_everything_once(cost, workers):
    cuts = even_cuts(cost, workers)
    assert_runs(cuts, workers, len(cost))
    assert share_costs(cost, cuts).sum() == cost.sum()


@given(COSTS, WORKERS)
def test_no_share_takes_more_than_the_mean_and_one_item(cost, workers):
    """A cut lies less than an item before its place on the curve, the next at most on its own.

    Rounding: the places on the curve are products and quotients of the total, exact to 2 eps.
    """
    slack = 4.0 * np.finfo(float).eps * cost.sum()
    most = cost.sum() / workers + cost.max() + slack
    assert share_costs(cost, even_cuts(cost, workers)).max() <= most


def test_equal_items_make_equal_shares():
    assert even_cuts(np.ones(12), 4).tolist() == [0, 3, 6, 9, 12]


def test_the_papers_static_shares():
    """Element i meets at most n - i others: with n = 5, half of 4 + 3 + 2 + 1 + 0 is 5."""
    cost = np.arange(4, -1, -1)
    cuts = even_cuts(cost, 2)
    assert cuts.tolist() == [0, 1, 5] and share_costs(cost, cuts).tolist() == [4.0, 6.0]


@given(COSTS, WORKERS)
def test_recut_shares_are_runs(cost, workers):
    cuts = even_cuts(np.ones(len(cost)), workers)
    assert_runs(recut(cuts, share_costs(cost, cuts)), workers, len(cost))


@pytest.mark.parametrize(("seconds", "cut"), [((30.0, 10.0), 7), ((10.0, 30.0), 13)])
def test_recut_reads_the_polyline(seconds, cut):
    """Two shares of 10 items and 40 s: half of it lies at item 10 * 20 / 30 = 6.7, or 13.3."""
    assert recut(np.array([0, 10, 20]), seconds).tolist() == [0, cut, 20]


@pytest.mark.parametrize("workers", [2, 7, 24])
def test_recut_settles_where_cost_changes_slowly(workers):
    """Repeated on one ramp of costs the polyline comes to the curve: shares within two items."""
    cost = np.linspace(1.0, 9.0, 960)
    cuts = even_cuts(np.ones(960), workers)
    assert imbalance(share_costs(cost, cuts)) > 1.5
    for _ in range(20):
        cuts = recut(cuts, share_costs(cost, cuts))
    off = share_costs(cost, cuts) - cost.sum() / workers
    assert np.abs(off).max() <= 2.0 * cost.max()


def test_recut_leaves_the_cuts_where_nothing_was_measured():
    """No time anywhere: all corners lie at one place, and any cuts are as good as others."""
    assert_runs(recut(np.array([0, 3, 6, 9]), np.zeros(3)), 3, 9)


def test_shares_of_several_kinds_of_cost_are_summed_apart():
    cost = np.array([[1, 10], [2, 20], [3, 30]])
    assert share_costs(cost, np.array([0, 2, 3])).tolist() == [[3.0, 30.0], [3.0, 30.0]]


def test_imbalance_is_slowest_over_fastest():
    """The paper's 20381 s and 3493 s are 5.8; a worker without work makes it infinite."""
    assert imbalance([3493.0, 9000.0, 20381.0]) == pytest.approx(5.835, abs=5e-4)
    assert imbalance([0.0, 1.0]) == np.inf


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: even_cuts([1.0, -2.0], 2), ("cost", "-2.0", "place 1", "at least 0")),
        (lambda: even_cuts([1.0, np.nan], 2), ("cost", "nan")),
        (lambda: even_cuts([np.inf], 2), ("cost", "inf")),
        (lambda: even_cuts([1.0], 0), ("workers", "from 1 to", "0")),
        (lambda: even_cuts([1.0], 1.5), ("workers", "1.5")),
        (lambda: recut(np.array([0, 1]), [1.0, 2.0]), ("seconds", "1", "2")),
        (lambda: recut(np.array([0, 1]), [-1.0]), ("cost", "-1.0")),
    ],
)
def test_bad_input_is_one_sentence(call, words):
    with pytest.raises(InputError) as refused:
        call()
    assert all(word in str(refused.value) for word in words)
