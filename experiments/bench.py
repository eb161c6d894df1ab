"""How fast is it? Rates of both packages, the papers' problems, and the first wait.

    make bench                          # about 25 minutes; writes results/bench.json
    python experiments/bench.py --quick # a minute

Figures are CPU time of one core unless they say otherwise, with --arch cuda time of the wall;
compile time apart. Median of repeats, and their spread.
"""

import json
import os
import sys
import time
from dataclasses import asdict
from statistics import median

import _bench_start
from _blast import METHODS, paper_scene
from _scaling_threads import ROUNDS, thread_gain, thread_job
from ca_damper import Automaton, Spheres, frequency_response
from damper_cost import cycle_seconds, scenes
from damper_response import FILLINGS, SETTINGS
from taichi_dem import Multirate, Simulation, Uniform, runtime
from taichi_dem.kit import study
from taichi_dem.kit.files import output_folder, write_text
from taichi_dem.kit.study import call_in_process, on_device
from taichi_dem.simulation import macro_steps

NAME = "bench"
#: Cells of the automaton's box; particles of the scenes, and the place of 50 in them.
CELLS, NUMBERS = 18 * 12, (1, 10, 20, 30, 40, 50, 60, 80, 100, 120)
SOME = NUMBERS.index(50)
#: Least million steps of a sphere a second that are wanted, by their number.
WANTED = {10: 120, 20: 120, 30: 120, 50: 90}
#: Boxes along the edges of a block, six tetrahedra each; steps that are timed together, how often.
SMALL, LARGE, LARGEST = (20, 10, 10), (40, 20, 20), (112, 39, 39)
STEPS, REPEATS = 4, 3


def options_parser():
    """Options of this script."""
    return study.parser(NAME, __doc__, out="results", threads=1, summary="bench.json")


def run(options):
    """Measure, print, write; the keys NAME_seconds of bench.json are medians."""
    folder = output_folder(options.out)
    results, rows, keys = [], [], {}
    for measure in PARTS:
        for name, unit, values, bound in measure(options.quick):
            middle = float(median(values))
            print(f"  {name}: {middle:.3g} {unit}", flush=True)
            results.append({"name": name, "unit": unit, "values": values, "bound": bound})
            spread = f"{min(values):.3g} .. {max(values):.3g}"
            rows.append((name, f"{middle:.3g}", spread, unit, bound))
            keys.update({name: middle} if name.endswith("_seconds") else {})
    study.print_table(rows, ["figure", "median", "spread", "unit", "bound"])
    place = {"processor": study.processor(), "versions": study.versions()}
    content = {"figures": results, **keys, **place, **asdict(runtime.settings())}
    path = os.path.join(folder, "bench.json")
    write_text(path, json.dumps(content, indent=1))
    print(f"written to {path}")


def damper(quick):
    """Yield the damper's cells and particles a second, and the time of the response figures."""
    repeats, least = (3, 0.05) if quick else (7, 0.2)
    scan = shaken(Automaton(traversal="scan"), 1e-4)
    listed, spheres = shaken(Automaton(), 1e-4), shaken(Spheres(), 2e-5)

    def rates(batch, count, scene=SOME):
        return [1e-6 * count / step_seconds(batch, scene, least) for _ in range(repeats)]

    yield "automaton, scan, N = 50", "million cells/s", rates(scan, CELLS), ">= 500"
    yield "automaton, list, N = 50", "million particle steps/s", rates(listed, 50), ">= 100"
    gains = [
        min(step_seconds(scan, k, least) / step_seconds(listed, k, least) for k in range(10))
        for _ in range(1 if quick else 3)
    ]
    yield "automaton, scan / list, least of N = 1 .. 120", "1", gains, "> 1"
    for number, least_rate in WANTED.items():
        found = rates(spheres, number, NUMBERS.index(number))
        yield f"spheres, N = {number}", "million particle steps/s", found, f">= {least_rate}"
    if not quick and not on_device():
        yield from responses()


def responses():
    """Yield the time of the response figure, by the wall and as half its CPU time."""
    labels = ("dem", "ca_static", "ca_landing", "ca_ejection")
    found = call_in_process(response_seconds, threads=2, labels=labels)
    wall, half = zip(*((wall, 0.5 * cpu) for wall, cpu in found))
    for k, (words, most) in enumerate((("spheres", 60), ("static", 12))):
        yield f"response, {words}, two threads", "s of wall", wall[k : k + 1], f"<= {most}"
        yield f"response, {words}, half its CPU", "s", half[k : k + 1], f"<= {most}"
    yield "response, all three, two threads", "s of wall", [sum(wall[1:])], "<= 240"
    yield "response, all three, half their CPU", "s", [sum(half[1:])], "<= 240"


