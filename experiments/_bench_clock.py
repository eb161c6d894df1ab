"""What a figure of the bench counts: CPU time of a core, or the wall where a device works."""

import time

import taichi as ti

from taichi_dem import runtime


def on_device():
    """Whether kernels run beside the CPU, which then only waits for them."""
    return runtime.settings().arch != "cpu"


def spent():
    """Seconds that work has taken so far: a difference of two is what lies between them."""
    if on_device():
        ti.sync()
        return time.perf_counter()
    return time.process_time()


def seconds_of(reports):
    """Seconds of runs, of CPU or of the wall; compiling is not in them."""
    return [r.run_seconds if on_device() else r.run_cpu_seconds for r in reports]
