"""The damper's figures: cells and particles a second, and the response figures."""

import time

from _bench_start import in_new_process
from ca_damper import Automaton, Spheres, frequency_response
from damper_cost import cycle_seconds, scenes
from taichi_dem.kit.study import on_device

CELLS = 18 * 12
NUMBERS = (1, 10, 20, 30, 40, 50, 60, 80, 100, 120)
SOME = NUMBERS.index(50)


def measure(quick):
    """Yield the figures of the damper: name, unit, values, bound."""
    repeats, least = (3, 0.05) if quick else (7, 0.2)
    scan = started(Automaton(traversal="scan"), 1e-4)
    rates = [1e-6 * CELLS / step_seconds(scan, SOME) for _ in range(repeats)]
    yield "automaton, scan, N = 50", "million cells/s", rates, ">= 200"
    listed = started(Automaton(), 1e-4)
    rates = [50e-6 / step_seconds(listed, SOME) for _ in range(repeats)]
    yield "automaton, list, N = 50", "million particle steps/s", rates, ">= 100"
    gains = [
        min(step_seconds(scan, k, least) / step_seconds(listed, k, least) for k in range(10))
        for _ in range(1 if quick else 3)
    ]
    yield "automaton, scan / list, least of N = 1 .. 120", "1", gains, "> 1"
    spheres = started(Spheres(), 2e-5)
    rates = [50e-6 / step_seconds(spheres, SOME) for _ in range(repeats)]
    yield "spheres, N = 50", "million particle steps/s", rates, ">= 30"
    if not quick and not on_device():
        yield from responses()


def started(filling, dt):
    """Scenes with all numbers of particles, long enough shaken through, with all compiled."""
    batch = scenes(filling, list(NUMBERS), dt)
    batch.advance(3 * batch.steps_per_cycle)
    return batch


def step_seconds(batch, scene, least=0.2):
    """Seconds of a step of one scene, from a run of at least some seconds."""
    cycles, seconds = 1, 0.0
    while seconds <= least:
        cycles *= 2
        seconds = cycle_seconds(batch, scene, cycles)
    return seconds / (cycles * int(batch.steps_per_cycle[scene]))


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
