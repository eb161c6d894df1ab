"""The damper's figures: cells and particles a second, and the response figures."""

import time

from _bench_start import in_new_process
from _timing import on_device, seconds_of
from ca_damper import Automaton, Batch, SceneTable, Spheres, frequency_response

FREQUENCY, BASE_AMPLITUDE = 6.0, 0.6e-3
CELLS = 18 * 12
NUMBERS = (1, 10, 20, 30, 40, 50, 60, 80, 100, 120)


def measure(quick):
    """Yield the figures of the damper: name, unit, values, bound."""
    repeats = range(3 if quick else 7)
    scan = OneScene(Automaton(traversal="scan"), NUMBERS, 1e-4)
    rates = [1e-6 * CELLS / scan.step_seconds(50) for _ in repeats]
    yield "automaton, scan, N = 50", "million cells/s", rates, ">= 200"
    listed = OneScene(Automaton(), NUMBERS, 1e-4)
    rates = [50e-6 / listed.step_seconds(50) for _ in repeats]
    yield "automaton, list, N = 50", "million particle steps/s", rates, ">= 100"
    least = 0.05 if quick else 0.2
    gains = [
        min(scan.step_seconds(n, least) / listed.step_seconds(n, least) for n in NUMBERS)
        for _ in range(1 if quick else 3)
    ]
    yield "automaton, scan / list, least of N = 1 .. 120", "1", gains, "> 1"
    spheres = OneScene(Spheres(), (50,), 2e-5)
    rates = [50e-6 / spheres.step_seconds(50) for _ in repeats]
    yield "spheres, N = 50", "million particle steps/s", rates, ">= 30"
    if not quick and not on_device():
        yield from responses()


class OneScene:
    """Scenes of one filling with different particle numbers, timed one by one."""

    def __init__(self, filling, numbers, dt):
        table = SceneTable(list(numbers), 1, dt, FREQUENCY, BASE_AMPLITUDE)
        self.numbers, self.batch = list(numbers), Batch(filling, table)
        # Swinging fully, so that the particles fly.
        self.batch.start("empty")
        self.cycle = int(self.batch.steps_per_cycle[0])
        # Long enough to be shaken through, with all compiled.
        self.batch.advance(3 * self.cycle)

    def step_seconds(self, particles, at_least=0.2):
        """Seconds of a step of the scene with so many particles."""
        steps, seconds = self.cycle, 0.0
        while seconds <= at_least:
            steps *= 2
            plan = [steps * (number == particles) for number in self.numbers]
            seconds = seconds_of(self.batch.advance, plan)
        return seconds / steps


def responses():
    """Yield seconds of the automata's response figures on two threads, and half their CPU."""
    labels = ("ca_static", "ca_landing", "ca_ejection")
    found = in_new_process(__name__, "response_seconds", *labels, threads=2)
    wall, half = found[::2], [0.5 * cpu for cpu in found[1::2]]
    yield "response, static, two threads", "s of wall", wall[:1], "<= 60"
    yield "response, static, half its CPU", "s", half[:1], "<= 60"
    yield "response, all three, two threads", "s of wall", [sum(wall)], "<= 240"
    yield "response, all three, half their CPU", "s", [sum(half)], "<= 240"


def response_seconds(begun, *labels):
    """Wall and CPU seconds of the response figure of each filling, one list."""
    import damper_response as experiment

    numbers, seconds = experiment.FULL, []
    for label in labels:
        told, cpu = [], time.process_time()
        frequency_response(
            experiment.fillings()[label],
            particles=numbers["particles"],
            ratios=experiment.RATIOS,
            seeds=numbers["seeds"],
            transient_cycles=numbers["transient"],
            measured_cycles=numbers["measured"],
            progress=told.append,
        )
        seconds += [told[-1].seconds, time.process_time() - cpu]
    return seconds
