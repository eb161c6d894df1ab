"""Waits of a user: before the first step, from a command to its pictures, for another scene."""

import os
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from pathlib import Path

import numpy as np
from taichi.lang.ast.ast_transformer_utils import Builder
from taichi.lang.kernel_impl import Kernel

from _bench import Figure
from _blast import paper_scene
from ca_damper import Automaton, Batch, SceneTable
from taichi_dem import CONCRETE, ImplicitDashpots, Scene, effects, simulate
from taichi_dem.kit.study import call_in_process, clock
from taichi_dem.mesh.shapes import bar

#: Processes with an empty cache of kernels of their own, and with one that it has filled.
COLD, WARM = 3, 5
#: Gas peaks of ten scenes [Pa], their end [s]; the step of all scenes here, and the demo's end [s].
PEAKS = np.linspace(400e6, 650e6, 10)
UNTIL, STEP, DEMO = 1e-4, 4e-7, 5e-4
HERE = Path(__file__).parent
#: Programs with their options: what is wanted [s] warm, and cold where they are run so too.
PROGRAMS = {
    "blast_fracture": (5.5,),
    "blast_fracture --no-pictures": (3.0,),
    "demo_damper": (3.5, 5.0),
}


def default_blast(**gas):
    """The scene of the demonstration, with other numbers of the gas pressure."""
    return Scene(paper_scene().mesh, CONCRETE, "auto", loads=[effects.GasPressure(**gas)])


def sizes_of_kernels():
    """Of every kernel of the default scenes: tree nodes, and CPU seconds to read and to load it.

    A list of name, nodes and both times; the load has one launch in it.
    """
    found, now = defaultdict(lambda: [0, 0.0, 0.0]), [""]
    visit, read, launch = Builder.__call__, Kernel.materialize, Kernel.launch_kernel

    def counting(self, context, node):
        found[now[0]][0] += 1
        return visit(self, context, node)

    def timed(work, place):
        def method(self, *given, **more):
            fresh, begun = len(self.compiled_kernels), time.process_time()
            now[0] = self.func.__qualname__.replace(".<locals>", "")
            result = work(self, *given, **more)
            if (place == 2 and id(self) not in loaded) or len(self.compiled_kernels) > fresh:
                found[now[0]][place] += time.process_time() - begun
                loaded.add(id(self) if place == 2 else 0)
            return result

        return method

    loaded = set()
    Builder.__call__, Kernel.materialize = counting, timed(read, 1)
    Kernel.launch_kernel = timed(launch, 2)
    simulate(default_blast(), method=ImplicitDashpots(STEP), until=STEP, progress=None)
    batch = Batch(Automaton(), SceneTable(30, 1, 1e-4))
    batch.start()
    batch.advance(1)
    Builder.__call__, Kernel.materialize, Kernel.launch_kernel = visit, read, launch
    return [[name, *sizes] for name, sizes in found.items()]


def waits_of_scenes():
    """Of a session [s]: import, before the first step, of a second scene, around the steps.

    Import: beyond that of Taichi and NumPy. Around: samples, checks and report of the demo, once
    all is compiled.
    """
    code = "import time, numpy, taichi; t = time.process_time(); import taichi_dem; "
    line = [sys.executable, "-c", code + "print(time.process_time() - t)"]
    said = subprocess.run(line, check=True, capture_output=True, text=True).stdout
    # Taichi names its version first.
    imported = float(said.split()[-1])
    demo = {"method": ImplicitDashpots(STEP), "until": DEMO, "frames": 40, "progress": None}
    first = simulate(default_blast(), **demo).report.compile_seconds
    begun = clock()
    report = simulate(default_blast(), **demo).report
    around = clock() - begun - report.compile_seconds - report.run_cpu_seconds
    mesh, gas = bar(1.0, 0.25, (8, 2, 2)), effects.GasPressure(group="left")
    begun = clock()
    other = Scene(mesh, CONCRETE, "auto", loads=[gas])
    second = simulate(other, method=ImplicitDashpots(STEP), until=STEP, progress=None)
    return imported, first, second.report.compile_seconds, around


def ten_scenes():
    """Time of ten scenes of the paper's block in a row to ``UNTIL``."""
    started = clock()
    for peak in PEAKS.tolist():
        scene = default_blast(peak=peak)
        simulate(scene, method=ImplicitDashpots(STEP), until=UNTIL, progress=None)
    return clock() - started


def program_seconds(words, cache):
    """Wall time of a program, from its command to its end, with a folder as cache of kernels."""
    own = {"TI_OFFLINE_CACHE": "1", "TI_OFFLINE_CACHE_FILE_PATH": str(cache)}
    script, *options = words.split()
    with tempfile.TemporaryDirectory() as out:
        line = [sys.executable, str(HERE / f"{script}.py"), *options, "--out", out]
        begun = time.perf_counter()
        subprocess.run(line, check=True, capture_output=True, env={**os.environ, **own})
        return time.perf_counter() - begun


def waits(quick):
    """Yield the waits; quick: of one process each, and not of ten scenes."""
    cold, warm = (1, 1) if quick else (COLD, WARM)
    with tempfile.TemporaryDirectory() as folder:
        caches = [os.path.join(folder, f"{k}") for k in range(cold)]
        fresh = [call_in_process(waits_of_scenes, cache=cache) for cache in caches]
        kept = [call_in_process(waits_of_scenes, cache=caches[0]) for _ in range(warm)]
        imported, first, second, around = zip(*kept)
        yield Figure("import_seconds", "s", imported, "<= 0.2")
        yield Figure("first_scene_cold_seconds", "s", [one[1] for one in fresh], "<= 6")
        yield Figure("first_scene_warm_seconds", "s", first, "<= 1.8")
        yield Figure("second_scene_seconds", "s", second, "<= 0.1")
        yield Figure("around_the_steps_seconds", "s", around, "<= 0.15")
        for name, (wanted, *wanted_cold) in PROGRAMS.items():
            empty = [Path(folder, f"{name}-{k}") for k in range(cold * len(wanted_cold))]
            spent = [program_seconds(name, one) for one in empty]
            program_seconds(name, caches[0])
            full = [program_seconds(name, caches[0]) for _ in range(warm)]
            yield Figure(f"{name}, warm", "s of wall", full, f"<= {wanted:g}")
            if wanted_cold:
                yield Figure(f"{name}, cold", "s of wall", spent, f"<= {wanted_cold[0]:g}")
        for name, nodes, read, load in call_in_process(sizes_of_kernels, cache=caches[0]):
            yield Figure(f"{name}, nodes", "1", [nodes])
            yield Figure(f"{name}, read and loaded", "s", [read + load])
        if not quick:
            ten = call_in_process(ten_scenes, cache=caches[0])
            yield Figure("ten_scenes_seconds", "s", [ten], "<= 10")
