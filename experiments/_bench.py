"""Figures of the bench: the damper, waits of a user, the paper's blast."""

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from statistics import median
from typing import NamedTuple

from ca_damper import Automaton, Paper, Spheres
from cases.blast import METHODS, paper_scene
from damper_cost import cycle_seconds, scenes
from taichi_dem import (
    CONCRETE,
    ImplicitDashpots,
    Multirate,
    Scene,
    Simulation,
    Uniform,
    effects,
    simulate,
)
from taichi_dem.kit.study import call_in_process, on_device, seconds_of
from taichi_dem.mesh.shapes import bar
from taichi_dem.observers import macro_steps

#: Cells of the automaton's box, and least million steps of a sphere a second that are wanted.
CELLS, WANTED = 18 * 12, {10: 120, 50: 90}
#: Step and displacement limit of the paper, end of its run here [s], and the evaluations of bonds
#: and pairs that this method makes to the end of the whole run, counted in one.
FINEST, EARLY, EVALUATIONS = (1e-8, 1e-8), 1e-4, 1_278_384_011
#: Step of the bonded phase [s], and its steps that are timed together.
BONDED, STEPS = 1e-9, 4000
#: Runs of the paper's problem: method, step [s] if not the usual one, end [s], repeats, seconds
#: that are wanted; 1 % allows a step of 8e-7 s. The quick bench has the first three.
RUNS = {
    "to 0.1 ms, implicit": ("implicit", None, 1e-4, 5, ""),
    "to 0.1 ms, implicit, 0.8 us": ("implicit", 8e-7, 1e-4, 5, "<= 0.06"),
    "to 0.1 ms, limited": ("explicit_limited", None, 1e-4, 1, ""),
    "implicit": ("implicit", None, 5e-4, 5, "<= 0.45"),
    "limited": ("explicit_limited", None, 5e-4, 1, "<= 5"),
    "controlled": ("multirate_controlled", None, 5e-4, 2, "<= 8"),
    "l = 1e-07 m": ("paper_multirate", None, 5e-4, 1, "<= 14"),
}
#: Processes with an empty cache of kernels of their own, and with one that it has filled; step of
#: their scenes [s].
COLD, WARM, STEP = 3, 5, 4e-7
#: Programs with their options: what is wanted [s] warm, and cold where they are run so too.
PROGRAMS = {
    "blast_fracture": (5.5,),
    "blast_fracture --no-pictures": (3.0,),
    "demo_damper": (3.5, 5.0),
}


class Figure(NamedTuple):
    """Repeated measurements of one quantity; wanted: its bound, in words."""

    name: str
    unit: str
    values: Sequence[float]
    wanted: str = ""

    @property
    def middle(self):
        """Median of the values."""
        return float(median(self.values))


def by_turns(works):
    """Results by name of functions that are called so many times, one call each before a second.

    So a busy minute of the machine does not fall on one candidate alone.
    """
    found = {name: [] for name in works}
    for turn in range(max(repeats for _, repeats in works.values())):
        for name, (work, repeats) in works.items():
            if turn < repeats:
                found[name].append(work())
    return found


def damper(quick):
    """Yield the damper's cells and particles a second."""
    repeats, least = (3, 0.03) if quick else (7, 0.06)
    cases = {
        "automaton, scan, N = 50": (Automaton(Paper(), traversal="scan"), 50, CELLS, 500),
        "automaton, list, N = 50": (Automaton(Paper()), 50, 50, 100),
        "automaton, rules of place, N = 50": (Automaton(), 50, 50, 80),
        **{f"spheres, N = {n}": (Spheres(), n, n, wanted) for n, wanted in WANTED.items()},
    }
    works = {name: (rate_of(*case[:3], least), repeats) for name, case in cases.items()}
    for name, values in by_turns(works).items():
        unit = "million cells/s" if "scan" in name else "million particle steps/s"
        yield Figure(name, unit, values, f">= {cases[name][3]}")


def rate_of(filling, particles, count, least):
    """A function: millions of count a second in a run of at least some seconds."""
    batch = scenes(filling, particles, 2e-5 if isinstance(filling, Spheres) else 1e-4)
    # Long enough shaken through, with all compiled.
    batch.advance(3 * batch.steps_per_cycle)

    def rate():
        cycles, seconds = 1, 0.0
        while seconds <= least:
            cycles *= 2
            seconds = cycle_seconds(batch, 0, cycles)
        return 1e-6 * count * cycles * int(batch.steps_per_cycle[0]) / seconds

    return rate


