"""CPU time: of this process, of its threads, of a piece of work."""

import glob
import os
import time
from collections.abc import Callable, Mapping
from typing import Any

from taichi_dem.kit import runtime

#: Probability that an interval misses the median.
_MISSED = 0.05


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
    """CPU seconds between two ``thread_seconds`` that no further core would have saved."""
    # The main thread waits while others work, so its time and that of the busiest other add up.
    spent = {number: seconds - before.get(number, 0.0) for number, seconds in after.items()}
    if not spent:
        return None
    main_thread = spent.pop(os.getpid())
    return main_thread + max(spent.values(), default=0.0)
