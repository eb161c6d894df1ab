"""Speed of whole steps of a large block, on one core and on two."""

from statistics import median

from _bench_figure import Figure
from _blast import METHODS
from _scaling_threads import thread_gains, thread_job
from taichi_dem.kit.study import on_device
from taichi_dem.kit.study.floors import MEMORY, Work

#: Boxes along the edges of a block, six tetrahedra each.
SMALL, LARGE, LARGEST = (20, 10, 10), (40, 20, 20), (112, 39, 39)
#: Steps that are timed together, how often, and turns of one and of two threads.
STEPS, REPEATS, ROUNDS = 3, 3, 1
#: Floor of the steps on two threads, measured beside them.
BOTH = f"{MEMORY}, two threads"


def measure(quick):
    """Yield a block's steps a second by every method, and the gain of a second thread."""
    methods = ["explicit_limited"] if quick else [*METHODS]
    if quick or on_device():
        for cells in (SMALL,) if quick else (LARGE, LARGEST):
            yield from speeds(thread_job("", cells, methods, 1, STEPS, REPEATS), "", MEMORY)
        return
    found = thread_gains("", LARGE, methods, STEPS, ROUNDS, REPEATS)
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
