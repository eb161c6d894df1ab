"""Bars hold the mean of endless runs as often as they say: of seeds that differ and wander."""

import math

import pytest

from tests.ca_accuracy.drawn_runs import own_places, share_held, two_motions

COUNT = 30
CASES = {
    "own places": (own_places(0.1, 0.02), 1.0, 0.06),
    "two motions in turn": (two_motions(1 / 50, 1 / 25), 0.9, 0.03),
    "all leave a motion": (two_motions(1 / 150, 0.0), 0.7, 0.05),
}


@pytest.mark.parametrize(
    "case",
    [
        "own places",
        pytest.param("two motions in turn", marks=pytest.mark.slow),
        "all leave a motion",
    ],
)
def test_nearly_all_bars_hold(case):
    """95 % of 30 are 28.5, and three standard deviations fewer 24.9; none falls out of its level.

    Answers that say that there are several motions state no number; half of all are numbers.
    """
    make, mean, tolerance = CASES[case]
    held, told = share_held(make, mean, COUNT, tolerance)
    assert told >= COUNT // 2
    assert held >= 0.95 * told - 3.0 * math.sqrt(0.95 * 0.05 * told)
