"""Timings that can be compared: warm, repeated, with their spread."""

import statistics
import time
from dataclasses import dataclass

from taichi_dem import InputError, runtime


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
        """Median, and the extremes where there is more than one run."""
        if self.count == 1:
            return f"{self.median:.3g} s"
        return f"{self.median:.3g} s ({self.low:.3g} to {self.high:.3g}, {self.count} runs)"


def on_device():
    """Tell whether kernels run beside the CPU, which then only waits for them."""
    return runtime.settings().arch != "cpu"


def clock():
    """CPU seconds of this process so far, or the wall clock where a device works [s]."""
    if on_device():
        # Imported before the package it would print its version.
        import taichi as ti

        ti.sync()
        return time.perf_counter()
    return time.process_time()


def seconds_of(work, *arguments):
    """Seconds that work(*arguments) takes by ``clock``."""
    started = clock()
    work(*arguments)
    return clock() - started
