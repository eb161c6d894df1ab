"""Figures of the bench: the damper and the paper's blast."""

import time
from collections.abc import Sequence
from statistics import median
from types import SimpleNamespace
from typing import NamedTuple

import taichi as ti

from _blast import METHODS, paper_scene
from _threads import VISIT, bytes_a_step, work_since
from ca_damper import Automaton, Spheres, frequency_response
from damper_cost import cycle_seconds, scenes
from damper_response import FILLINGS, SETTINGS
from taichi_dem import ImplicitDashpots, Multirate, Simulation, Uniform, simulate
from taichi_dem.kit.study import call_in_process, on_device, seconds_of
from taichi_dem.kit.study.floors import Work
from taichi_dem.observers import macro_steps
from taichi_dem.step.implicit.bonds import BOND_COLOURS

#: Units of times [s]; of all others more is better.
TIMES = {"s": 1.0, "s of wall": 1.0, "ms": 1e-3, "ns": 1e-9}
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
RESPONSES, EVERY = ("dem", "ca_static", "ca_landing", "ca_place"), 8
#: Ends of the short and of the whole run [s].
SHORT, WHOLE = 1e-4, 5e-4
#: Step and displacement limit of the paper, end of its run here [s], and the evaluations of bonds
#: and pairs that this method makes to the end of the whole run, counted in one.
FINEST, EARLY, EVALUATIONS = (1e-8, 1e-8), 1e-4, 1_278_384_011
#: Step that 1 % allows in the short run [s]; step [s] and sweeps of what it is compared with.
ROUGH, EXACT = 8e-7, (2.5e-8, (6, 40))
#: Step of the bonded phase [s], and its steps that are timed together.
BONDED, STEPS = 1e-9, 4000
#: Visits of all bonds in a call.
SWEEPS = 500
#: By the words of a figure: method, runs in the full bench, bound of a whole run.
RUNS = {
    "implicit": ("implicit", 5, "<= 0.45"),
    "limited": ("explicit_limited", 1, "<= 5"),
    "controlled": ("multirate_controlled", 2, "<= 8"),
    "l = 1e-07 m": ("paper_multirate", 1, "<= 14"),
}


class Figure(NamedTuple):
    """Repeated measurements of one quantity.

    values: in a unit. bound: what is wanted, in words. work: least work of what takes the time, or
    of one of those that are counted; None where nothing bounds it.
    """

    name: str
    unit: str
    values: Sequence[float]
    bound: str = ""
    work: Work | None = None

    @property
    def middle(self):
        """Median of the values."""
        return float(median(self.values))

    @property
    def is_time(self):
        """Whether less is better."""
        return self.unit in TIMES

    def share(self, floors):
        """Least time of the work over the time it took [1]; floors: rates by name. None without."""
        if self.work is None or not floors:
            return None
        least = self.work.seconds(floors)
        if self.is_time:
            return least / (TIMES[self.unit] * self.middle)
        return least * self.middle * (1e6 if self.unit.startswith("million") else 1.0)


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
    """Yield the damper's cells and particles a second, and the time of the response figures."""
    repeats, least = (3, 0.03) if quick else (7, 0.06)
    scan = shaken(Automaton(rules="paper", traversal="scan"), 1e-4)
    listed, spheres = shaken(Automaton(rules="paper"), 1e-4), shaken(Spheres(), 2e-5)

    def rate(batch, count, scene=SOME):
        return lambda: 1e-6 * count / step_seconds(batch, scene, least)

    works = {"scan": (rate(scan, CELLS), repeats), "list": (rate(listed, 50), repeats)}
    works["place"] = rate(shaken(Automaton(), 1e-4), 50), repeats
    for number in WANTED:
        works[number] = rate(spheres, number, NUMBERS.index(number)), repeats
    found = by_turns(works)
    name = "automaton, scan, N = 50"
    yield Figure(name, "million cells/s", found["scan"], ">= 500", CELL)
    name = "automaton, list, N = 50"
    yield Figure(name, "million particle steps/s", found["list"], ">= 100", PARTICLE)
    name = "automaton, rules of place, N = 50"
    yield Figure(name, "million particle steps/s", found["place"], ">= 80", PARTICLE)
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


def blast(quick):
    """Yield the blast's contact units a second, and the paper's problem by several methods."""
    yield from bonded_phase(3 if quick else 7)
    yield from visits(3 if quick else 7)
    yield from short_runs(quick)
    if not quick:
        yield from whole_runs()


def driver():
    """The driver of one core, where there is a core."""
    return "auto" if on_device() else "resident"


def bonded_phase(repeats):
    """Yield million contact units a second while all bonds hold: whole steps with the bodies."""
    simulation = Simulation(paper_scene(), Uniform(BONDED), driver())
    simulation.advance_to(STEPS)
    bonds = simulation.model.bond_count
    moved = [size / bonds for size in bytes_a_step(simulation.engine)]
    for words, size, bound in zip(("read", "written"), moved, ("<= 260", "<= 100")):
        yield Figure(f"bonded phase, bytes {words} for a bond, with its bodies", "B", [size], bound)
    # Three units a bond.
    work = Work(sum(moved) / 3)
    ends = [(k + 2) * STEPS for k in range(repeats)]
    seconds = [seconds_of(simulation.advance_to, end) for end in ends]
    values = [3e-6 * bonds * STEPS / one for one in seconds]
    yield Figure("bonded phase", "million units/s", values, ">= 60", work)


