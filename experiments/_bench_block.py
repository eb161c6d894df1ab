"""A large block: steps a second, what a second thread brings, the share of memory bandwidth."""

from _bench_clock import on_device
from _blast import METHODS
from _scaling_threads import ROUNDS, thread_gain, thread_job

#: Boxes along the edges of the block; six tetrahedra each.
SMALL, LARGE, LARGEST = (20, 10, 10), (40, 20, 20), (112, 39, 39)
#: Steps that are timed together, and how often.
STEPS, REPEATS = 4, 3


def measure(note, quick):
    """Give every figure of the block to note(name, unit, values, bound)."""
    if quick:
        measure_method(note, "explicit_limited", SMALL, 1)
        return
    for cells in (LARGE, LARGEST) if on_device() else (LARGE,):
        for method in METHODS:
            measure_method(note, method, cells, ROUNDS)


def measure_method(note, method, cells, rounds):
    """Steps a second by a method, on one thread and on two or on the device."""
    if on_device():
        found = thread_job("", cells, method, 1, STEPS, REPEATS, "cuda")
        title = f"block of {found['bodies']}, {method}"
    else:
        found = thread_gain("", cells, method, STEPS, rounds, REPEATS)
        title = f"block of {found['bodies']}, {method}"
        note(f"{title}, two threads over one", "1", [found["gain"]], ">= 1.7")
    note(title, "steps/s", [1.0 / s for s in found["seconds"]], "")
    if method == "explicit_limited":
        # There a step moves every body, once.
        share = [found["bytes"] / s / found["bandwidth"] for s in found["seconds"]]
        note(f"{title}, share of the memory's bandwidth", "1", share, "")
