"""The blast's figures: contact units a second, the paper's problem, the wait for the first step."""

import os
import subprocess
import sys
import tempfile
import time

from _cli import PAPER_BLOCK
from taichi_dem import CONCRETE, Multirate, Scene, Simulation, Uniform, effects, read_mesh
from taichi_dem.simulation import macro_steps

UNTIL = 5e-4
#: Everything up to the end of the first step, in a process of its own.
FIRST_STEP = """
import sys, time
start = time.perf_counter()
sys.path.insert(0, sys.argv[1])
from taichi_dem import runtime
runtime.start(threads=1)
from _bench_blast import paper_simulation
from taichi_dem import Multirate
paper_simulation(Multirate()).advance_to(1)
print(time.perf_counter() - start)
"""


def paper_simulation(method, driver="resident"):
    """The paper's block with all of its effects."""
    listed = [
        effects.BondDamping(),
        effects.Softening(),
        effects.ShearSlip(),
        effects.SphereContact(),
        effects.Friction(),
        effects.GasPressure(),
    ]
    return Simulation(Scene(read_mesh(PAPER_BLOCK), CONCRETE, listed), method, driver)


def cpu_seconds(simulation, steps):
    """CPU time of advancing to a macro step [s]."""
    start = time.process_time()
    simulation.advance_to(steps)
    return time.process_time() - start


def bonded_phase(repeats, steps=4000):
    """Million contact units a second while all bonds hold: whole steps, bodies included."""
    simulation = paper_simulation(Uniform(1e-9))
    simulation.advance_to(steps)
    rates = []
    for k in range(repeats):
        seconds = cpu_seconds(simulation, (k + 2) * steps)
        rates.append(3e-6 * simulation.model.bond_count * steps / seconds)
    return rates


def paper_problem(distance, repeats):
    """CPU seconds of the paper's problem to 5e-4 s by its own rule, compile time apart."""
    seconds = []
    for _ in range(repeats):
        simulation = paper_simulation(Multirate(1e-8, distance))
        simulation.start()
        seconds.append(cpu_seconds(simulation, macro_steps(UNTIL, 1e-8)))
    return seconds


def first_step(cache):
    """Seconds from the start of Python to the end of the first step, with a given cache folder."""
    environment = {**os.environ, "TI_OFFLINE_CACHE_FILE_PATH": cache}
    here = os.path.dirname(os.path.abspath(__file__))
    command = [sys.executable, "-c", FIRST_STEP, here]
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
    note("paper's problem, l = 1e-7 m", "s", paper_problem(1e-7, 1 if quick else 3), "<= 20")
    if not quick:
        note("paper's problem, l = 1e-8 m", "s", paper_problem(1e-8, 1), "<= 130")