def visits(repeats):
    """Yield the time of a visit of an intact bond in a sweep, after a run to 0.1 ms."""
    if on_device():
        return
    method = METHODS["implicit"][0](METHODS["implicit"][1])
    simulation = Simulation(paper_scene(), method, driver())
    simulation.advance_to(macro_steps(SHORT, method.dt0))
    # A broken bond is no visit, although its place is looked at.
    broken = simulation.state.broken()
    count, solver = SWEEPS * int((~broken).sum()), simulation.engine.step.solver
    sweep_bonds(solver, 1)
    seconds = [seconds_of(sweep_bonds, solver, SWEEPS) for _ in range(repeats)]
    yield Figure("visit of a bond", "ns", [1e9 * one / count for one in seconds], "<= 14", VISIT)


@ti.kernel
def sweep_bonds(solver: ti.template(), times: ti.i32):
    """Visit all bonds one after the other, in their order, several times."""
    ti.loop_config(serialize=True)
    for _ in range(times):
        for g in range(solver.bonds.colour_first[BOND_COLOURS]):
            solver.bonds.visit(g)


def short_runs(quick):
    """Yield the time of runs to 0.1 ms, in the quick bench of a second method too.

    A step of ``ROUGH`` is what an error of 1 % allows there; the error is measured.
    """
    repeats = 3 if quick else 5
    rough = f"implicit, {1e6 * ROUGH:g} us"
    works = {
        "implicit": run_of("implicit", SHORT, repeats),
        rough: run_of("implicit", SHORT, repeats, ROUGH),
    }
    if quick:
        works["limited"] = run_of("explicit_limited", SHORT, 1)
    for words, runs in by_turns(works).items():
        bound = "<= 0.06" if words == rough else ""
        yield timed(f"paper's problem to 0.1 ms, {words}", runs, bound)
    if not quick:
        error = abs(hole_at(SHORT, ROUGH) / hole_at(SHORT, EXACT[0], sweeps=EXACT[1]) - 1.0)
        yield Figure(f"error at 0.1 ms, {rough}", "%", [100.0 * error], "<= 1")


def hole_at(until, step, **sweeping):
    """Displacement of the hole at a time [mm], with solved dashpots."""
    method = ImplicitDashpots(step, **sweeping)
    result = simulate(paper_scene(), method=method, until=until, progress=None)
    return float(result.series["hole_radial_displacement_mm"][-1])


def whole_runs():
    """Yield the time of whole runs, and what different steps save over one step for all."""
    works = {words: run_of(name, WHOLE, repeats) for words, (name, repeats, _) in RUNS.items()}
    # One step for all of equal accuracy is that of the finest body in the controlled run.
    step = METHODS["multirate_controlled"][1] / 8.0
    works["uniform"] = run_of("explicit_limited", WHOLE, 1, step)
    works["finest"] = lambda: paper_run(Multirate(*FINEST), EARLY), 1
    found = by_turns(works)
    uniform, finest = found.pop("uniform"), found.pop("finest")
    for words, runs in found.items():
        yield timed(f"paper's problem, {words}", runs, RUNS[words][2])
    controlled = found["controlled"]
    gain = median(one.seconds for one in uniform) / median(one.seconds for one in controlled)
    yield Figure("controlled, realised gain", "1", [gain])
    ideals = {"ideal gain": controlled[0].gain, "gain in evaluations": controlled[0].fewer}
    for words, ideal in ideals.items():
        yield Figure(f"controlled, {words}", "1", [ideal])
        yield Figure(f"controlled, realised over {words}", "1", [gain / ideal], ">= 0.9")
    yield from finest_run(finest)


def finest_run(runs):
    """Yield the time of early runs by the paper's own displacement limit, and what it foretells.

    Evaluations of bonds and pairs cost alike early and late: the whole run takes as many times
    longer as it evaluates more.
    """
    words = "l = 1e-08 m"
    yield timed(f"paper's problem to {1e3 * EARLY:g} ms, {words}", runs)
    values = [one.seconds * EVALUATIONS / one.evaluations for one in runs]
    work = runs[0].work * (EVALUATIONS / runs[0].evaluations)
    yield Figure(f"paper's problem, {words}, extrapolated", "s", values, "<= 95", work)


def run_of(name, until, repeats, step=None):
    """A function that runs a method to a time [s], and how often it is called."""
    make, usual = METHODS[name]
    return lambda: paper_run(make(step or usual), until), repeats


def paper_run(method, until):
    """Seconds of a run of the paper's problem without compiling, its least work, and what it saves.

    gain: of bodies advanced; fewer: of bonds and pairs, which step as the finer of two bodies.
    """
    simulation = Simulation(paper_scene(), method, driver())
    simulation.advance_to(macro_steps(until, method.dt0))
    report = simulation.report()
    seconds = report.run_seconds if on_device() else report.run_cpu_seconds
    made = {"seconds": seconds, "gain": report.ideal_gain, "fewer": report.boundary_gain}
    counted = {"work": work_since(simulation), "evaluations": simulation.evaluations()}
    return SimpleNamespace(**made, **counted)


def timed(name, runs, bound=""):
    """Figure of the seconds of runs."""
    return Figure(name, "s", [one.seconds for one in runs], bound, runs[0].work)
