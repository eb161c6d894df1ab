"""Timings that can be compared: warm, repeated, with their spread."""

import statistics
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

from taichi_dem.kit import runtime
from taichi_dem.kit.errors import InputError


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

    @property
    def spread(self) -> float:
        """Width of the measurements as a share of their median."""
        return (self.high - self.low) / self.median if self.median > 0.0 else 0.0

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
