"""The damper's figures: cells and particles a second, and the response figures."""

import os
import subprocess
import sys

import numpy as np

from _bench_clock import on_device, spent
from ca_damper import Automaton, Batch, SceneTable, Spheres

FREQUENCY = 6.0
BASE_AMPLITUDE = 0.6e-3
CELLS = 18 * 12
NUMBERS = (1, 10, 20, 30, 40, 50, 60, 80, 100, 120)
#: The response figure of some fillings on two threads, in a process of its own.
RESPONSES = """
import sys, time
sys.path.insert(0, sys.argv[1])
from taichi_dem import runtime
runtime.start(threads=2)
import damper_response as experiment
from ca_damper import frequency_response
for label in sys.argv[3:]:
    told = []
    cpu = time.process_time()
    frequency_response(experiment.fillings()[label], particles=experiment.FULL["particles"],
        ratios=experiment.RATIOS, seeds=5, transient_cycles=int(sys.argv[2]),
        measured_cycles=20, progress=told.append)
    print(label, told[-1].seconds, time.process_time() - cpu)
"""


class OneScene:
    """Scenes of one filling with different particle numbers, timed one by one."""

    def __init__(self, filling, numbers, dt):
        table = SceneTable(list(numbers), 1, dt, FREQUENCY, BASE_AMPLITUDE)
        self.numbers = list(numbers)
        self.batch = Batch(filling, table)
        # Swinging fully, so that the particles fly.
        self.batch.start("empty")
        self.cycle = int(self.batch.steps_per_cycle[0])
        # Long enough to be shaken through, with all compiled.
        self.batch.advance(3 * self.cycle)

    def step_seconds(self, particles, at_least=0.2):
        """Seconds of a step of the scene with so many particles."""
        steps, seconds = self.cycle, 0.0
        while True:
            seconds = self._seconds(particles, steps)
            if seconds > at_least:
                return seconds / steps
            steps *= 2

    def _seconds(self, particles, steps):
        plan = [0] * self.batch.count
        plan[self.numbers.index(particles)] = steps
        started = spent()
        self.batch.advance(plan)
        return spent() - started


def measure(note, quick):
    """Give every figure of the damper to note(name, unit, values, bound)."""
    repeats = 3 if quick else 7
    scan = OneScene(Automaton(traversal="scan"), NUMBERS, 1e-4)
    rates = [1e-6 * CELLS / scan.step_seconds(50) for _ in range(repeats)]
    note("automaton, scan, N = 50", "million cells/s", rates, ">= 200")
    listed = OneScene(Automaton(), NUMBERS, 1e-4)
    rates = [50e-6 / listed.step_seconds(50) for _ in range(repeats)]
    note("automaton, list, N = 50", "million particle steps/s", rates, ">= 100")
    gains = [list_gain(scan, listed) for _ in range(3)]
    note("automaton, scan / list, least of N = 1 .. 120", "1", gains, "> 1")
    spheres = OneScene(Spheres(), (50,), 2e-5)
    rates = [50e-6 / spheres.step_seconds(50) for _ in range(repeats)]
    note("spheres, N = 50", "million particle steps/s", rates, ">= 30")
    if not quick and not on_device():
        responses(note)


def list_gain(scan, listed):
    """Least ratio of the times of both traversals, each number measured side by side."""
    return float(np.min([scan.step_seconds(n) / listed.step_seconds(n) for n in NUMBERS]))


def responses(note):
    """Seconds of the automata's response figures on two threads, and on an idle pair of cores."""
    labels = ("ca_static", "ca_landing", "ca_ejection")
    here = os.path.dirname(os.path.abspath(__file__))
    command = [sys.executable, "-c", RESPONSES, here, "150", *labels]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    rows = [line.split() for line in done.stdout.splitlines() if line.startswith("ca_")]
    wall = {row[0]: float(row[1]) for row in rows}
    cpu = {row[0]: 0.5 * float(row[2]) for row in rows}
    note("response, static, two threads", "s of wall", [wall["ca_static"]], "<= 60")
    note("response, static, half its CPU", "s", [cpu["ca_static"]], "<= 60")
    note("response, all three, two threads", "s of wall", [sum(wall.values())], "<= 240")
    note("response, all three, half their CPU", "s", [sum(cpu.values())], "<= 240")
