"""What a second thread, or a device, does for whole steps of a large block."""

from pathlib import Path

import numpy as np

from taichi_dem import InputError
from taichi_dem.kit.study import ask_worker

#: How often runs on one and on two threads take turns.
ROUNDS = 2


def thread_job(mesh, cells, method, threads, steps, repeats, arch="cpu"):
    """What ``_scaling_worker`` says of whole steps by the parallel driver."""
    job = {"mesh": mesh, "cells": cells, "method": method, "threads": threads, "arch": arch}
    job.update(driver="parallel", warm=2, steps=steps, repeats=repeats)
    return ask_worker(Path(__file__).with_name("_scaling_worker.py"), job, f"on {threads} threads")


def thread_gain(mesh, cells, method, steps, rounds, repeats):
    """Time of one thread over that of two, a row of figures; the bits must be the same.

    Runs on one and on two threads take turns, as what else keeps the cores busy changes. busy: the
    same of what the busiest thread took of the cores, None where the system does not tell. seconds:
    those of a step on two threads.
    """
    times = {name: {1: [], 2: []} for name in ("seconds", "busy")}
    digests = set()
    for _ in range(rounds):
        for threads in (1, 2):
            found = thread_job(mesh, cells, method, threads, steps, repeats)
            digests.add(found["digest"])
            for name, by_threads in times.items():
                by_threads[threads] += [value for value in found[name] if value is not None]
    if len(digests) > 1:
        raise InputError("one thread and two threads must give the same bits, and do not")
    busy = _gain(times["busy"]) if times["busy"][2] else None
    kept = {key: found[key] for key in ("bodies", "bytes", "bandwidth")}
    return {**kept, "gain": _gain(times["seconds"]), "busy": busy, "seconds": times["seconds"][2]}


def _gain(times):
    return float(np.min(times[1]) / np.min(times[2]))
