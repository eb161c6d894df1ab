"""CPU time of this process and of a piece of work."""

import time
from collections.abc import Callable, Sequence
from statistics import median
from typing import Any

from taichi_dem.kit import runtime


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


def median_interval(values: Sequence[float]) -> tuple[float, float, float]:
    """Median, and the 95 % interval of the median by order; fewer than six have their extremes."""
    from scipy.stats import quantile_test

    low, high = min(values), max(values)
    if len(values) > 5:
        low, high = map(float, quantile_test(values, p=0.5).confidence_interval(0.95))
    return median(values), low, high
