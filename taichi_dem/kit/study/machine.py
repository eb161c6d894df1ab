"""The machine under a measurement: CPU seconds of each thread."""

import glob
import os
from collections.abc import Mapping


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
