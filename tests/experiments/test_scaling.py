"""Work shared among simulated workers loses nothing, and none waits less than the paper's do."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from _scaling import even_cuts, share_costs

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
