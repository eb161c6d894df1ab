"""Speed of the damper: cells and particles a second, and the figure of the response."""

import time

from _bench_figure import Figure, by_turns
from ca_damper import Automaton, Spheres, frequency_response
from damper_cost import cycle_seconds, scenes
from damper_response import FILLINGS, SETTINGS
from taichi_dem.kit.study import call_in_process, on_device
from taichi_dem.kit.study.floors import Work

#: Cells of the automaton's box; particles of the scenes, and the place of 50 in them.
CELLS, NUMBERS = 18 * 12, (1, 10, 20, 30, 40, 50, 60, 80, 100, 120)
SOME = NUMBERS.index(50)
#: Least million steps of a sphere a second that are wanted, by their number.
WANTED = {10: 120, 20: 120, 30: 120, 50: 90}
#: A step of the scan takes of every cell the kind of its content, a byte, and reads and writes
#: speed and way, 4 x 8 bytes; gravity and the flight are a product and a sum each.
CELL = Work(bytes=33, flops=4)
#: A step of the list takes of every particle its cell, 2 bytes, the kind of its content and of the
#: cell ahead, and reads and writes speed and way.
PARTICLE = Work(bytes=36, flops=4)
#: A step of a sphere reads and writes two components of position and velocity, 8 x 8 bytes. Each
#: is a product and a sum; four walls are as many differences. Its neighbours are left out.
SPHERE = Work(bytes=64, flops=12)
#: Fillings of the figure of the response, and the share of its frequencies that is run.
RESPONSES, EVERY = ("dem", "ca_static", "ca_landing", "ca_ejection"), 8


def measure(quick):
    """Yield the damper's cells and particles a second, and the time of the response figures."""
    repeats, least = (3, 0.03) if quick else (7, 0.06)
    scan = shaken(Automaton(rules="paper", traversal="scan"), 1e-4)
    listed, spheres = shaken(Automaton(rules="paper"), 1e-4), shaken(Spheres(), 2e-5)

    def rate(batch, count, scene=SOME):
        return lambda: 1e-6 * count / step_seconds(batch, scene, least)

    works = {"scan": (rate(scan, CELLS), repeats), "list": (rate(listed, 50), repeats)}
    for number in WANTED:
        works[number] = rate(spheres, number, NUMBERS.index(number)), repeats
    found = by_turns(works)
    name = "automaton, scan, N = 50"
    yield Figure(name, "million cells/s", found["scan"], ">= 500", CELL)
    name = "automaton, list, N = 50"
    yield Figure(name, "million particle steps/s", found["list"], ">= 100", PARTICLE)
    gains = [least_gain(scan, listed, least) for _ in range(1 if quick else 2)]
    yield Figure("automaton, scan / list, least of N = 1 .. 120", "1", gains, "> 1")
    for number, wanted in WANTED.items():
        name, bound = f"spheres, N = {number}", f">= {wanted}"
        yield Figure(name, "million particle steps/s", found[number], bound, SPHERE)
    if not quick and not on_device():
        yield from responses()


def shaken(filling, dt):
    """Scenes with all numbers of particles, long enough shaken through, with all compiled."""
    batch = scenes(filling, list(NUMBERS), dt)
    batch.advance(3 * batch.steps_per_cycle)
    return batch


def step_seconds(batch, scene, least):
    """Seconds of a step of one scene, from a run of at least some seconds."""
    cycles, seconds = 1, 0.0
    while seconds <= least:
        cycles *= 2
        seconds = cycle_seconds(batch, scene, cycles)
    return seconds / (cycles * int(batch.steps_per_cycle[scene]))


def least_gain(scan, listed, least):
    """Least time of the scan over that of the list, of all numbers of particles [1]."""
    scenes_of = range(len(NUMBERS))
    return min(step_seconds(scan, k, least) / step_seconds(listed, k, least) for k in scenes_of)


def responses():
    """Yield the time of the response figure, by the wall and as half its CPU time.

    It is measured at every eighth of its frequencies, and multiplied by all over those.
    """
    found = call_in_process(response_seconds, threads=2, labels=RESPONSES)
    wall, half, steps = zip(*((one["wall"], 0.5 * one["cpu"], one["steps"]) for one in found))
    works = (SPHERE * steps[0], PARTICLE * steps[1], PARTICLE * sum(steps[1:]))
    parts = (("spheres", 60, slice(0, 1)), ("static", 12, slice(1, 2)))
    parts += (("all three", 240, slice(1, None)),)
    for (words, most, part), work in zip(parts, works):
        title = f"response, {words}, from every eighth frequency"
        yield Figure(f"{title}, two threads", "s of wall", [sum(wall[part])], f"<= {most}")
        yield Figure(f"{title}, half its CPU", "s", [sum(half[part])], f"<= {most}", work * 0.5)


def response_seconds(labels):
    """Wall and CPU seconds of the response figure of each filling, and its steps of particles."""
    full, found = {name: values[0] for name, values in SETTINGS.items()}, []
    ratios = full["ratios"][::EVERY]
    scale = len(full["ratios"]) / len(ratios)
    job = {"particles": full["particles"], "ratios": ratios, "progress": None}
    job.update(transient_cycles=full["transient"], measured_cycles=full["measured"])
    for label in labels:
        seeds = full["dem_seeds" if label == "dem" else "seeds"]
        cpu = time.process_time()
        report = frequency_response(FILLINGS[label], **job, seeds=seeds).report
        cpu = time.process_time() - cpu - report.compile_seconds
        one = {"wall": report.run_seconds, "cpu": cpu, "steps": report.particle_steps}
        found.append({name: scale * value for name, value in one.items()})
    return found
