"""Timings by turns: the interval of a median, ratios on a machine that changes its speed."""

import math

import numpy as np
import pytest

from taichi_dem.kit.errors import InputError
from taichi_dem.kit.study.paired_timing import median_interval, paired_timing


def covered(count, outside):
    """Probability that the median lies between order statistics with so many outside each."""
    tail = sum(math.comb(count, k) for k in range(outside + 1)) * 0.5**count
    return 1.0 - 2.0 * tail


@pytest.mark.parametrize("count", [6, 7, 8, 9, 12, 25, 60, 101])
def test_the_interval_is_the_shortest_of_95_percent(count):
    """The values are their own ranks, so that the ends tell how many lie outside."""
    low, high = median_interval(np.random.default_rng(count).permutation(count))
    assert low == count - 1 - high
    assert covered(count, low) >= 0.95 > covered(count, low + 1)


def test_few_values_give_their_range():
    assert median_interval([3.0, 1.0, 2.0]) == (1.0, 3.0)
    assert median_interval([2.0]) == (2.0, 2.0)


class Machine:
    """Work of given seconds by candidate and state, on a machine of changing speed."""

    def __init__(self, seconds, jitter=0.0):
        self.seconds, self.random = seconds, np.random.default_rng(3)
        self.jitter, self.done = jitter, []

    def candidates(self):
        return {name: lambda state, name=name: self._work(name, state) for name in self.seconds}

    def _work(self, name, state):
        self.done.append((name, state))
        per_round = sum(map(len, self.seconds.values()))
        # Ten times slower in the second half of the rounds.
        slow = 10.0 if len(self.done) > 10 * per_round else 1.0
        noise = 1.0 + self.jitter * self.random.uniform(-1.0, 1.0)
        return self.seconds[name][state] * slow * noise


def test_a_ratio_is_that_of_the_weighted_means_whatever_the_speed_of_the_machine():
    machine = Machine({"all": [1.0, 3.0], "less": [1.0, 2.0]})
    found = paired_timing(machine.candidates(), (3, 1), half_width=0.0, rounds=(20, 20))
    less = found["less"]
    assert np.allclose([less.ratio, less.low, less.high], 5.0 / 6.0, rtol=1e-14)
    assert (found["all"].ratio, found["all"].half_width, less.rounds) == (1.0, 0.0, 20)


def test_a_round_visits_each_candidate_in_each_state_once_in_an_order_of_its_own():
    machine = Machine({"a": [1.0] * 4, "b": [1.0] * 4})
    paired_timing(machine.candidates(), np.ones(4), half_width=0.0, rounds=(6, 6))
    rounds = [machine.done[k : k + 8] for k in range(0, 48, 8)]
    # A half width of 0 is reached at once, by times without any noise: the fewest rounds are made.
    assert len(machine.done) == 48
    assert all(sorted(one) == sorted(rounds[0]) for one in rounds)
    assert len(set(map(tuple, rounds))) == 6


def test_rounds_end_once_all_intervals_are_small():
    machine = Machine({"a": [1.0], "b": [1.0]}, jitter=0.05)
    found = paired_timing(machine.candidates(), (1,), half_width=0.01, rounds=(8, 1000))
    assert 8 < found["b"].rounds < 1000
    assert found["b"].half_width <= 0.01
    most = paired_timing(machine.candidates(), (1,), half_width=1e-6, rounds=(8, 12))
    assert most["b"].rounds == 12


BAD = {
    "candidates must be two or more, got 1": ({"a": abs}, (1.0,), {}),
    "shares must be numbers above 0": ({"a": abs, "b": abs}, (1.0, 0.0), {}),
    "shares must be numbers above 0, one": ({"a": abs, "b": abs}, (), {}),
    "rounds must be": ({"a": abs, "b": abs}, (1.0,), {"rounds": (0, 5)}),
    "half_width must be": ({"a": abs, "b": abs}, (1.0,), {"half_width": -1.0}),
}


@pytest.mark.parametrize("sentence", BAD)
def test_bad_input_is_refused(sentence):
    candidates, shares, options = BAD[sentence]
    with pytest.raises(InputError, match=sentence):
        paired_timing(candidates, shares, **options)


def test_no_value_is_refused():
    with pytest.raises(InputError, match="at least one value, got none"):
        median_interval([])
