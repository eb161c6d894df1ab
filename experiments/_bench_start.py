"""Seconds before the first step, each in a new process: first and second scene, ten scenes."""

import os
import tempfile
import time

import numpy as np
from taichi.lang.ast.ast_transformer_utils import Builder

from _bench_figure import Figure
from _blast import paper_effects, paper_scene
from taichi_dem import CONCRETE, ImplicitDashpots, Multirate, Scene, Simulation, effects, simulate
from taichi_dem.kit.study import call_in_process, clock
from taichi_dem.mesh.shapes import bar

#: Processes of each kind, and of those of ten scenes that are timed.
ROUNDS, TEN = 1, 1
#: Gas peaks of the ten scenes [Pa], their end [s]; the step of all scenes here [s].
PEAKS = np.linspace(400e6, 650e6, 10)
UNTIL, STEP = 1e-4, 4e-7


def first_step(begun):
    """Wall time from the start of Python, of ``time.time()``, to the end of the first step."""
    Simulation(paper_scene(), Multirate()).advance_to(1)
    return time.time() - begun


def two_scenes():
    """Time before the first step of a session's first scene, and of one of another mesh."""
    # Imports the reader of meshes.
    paper_scene()
    first = clock()
    Simulation(paper_scene(), ImplicitDashpots(STEP)).start()
    second = clock()
    mesh = bar(1.0, 0.25, (8, 2, 2))
    Simulation(pressed(mesh, group="left"), ImplicitDashpots(STEP)).start()
    return second - first, clock() - second


def pressed(mesh, **gas):
    """A scene with the paper's effects and other numbers of the gas pressure."""
    return Scene(mesh, CONCRETE, [*paper_effects()[:-1], effects.GasPressure(**gas)])


def ten_scenes(count=None):
    """Time of the scenes of the paper's block, or the first of them, in a row to ``UNTIL``."""
    started = clock()
    for peak in PEAKS[:count].tolist():
        scene = pressed(paper_scene().mesh, peak=peak)
        simulate(scene, method=ImplicitDashpots(STEP), until=UNTIL, progress=None)
    return clock() - started


def tree_nodes():
    """Nodes of Python's trees that Taichi visits to compile the steps of the default blast."""
    visited, visit = [0], Builder.__call__

    def counting(self, context, node):
        visited[0] += 1
        return visit(self, context, node)

    scene = Scene(paper_scene().mesh, CONCRETE, "auto", loads=[effects.GasPressure()])
    made = Simulation(scene, ImplicitDashpots(STEP), "resident")
    Builder.__call__ = counting
    made.driver.begin()
    return visited[0]


def measure(quick):
    """Yield the waits; quick: of one process, and not of ten scenes.

    A cold process has an empty cache of kernels of its own, a warm one that of a process before.
    """
    first, second, step = {}, {}, {}
    with tempfile.TemporaryDirectory() as folder:
        for k in range(1 if quick else ROUNDS):
            cache = os.path.join(folder, f"cache-{k}")
            for state in ("cold", "warm"):
                waits = call_in_process(two_scenes, cache=cache)
                for found, value in zip((first, second), waits):
                    found.setdefault(state, []).append(value)
                if not quick:
                    wait = call_in_process(first_step, cache=cache, begun=time.time())
                    step.setdefault(state, []).append(wait)
        for state, bound, wall in (("cold", "<= 10", "<= 15"), ("warm", "<= 3", "<= 3")):
            yield Figure(f"first_scene_{state}_seconds", "s", first[state], bound)
            if not quick:
                yield Figure(f"first step, {state} cache", "s", step[state], wall)
        nodes = call_in_process(tree_nodes)
        yield Figure("tree_nodes_of_a_step", "1", [nodes], "<= 35500")
        yield Figure("second_scene_seconds", "s", second["warm"], "<= 0.1")
        if not quick:
            # One scene fills the cache.
            call_in_process(ten_scenes, cache=cache, count=1)
            ten = [call_in_process(ten_scenes, cache=cache) for _ in range(TEN)]
            yield Figure("ten_scenes_seconds", "s", ten, "<= 10")