def shaken(filling, dt):
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


def response_seconds(labels):
    """Wall and CPU seconds of the response figure of each filling."""
    full, seconds = {name: values[0] for name, values in SETTINGS.items()}, []
    job = {name: full[name] for name in ("particles", "ratios")}
    job.update(transient_cycles=full["transient"], measured_cycles=full["measured"])
    for label in labels:
        seeds = full["dem_seeds" if label == "dem" else "seeds"]
        told, cpu = [], time.process_time()
        frequency_response(FILLINGS[label], **job, seeds=seeds, progress=told.append)
        seconds.append((told[-1].seconds, time.process_time() - cpu))
    return seconds


def blast(quick):
    """Yield the blast's contact units a second, and the paper's problem by several methods."""
    yield "bonded phase", "million units/s", bonded_phase(3 if quick else 7), ">= 30"
    problem = "paper's problem to 0.1 ms" if quick else "paper's problem"
    repeats, until = (1, 1e-4) if quick else (3, 5e-4)
    found = {}
    for words, method, bound in (
        ("implicit", "implicit", "<= 0.9"),
        ("limited", "explicit_limited", "<= 5"),
        ("controlled", "multirate_controlled", "<= 8"),
        ("l = 1e-07 m", "paper_multirate", "<= 20"),
    ):
        make, step = METHODS[method]
        found[words], gain = paper_problem(make(step), repeats, until)
        yield f"{problem}, {words}", "s", found[words], "" if quick else bound
        if words == "controlled":
            yield "controlled, ideal gain", "1", [gain], ""
    if not quick:
        # One step for all of equal accuracy is that of the finest body in the controlled run.
        step = METHODS["multirate_controlled"][1] / 8.0
        uniform, _ = paper_problem(METHODS["explicit_limited"][0](step), repeats, until)
        gain = median(uniform) / median(found["controlled"])
        yield "controlled, realised gain", "1", [gain], ">= 3"
        slowest, _ = paper_problem(Multirate(1e-8, 1e-8), 1, until)
        yield f"{problem}, l = 1e-08 m", "s", slowest, "<= 130"


def bonded_phase(repeats, steps=4000):
    """Million contact units a second while all bonds hold: whole steps, bodies included."""
    simulation = Simulation(paper_scene(), Uniform(1e-9))
    simulation.advance_to(steps)
    units = 3e-6 * simulation.model.bond_count * steps
    ends = [(k + 2) * steps for k in range(repeats)]
    return [units / study.seconds_of(simulation.advance_to, end) for end in ends]


def paper_problem(method, repeats, until):
    """Seconds of runs of the paper's problem by a method, without compiling; its ideal gain."""
    seconds = []
    for _ in range(repeats):
        simulation = Simulation(paper_scene(), method)
        simulation.advance_to(macro_steps(until, method.dt0))
        report = simulation.report()
        seconds.append(report.run_seconds if on_device() else report.run_cpu_seconds)
    return seconds, report.ideal_gain


def block(quick):
    """Yield a large block's steps a second, gain of a second thread, share of the bandwidth."""
    if quick:
        yield from of_method("explicit_limited", SMALL, 1)
        return
    for cells in (LARGE, LARGEST) if on_device() else (LARGE,):
        for method in METHODS:
            yield from of_method(method, cells, ROUNDS)


def of_method(method, cells, rounds):
    """Yield steps a second by a method, on one thread and on two or on the device."""
    if on_device():
        found = thread_job("", cells, method, 1, STEPS, REPEATS)
    else:
        found = thread_gain("", cells, method, STEPS, rounds, REPEATS)
    title = f"block of {found['bodies']}, {method}"
    if "gain" in found:
        yield f"{title}, two threads over one", "1", [found["gain"]], ">= 1.7"
    yield title, "steps/s", [1.0 / s for s in found["seconds"]], ""
    if method == "explicit_limited":
        # There a step moves every body, once.
        share = [found["bytes"] / s / found["bandwidth"] for s in found["seconds"]]
        yield f"{title}, share of the memory's bandwidth", "1", share, ""


#: Functions that yield figures, as name, unit, values, bound; quick: fewer of them, shorter jobs.
PARTS = (damper, _bench_start.measure, blast, block)


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
