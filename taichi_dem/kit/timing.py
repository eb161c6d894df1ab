"""Comparable timings: warm, repeated, in turns, with their spread."""

import glob
import math
import os
import statistics
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from taichi_dem.kit import runtime
from taichi_dem.kit.errors import InputError

#: Probability that an interval misses the median.
_MISSED = 0.05


@dataclass(frozen=True)
class Timing:
    """Seconds of repeated runs of one job. median; low, high: the extremes; count of runs."""

    median: float
    low: float
    high: float
    count: int

    @classmethod
    def of(cls, seconds: Iterable[float]) -> "Timing":
        """Timing of a sequence of measured times [s]; InputError for an empty one."""
        values = sorted(seconds)
        if not values:
            raise InputError("a timing must have at least one measurement, got none")
        return cls(statistics.median(values), values[0], values[-1], len(values))

    def __str__(self) -> str:
        """Median, and the extremes where there is more than one run."""
        if self.count == 1:
            return f"{self.median:.3g} s"
        return f"{self.median:.3g} s ({self.low:.3g} to {self.high:.3g}, {self.count} runs)"


def on_device() -> bool:
    """Tell whether kernels run beside the CPU, which then only waits for them."""
    settings = runtime.settings()
    return settings is not None and settings.arch != "cpu"


def clock() -> float:
    """CPU seconds of this process so far, or the wall clock where a device works [s]."""
    if on_device():
        # Imported before the package it would print its version.
        import taichi as ti

        ti.sync()
        return time.perf_counter()
    return time.process_time()


def seconds_of(work: Callable, *arguments: Any) -> float:
    """Seconds that work(*arguments) takes by ``clock``."""
    started = clock()
    work(*arguments)
    return clock() - started


def thread_seconds() -> dict[int, float]:
    """CPU seconds of each thread of this process so far, by its number; empty where unknown."""
    found = {}
    for path in glob.glob("/proc/self/task/*/schedstat"):
        with open(path, encoding="ascii") as handle:
            found[int(path.split("/")[-2])] = 1e-9 * int(handle.read().split()[0])
    return found


def busiest_seconds(before: Mapping[int, float], after: Mapping[int, float]) -> float | None:
    """CPU seconds between two ``thread_seconds`` that no further core would have saved.

    They are those of the main thread, which waits while others work, and of the busiest of the
    others: on free cores a run takes no less. None where threads are not known.
    """
    spent = {number: seconds - before.get(number, 0.0) for number, seconds in after.items()}
    if not spent:
        return None
    main_thread = spent.pop(os.getpid())
    return main_thread + max(spent.values(), default=0.0)


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
    their range.
    """
    ordered = sorted(values)
    count = len(ordered)
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
    """
    weights = np.array(shares, dtype=float) / np.sum(shares)
    works, random = [*candidates.values()], np.random.default_rng(seed)
    seconds: list[np.ndarray] = []
    while len(seconds) < max(rounds):
        table = np.empty((len(works), len(weights)))
        for turn in random.permutation(table.size):
            place = divmod(int(turn), len(weights))
            table[place] = works[place[0]](place[1])
        seconds.append(table @ weights)
        found = _timings(candidates, np.array(seconds))
        if len(seconds) >= rounds[0] and all(x.half_width <= half_width for x in found.values()):
            break
    return found


def _timings(names, seconds):
    """Timing by name; seconds: of rounds and candidates."""
    made = {}
    for name, own in zip(names, seconds.T):
        ratios = own / seconds[:, 0]
        middle = statistics.median(ratios)
        ends = median_interval(ratios)
        made[name] = PairedTiming(middle, *ends, statistics.median(own), len(seconds))
    return made
