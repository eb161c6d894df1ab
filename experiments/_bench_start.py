"""Seconds before the first step, each in a new process: first and second scene, ten scenes."""

import os
import subprocess
import sys
import tempfile
import time

import numpy as np

from _blast import paper_effects, paper_scene
from taichi_dem import CONCRETE, ImplicitDashpots, Multirate, Scene, Simulation, effects, runtime
from taichi_dem import simulate as run_scene
from taichi_dem.kit.study import clock
from taichi_dem.mesh.shapes import bar

#: Code of a new process: prints the seconds that MODULE.FUNCTION(begun, *arguments) returns.
CHILD = """
import importlib, sys, time
begun = time.perf_counter()
folder, arch, threads, module, function, *arguments = sys.argv[1:]
sys.path.insert(0, folder)
work = getattr(importlib.import_module(module), function)
from taichi_dem import runtime
runtime.start(arch, threads=int(threads))
print(*work(begun, *arguments))
"""
#: Gas peaks of the ten scenes [Pa], their end [s]; the step of all scenes here [s].
PEAKS = np.linspace(400e6, 650e6, 10)
UNTIL, STEP = 1e-4, 4e-7


def in_new_process(module, function, *arguments, threads=1, cache=None):
    """Numbers that a function returns in a new process; cache: folder of compiled kernels."""
    own = {} if cache is None else {"TI_OFFLINE_CACHE_FILE_PATH": cache}
    here, arch = os.path.dirname(os.path.abspath(__file__)), runtime.settings().arch
    line = [sys.executable, "-c", CHILD, here, arch, str(threads), module, function, *arguments]
    options = {"env": {**os.environ, **own}, "stdout": subprocess.PIPE, "text": True}
    done = subprocess.run(line, check=True, **options)
    return [float(word) for word in done.stdout.splitlines()[-1].split()]


def first_step(begun):
    """Wall time from the start of Python to the end of the first step."""
    Simulation(paper_scene(), Multirate()).advance_to(1)
    return [time.perf_counter() - begun]


def two_scenes(begun):
    """Time before the first step of a session's first scene, and of one of another mesh."""
    # Imports the reader of meshes.
    paper_scene()
    first = clock()
    Simulation(paper_scene(), ImplicitDashpots(STEP)).start()
    second = clock()
    mesh = bar(1.0, 0.25, (8, 2, 2))
    Simulation(pressed(mesh, group="left"), ImplicitDashpots(STEP)).start()
    return [second - first, clock() - second]


def pressed(mesh, **gas):
    """A scene with the paper's effects and other numbers of the gas pressure."""
    return Scene(mesh, CONCRETE, [*paper_effects()[:-1], effects.GasPressure(**gas)])


def ten_scenes(begun):
    """Time of all scenes of the paper's block, one after the other, to ``UNTIL``."""
    started = clock()
    for peak in PEAKS.tolist():
        scene = pressed(paper_scene().mesh, peak=peak)
        run_scene(scene, method=ImplicitDashpots(STEP), until=UNTIL, progress=None)
    return [clock() - started]


def measure(quick):
    """Yield the waits: name, unit, values, bound; quick: of one process, and not of ten scenes.

    A cold process has an empty cache of kernels of its own, a warm one that of a process before.
    """
    waits = {}
    with tempfile.TemporaryDirectory() as folder:
        for k in range(1 if quick else 5):
            cache = os.path.join(folder, f"cache-{k}")
            os.mkdir(cache)
            for state in ("cold", "warm"):
                first, second = in_new_process(__name__, "two_scenes", cache=cache)
                step = [] if quick else in_new_process(__name__, "first_step", cache=cache)
                for name, value in (("first", [first]), ("second", [second]), ("step", step)):
                    waits[state, name] = waits.get((state, name), []) + value
        for state, bound, wall in (("cold", "<= 10", "<= 15"), ("warm", "<= 3", "<= 3")):
            yield f"first_scene_{state}_seconds", "s", waits[state, "first"], bound
            if not quick:
                yield f"first step, {state} cache", "s", waits[state, "step"], wall
        yield "second_scene_seconds", "s", waits["warm", "second"], "<= 0.1"
        if not quick:
            ten = [in_new_process(__name__, "ten_scenes", cache=cache)[0] for _ in range(6)]
            # The first of them fills the cache.
            yield "ten_scenes_seconds", "s", ten[1:], "<= 10"