def waits(quick):
    """Yield the waits of a user; quick: of one process each."""
    cold, warm = (1, 1) if quick else (COLD, WARM)
    with tempfile.TemporaryDirectory() as folder:
        caches = [os.path.join(folder, f"{k}") for k in range(cold)]
        fresh = [call_in_process(waits_of_scenes, cache=cache) for cache in caches]
        kept = [call_in_process(waits_of_scenes, cache=caches[0]) for _ in range(warm)]
        imported, first, second = zip(*kept)
        yield Figure("import_seconds", "s", imported, "<= 0.2")
        yield Figure("first_scene_cold_seconds", "s", [one[1] for one in fresh], "<= 6")
        yield Figure("first_scene_warm_seconds", "s", first, "<= 1.8")
        yield Figure("second_scene_seconds", "s", second, "<= 0.1")
        for name, (wanted, *wanted_cold) in PROGRAMS.items():
            for bound in wanted_cold:
                spent = [program_seconds(name, f"{folder}/{name}-{k}") for k in range(cold)]
                yield Figure(f"{name}, cold", "s of wall", spent, f"<= {bound:g}")
            program_seconds(name, caches[0])
            spent = [program_seconds(name, caches[0]) for _ in range(warm)]
            yield Figure(f"{name}, warm", "s of wall", spent, f"<= {wanted:g}")


def waits_of_scenes():
    """Of a session [s]: import beyond Taichi, before the first step, of a second scene."""
    code = "import time, numpy, taichi; t = time.process_time(); import taichi_dem; "
    line = [sys.executable, "-c", code + "print(time.process_time() - t)"]
    said = subprocess.run(line, check=True, capture_output=True, text=True).stdout
    mesh, gas = bar(1.0, 0.25, (8, 2, 2)), effects.GasPressure(group="left")
    blast = Scene(paper_scene().mesh, CONCRETE, "auto", loads=[effects.GasPressure()])
    waited = [
        simulate(scene, method=ImplicitDashpots(STEP), until=STEP, progress=None)
        for scene in (blast, Scene(mesh, CONCRETE, "auto", loads=[gas]))
    ]
    # Taichi names its version first.
    return float(said.split()[-1]), *(one.report.compile_seconds for one in waited)


def program_seconds(words, cache):
    """Wall time of a program, from its command to its end, with a folder as cache of kernels."""
    own = {"TI_OFFLINE_CACHE": "1", "TI_OFFLINE_CACHE_FILE_PATH": cache}
    script, *options = words.split()
    with tempfile.TemporaryDirectory() as out:
        path = Path(__file__).with_name(f"{script}.py")
        line = [sys.executable, str(path), *options, "--out", out]
        begun = time.perf_counter()
        subprocess.run(line, check=True, capture_output=True, env={**os.environ, **own})
        return time.perf_counter() - begun


def blast(quick):
    """Yield the blast's contact units a second, and the paper's problem by several methods."""
    yield bonded_phase(3 if quick else 7)
    runs = dict([*RUNS.items()][: 3 if quick else None])
    works = {words: (run_of(*run[:3]), run[3]) for words, run in runs.items()}
    for words, values in by_turns(works).items():
        yield Figure(f"paper's problem, {words}", "s", values, RUNS[words][4])
    if not quick:
        # Evaluations of bonds and pairs cost alike early and late.
        seconds, evaluations = paper_run(Multirate(*FINEST), EARLY)
        values = [seconds * EVALUATIONS / evaluations]
        yield Figure("paper's problem, l = 1e-08 m, extrapolated", "s", values, "<= 95")


def driver():
    """The driver of one core, where there is a core."""
    return "auto" if on_device() else "resident"


def bonded_phase(repeats):
    """Million contact units a second while all bonds hold: whole steps with the bodies."""
    simulation = Simulation(paper_scene(), Uniform(BONDED), driver())
    simulation.advance_to(STEPS)
    ends = [(k + 2) * STEPS for k in range(repeats)]
    seconds = [seconds_of(simulation.advance_to, end) for end in ends]
    # Three units a bond.
    units = 3e-6 * simulation.model.bond_count * STEPS
    return Figure("bonded phase", "million units/s", [units / one for one in seconds], ">= 60")


def run_of(name, step, until):
    """A function: seconds of a run by a method to a time [s]."""
    make, usual = METHODS[name]
    return lambda: paper_run(make(step or usual), until)[0]


def paper_run(method, until):
    """Seconds of a run of the paper's problem without compiling, and its evaluations."""
    simulation = Simulation(paper_scene(), method, driver())
    simulation.advance_to(macro_steps(until, method.dt0))
    report = simulation.report()
    seconds = report.run_seconds if on_device() else report.run_cpu_seconds
    return seconds, simulation.evaluations()


#: Functions that yield figures; quick: fewer of them, shorter jobs.
PARTS = (damper, waits, blast)
