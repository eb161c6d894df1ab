"""The blast's figures: contact units a second, the paper's problem, the wait for the first step."""

import os
import subprocess
import sys
import tempfile

import numpy as np

from _bench_clock import seconds_of, spent
from _blast import METHODS, paper_scene
from taichi_dem import Multirate, Simulation, Uniform, runtime
from taichi_dem.simulation import macro_steps

UNTIL = 5e-4
#: Everything up to the end of the first step, in a process of its own.
FIRST_STEP = """
import sys, time
start = time.perf_counter()
sys.path.insert(0, sys.argv[1])
from taichi_dem import runtime
runtime.start(sys.argv[2], threads=1)
from _bench_blast import paper_simulation
from taichi_dem import Multirate
paper_simulation(Multirate()).advance_to(1)
print(time.perf_counter() - start)
"""


def paper_simulation(method):
    """The paper's block with all of its effects."""
    return Simulation(paper_scene(), method)


def seconds_to(simulation, steps):
    """What advancing to a macro step takes [s]."""
    start = spent()
    simulation.advance_to(steps)
    return spent() - start


def bonded_phase(repeats, steps=4000):
    """Million contact units a second while all bonds hold: whole steps, bodies included."""
    simulation = paper_simulation(Uniform(1e-9))
    simulation.advance_to(steps)
    rates = []
    for k in range(repeats):
        seconds = seconds_to(simulation, (k + 2) * steps)
        rates.append(3e-6 * simulation.model.bond_count * steps / seconds)
    return rates


def paper_problem(method, repeats):
    """Reports of the paper's problem to 5e-4 s by a method; compiling is not in their seconds."""
    reports = []
    for _ in range(repeats):
        simulation = paper_simulation(method)
        simulation.advance_to(macro_steps(UNTIL, method.dt0))
        reports.append(simulation.report())
    return reports


def first_step(cache):
    """Seconds from the start of Python to the end of the first step, with a given cache folder."""
    environment = {**os.environ, "TI_OFFLINE_CACHE_FILE_PATH": cache}
    here = os.path.dirname(os.path.abspath(__file__))
    command = [sys.executable, "-c", FIRST_STEP, here, runtime.settings().arch]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    return float(done.stdout.split()[-1])


def waits(folder, repeats):
    """Cold and warm waits for the first step [s]: an empty cache folder, then the filled one."""
    cold, warm = [], []
    for k in range(repeats):
        cache = os.path.join(folder, f"cache-{os.getpid()}-{k}")
        os.makedirs(cache)
        cold.append(first_step(cache))
        warm.append(first_step(cache))
    return cold, warm


def measure(note, quick):
    """Give every figure of the blast to note(name, unit, values, bound)."""
    note("bonded phase", "million units/s", bonded_phase(3 if quick else 7), ">= 30")
    with tempfile.TemporaryDirectory() as folder:
        cold, warm = waits(folder, 1 if quick else 3)
    note("first step, cold cache", "s", cold, "<= 15")
    note("first step, warm cache", "s", warm, "<= 3")
    measure_methods(note, 1 if quick else 3)
    measure_paper(note, 1e-7, 1 if quick else 3, "<= 20")
    if not quick:
        measure_paper(note, 1e-8, 1, "<= 130")


def measure_methods(note, repeats):
    """The methods that know their limits, and what steps for each gain over one step for all."""

    def timed(name, step=None):
        make, own = METHODS[name]
        return paper_problem(make(step or own), repeats)

    note("paper's problem, implicit", "s", seconds_of(timed("implicit")), "<= 0.9")
    note("paper's problem, limited", "s", seconds_of(timed("explicit_limited")), "<= 5")
    controlled = timed("multirate_controlled")
    note("paper's problem, controlled", "s", seconds_of(controlled), "<= 8")
    # One step for all of equal accuracy is that of the finest body in the controlled run.
    uniform = timed("explicit_limited", METHODS["multirate_controlled"][1] / 8.0)
    gain = np.median(seconds_of(uniform)) / np.median(seconds_of(controlled))
    note("controlled, realised gain", "1", [gain], ">= 3")
    note("controlled, ideal gain", "1", [controlled[0].ideal_gain], "")


def measure_paper(note, distance, repeats, bound):
    """The paper's own rule."""
    reports = paper_problem(Multirate(1e-8, distance), repeats)
    note(f"paper's problem, l = {distance:g} m", "s", seconds_of(reports), bound)
