"""Timings that can be compared: warm, repeated, with their spread."""

import statistics
import time
from dataclasses import dataclass

from taichi_dem import InputError


@dataclass(frozen=True)
class Timing:
    """Seconds of repeated runs of one job. median; low, high: the extremes; count of runs."""

    median: float
    low: float
    high: float
    count: int

    @classmethod
    def of(cls, seconds):
        """Timing of a sequence of measured times [s]; InputError for an empty one."""
        values = sorted(seconds)
        if not values:
            raise InputError("a timing must have at least one measurement, got none")
        return cls(statistics.median(values), values[0], values[-1], len(values))

    @property
    def spread(self):
        """Width of the measurements as a share of their median."""
        return (self.high - self.low) / self.median if self.median > 0.0 else 0.0

    def __str__(self):
        """Median, and what lies between the extremes where there is more than one run."""
        if self.count == 1:
            return f"{self.median:.3g} s"
        return f"{self.median:.3g} s ({self.low:.3g} to {self.high:.3g}, {self.count} runs)"


def measure(work, repeats=5, warm_up=1, clock=time.perf_counter):
    """Time a function without arguments, after calls that compile and fill the caches.

    work must wait for what it starts: a kernel on a GPU is over only after ``ti.sync()``.
    """
    for _ in range(warm_up):
        work()
    seconds = []
    for _ in range(repeats):
        started = clock()
        work()
        seconds.append(clock() - started)
    return Timing.of(seconds)
