"""A large block: steps a second, gain of a second thread, the share of memory bandwidth."""

from _blast import METHODS
from _scaling_threads import ROUNDS, thread_gain, thread_job
from taichi_dem.kit.study import on_device

#: Boxes along the edges of the block; six tetrahedra each.
SMALL, LARGE, LARGEST = (20, 10, 10), (40, 20, 20), (112, 39, 39)
#: Steps that are timed together, and how often.
STEPS, REPEATS = 4, 3


def measure(quick):
    """Yield the figures of the block: name, unit, values, bound."""
    if quick:
        yield from of_method("explicit_limited", SMALL, 1)
        return
    for cells in (LARGE, LARGEST) if on_device() else (LARGE,):
        for method in METHODS:
            yield from of_method(method, cells, ROUNDS)


def of_method(method, cells, rounds):
    """Yield steps a second by a method, on one thread and on two or on the device."""
    if on_device():
        found = thread_job("", cells, method, 1, STEPS, REPEATS, "cuda")
    else:
        found = thread_gain("", cells, method, STEPS, rounds, REPEATS)
    title = f"block of {found['bodies']}, {method}"
    if "gain" in found:
        yield f"{title}, two threads over one", "1", [found["gain"]], ">= 1.7"
    yield title, "steps/s", [1.0 / s for s in found["seconds"]], ""
    if method == "explicit_limited":
        # There a step moves every body, once.
        share = [found["bytes"] / s / found["bandwidth"] for s in found["seconds"]]
        yield f"{title}, share of the memory's bandwidth", "1", share, ""
