"""A large block: steps a second, what a second thread brings, the share of memory bandwidth."""

import json
import os
import subprocess
import sys
import tempfile

import numpy as np

from _bench_clock import on_device
from _blast import METHODS

_WORKER = os.path.join(os.path.dirname(os.path.abspath(__file__)), "_scaling_worker.py")
#: Boxes along the edges of the block; six tetrahedra each.
SMALL, LARGE, LARGEST = (20, 10, 10), (40, 20, 20), (112, 39, 39)


def worker(method, cells, threads, rounds):
    """What the parallel driver measures in a process of its own."""
    job = {"mesh": None, "cells": cells, "driver": "parallel", "method": method, "warm": 2}
    job.update(arch="cuda" if on_device() else "cpu", threads=threads, steps=4, repeats=rounds)
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "job.json")
        with open(path, "w", encoding="utf-8") as handle:
            json.dump(job, handle)
        line = [sys.executable, _WORKER, path]
        done = subprocess.run(line, capture_output=True, text=True, check=True)
    return json.loads(done.stdout.splitlines()[-1])


def measure(note, quick):
    """Give every figure of the block to note(name, unit, values, bound)."""
    rounds = 1 if quick else 3
    sizes = ((LARGE, LARGEST) if on_device() else (LARGE,)) if not quick else (SMALL,)
    for cells in sizes:
        for method in ("implicit",) if quick else METHODS:
            measure_method(note, method, cells, rounds)


def measure_method(note, method, cells, rounds):
    """Steps a second by a method, on one thread and on two or on the device."""
    alone = worker(method, cells, 1, rounds)
    title = f"block of {alone['bodies']}, {method}"
    if on_device():
        note_speed(note, title, alone)
        return
    pair = worker(method, cells, 2, rounds)
    note_speed(note, title + ", two threads", pair)
    gain = np.min(alone["seconds"]) / np.min(pair["seconds"])
    note(title + ", two threads over one", "1", [gain], ">= 1.7")


def note_speed(note, title, found):
    """Steps a second, and the share of the memory's bandwidth where a step moves every body."""
    note(title, "steps/s", [1.0 / s for s in found["seconds"]], "")
    if "limited" in title:
        share = [found["bytes"] / s / found["bandwidth"] for s in found["seconds"]]
        note(title + ", share of the memory's bandwidth", "1", share, "")
