"""Figures of the bench: steps of a large block, and how they grow with the number of bodies."""

from statistics import median

import numpy as np

from _bench import Figure
from _blast import METHODS
from _threads import thread_gains, thread_job
from taichi_dem.kit.study import on_device
from taichi_dem.kit.study.floors import MEMORY, Work

#: Boxes along the edges of a block, six tetrahedra each.
SMALL, LARGE, LARGEST = (20, 10, 10), (40, 20, 20), (112, 39, 39)
#: Steps that are timed together, how often, and turns of one and of two threads.
BLOCK_STEPS, REPEATS, ROUNDS = 3, 3, 1
#: Floor of the steps on two threads, measured beside them.
BOTH = f"{MEMORY}, two threads"
#: Boxes along the width of the bars over whose bodies times of a step grow, twice that in length:
#: 2,592 to 96,000 bodies; steps in one timing of each.
WIDTHS, GROWTH_STEPS = (6, 9, 13, 20), (100, 30, 10, 3)


def block(quick):
    """Yield a block's steps a second by every method, and the gain of a second thread."""
    methods = ["explicit_limited"] if quick else [*METHODS]
    if quick or on_device():
        for cells in (SMALL,) if quick else (LARGE, LARGEST):
            yield from speeds(thread_job("", cells, methods, 1, BLOCK_STEPS, REPEATS), "", MEMORY)
        return
    found = thread_gains("", LARGE, methods, BLOCK_STEPS, ROUNDS, REPEATS)
    for name, one in found.items():
        title = f"block of {one['bodies']}, {name}, two threads over one"
        # By the busiest thread: other programs may have kept the cores busy.
        gain = one["gain"] if one["busy"] is None else one["busy"]
        yield Figure(title, "1", [gain], ">= 1.8")
    yield Figure(BOTH, "GB/s", [1e-9 * median(one["bandwidth"] for one in found.values())])
    yield from speeds(found, ", two threads", BOTH)


def speeds(found, threads, store):
    """Yield steps a second by method, and milliseconds of a solved step; store: floor of bytes."""
    for name, one in found.items():
        title, work = f"block of {one['bodies']}, {name}{threads}", Work(*one["work"], store)
        yield Figure(title, "steps/s", [1.0 / s for s in one["seconds"]], "", work)
        if name == "implicit":
            yield Figure(f"{title}, a step", "ms", [1e3 * s for s in one["seconds"]], "", work)


def growth(quick):
    """Yield the power of the number of bodies that a step's time grows by, for every method."""
    if quick or on_device():
        return
    found = []
    for width, steps in zip(WIDTHS, GROWTH_STEPS):
        cells = 2 * width, width, width
        found.append(thread_job("", cells, [*METHODS], 1, steps, REPEATS))
    for name in METHODS:
        bodies = [one[name]["bodies"] for one in found]
        # Of the busiest thread, where the system tells; a fit for each repeat.
        told = "seconds" if None in found[0][name]["busy"] else "busy"
        powers = np.polyfit(np.log(bodies), np.log([one[name][told] for one in found]), 1)[0]
        words = f"{name}, power of the bodies in the time of a step, {bodies[0]} to {bodies[-1]}"
        yield Figure(words, "1", [*map(float, powers)], "1.00 to 1.05")
