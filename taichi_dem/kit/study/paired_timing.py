"""Timings of candidates by turns, as ratios to the first one with a confidence interval."""

import math
import statistics
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from taichi_dem.kit.errors import InputError
from taichi_dem.kit.validation import positive, whole

#: Probability that an interval misses the median.
_MISSED = 0.05


@dataclass(frozen=True)
class PairedTiming:
    """Time of a candidate in units of the first one's.

    ratio: median over the rounds; low, high: its interval of 95 %. seconds: median over the rounds
    of the mean over the states. rounds: their number.
    """

    ratio: float
    low: float
    high: float
    seconds: float
    rounds: int

    @property
    def half_width(self) -> float:
        """Half the width of the interval."""
        return 0.5 * (self.high - self.low)


def median_interval(values: Iterable[float]) -> tuple[float, float]:
    """Interval of 95 % for the median of what values are drawn from, by order statistics.

    Nothing is assumed of their distribution. Below six values no such interval exists: then it is
    their range. Raises InputError for no value.
    """
    ordered = sorted(values)
    count = len(ordered)
    if not count:
        raise InputError("the interval of a median must have at least one value, got none")
    # Values outside on either side, as many as leave each tail at most half of what may be missed.
    outside, tail = 0, 0.5**count
    while tail <= 0.5 * _MISSED and 2 * outside < count - 1:
        outside += 1
        tail += math.comb(count, outside) * 0.5**count
    outside = max(0, outside - 1)
    return ordered[outside], ordered[count - 1 - outside]


def paired_timing(
    candidates: Mapping[str, Callable[[int], float]],
    shares: Sequence[float],
    *,
    half_width: float = 0.02,
    rounds: tuple[int, int] = (8, 60),
    seed: int = 1,
) -> dict[str, PairedTiming]:
    """Time candidates from the same states until the intervals of their ratios are small.

    candidates: by name, functions that return the seconds of work from state k; the first is the
    one the others are compared with. shares: weight of each state. A round times every candidate
    from every state, all of them in random order, so that a busy moment of the machine falls on no
    candidate alone. The ratio of a round is that of the weighted means over the states.
    half_width: of the interval, from which no further round is made. rounds: fewest and most.
    Raises InputError for fewer than two candidates, no state, or numbers out of range.
    """
    fewest, most = (whole("rounds", n, 1, 100_000) for n in rounds)
    positive("half_width", half_width, zero_allowed=True)
    weights = _weights(shares)
    if len(candidates) < 2:
        raise InputError(f"candidates must be two or more, got {len(candidates)}")
    works, random = [*candidates.values()], np.random.default_rng(seed)
    seconds: list[np.ndarray] = []
    while len(seconds) < max(fewest, most):
        table = np.empty((len(works), len(weights)))
        for turn in random.permutation(table.size):
            place = divmod(int(turn), len(weights))
            table[place] = works[place[0]](place[1])
        seconds.append(table @ weights)
        found = _timings(candidates, np.array(seconds))
        if len(seconds) >= fewest and all(one.half_width <= half_width for one in found.values()):
            break
    return found


def _weights(shares):
    weights = np.array(shares, dtype=float)
    if weights.ndim != 1 or not len(weights) or not (weights > 0.0).all():
        raise InputError(f"shares must be numbers above 0, one for each state, got {shares!r}")
    return weights / weights.sum()


def _timings(names, seconds):
    """Timing by name; seconds: of rounds and candidates."""
    made = {}
    for name, own in zip(names, seconds.T):
        ratios = own / seconds[:, 0]
        low, high = median_interval(ratios)
        middle = statistics.median(ratios)
        made[name] = PairedTiming(middle, low, high, statistics.median(own), len(seconds))
    return made
