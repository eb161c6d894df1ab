"""Cost of a cycle against the number of particles, and the steps that fillings bear (Fig. 12).

    python experiments/damper_cost.py          # about a minute
    python experiments/damper_cost.py --quick

Spheres by comparing all pairs, as in the paper, and by cells, at 2e-5 s; the automaton by a scan of
all cells, as in the paper, and by a list of particles, at the paper's 1e-4 s and at the spheres'
2e-5 s. CPU seconds of one core for one cycle of 6 Hz on the spring, median of repeats, compile time
apart. Then every filling is run at longer and longer steps until it refuses or diverges.
"""

import os
import sys
import time

import numpy as np

from ca_damper import Automaton, Batch, SceneTable, SimulationDiverged, Spheres
from taichi_dem import InputError
from taichi_dem.kit.files import output_folder
from taichi_dem.kit.plot_style import BLACK, STYLES, picture, styles_of
from taichi_dem.kit.progress.progress_bar import ProgressBar
from taichi_dem.kit.study import (
    Timing,
    figure,
    finish,
    main,
    parser,
    print_table,
    seconds_of,
    several,
    take_defaults,
    whole,
    write_rows,
)

NAME = "damper_cost"
FREQUENCY, BASE_AMPLITUDE = 6.0, 0.6e-3
#: Particles in the search for the longest step.
SOME = 50
#: Steps tried for stability [s].
STEPS = (1e-5, 2e-5, 3e-5, 5e-5, 7e-5, 1e-4, 2e-4, 3e-4, 5e-4, 7e-4, 1e-3, 1.5e-3, 2e-3, 3e-3)
FULL = {
    "particles": [1, 2, 5, 10, 20, 30, 40, 50, 60, 80, 100, 120, 140, 160],
    "repeats": 5,
    "seconds": 0.05,
    "cycles": 20,
    "steps": STEPS,
}
QUICK = {
    "particles": [1, 10, 50, 160],
    "repeats": 3,
    "seconds": 0.01,
    "cycles": 3,
    "steps": (2e-5, 1e-4, 1e-3, 2e-3),
}
PAIRS, SCAN = Spheres(search="all_pairs"), Automaton(traversal="scan")
#: Label: filling, step [s], search or traversal with the step, marker, line. The paper's way is
#: dashed, markers tell the automaton's steps apart.
VARIANTS = {
    "dem_pairs": (PAIRS, 2e-5, "all pairs, 20 µs", "^", "--"),
    "dem_cells": (Spheres(), 2e-5, "cells, 20 µs", "^", "-"),
    "ca_scan_1e-4": (SCAN, 1e-4, "scan, 100 µs", "o", "--"),
    "ca_list_1e-4": (Automaton(), 1e-4, "list, 100 µs", "o", "-"),
    "ca_scan_2e-5": (SCAN, 2e-5, "scan, 20 µs", "s", "--"),
    "ca_list_2e-5": (Automaton(), 2e-5, "list, 20 µs", "s", "-"),
}
#: Outcome of a run: words and marker.
OUTCOMES = {
    "runs": ("runs", "o"),
    "diverges": ("diverges", "X"),
    "refused": ("refused before the first step", "|"),
}


def options_parser():
    """Options of this experiment; times are of one thread."""
    made = parser(NAME, __doc__)
    made.set_defaults(threads=1)
    made.add_argument("--particles", type=several(whole(1, 160)), help="numbers, 1 to 160")
    made.add_argument("--repeats", type=whole(1, 1000), help="of every timing, 5")
    return made


def run(options):
    """Time all variants, find their longest steps, write tables and pictures."""
    take_defaults(options, FULL, QUICK)
    folder = output_folder(options.out)
    started = time.perf_counter()
    with ProgressBar("timing") as bar:
        costs = time_all(options, bar)
    fillings = (Spheres(), Automaton(), Automaton(accounting="landing"))
    borne = {one.label: outcomes(one, options.steps, options.cycles) for one in fillings}
    write_tables(costs, borne, options)
    picture_cost(os.path.join(folder, "cost.png"), options.particles, costs)
    picture_steps(os.path.join(folder, "steps.png"), borne)
    seconds = time.perf_counter() - started
    compiling = sum(cost["compile_s"] for cost in costs.values())
    print_costs(costs, options.particles)
    finish(options, NAME, figures_of(costs, borne, options), (compiling, seconds - compiling))


def time_all(options, bar):
    """CPU seconds a cycle: {label: {"timings": a Timing for each N, "steps", "compile_s"}}."""
    costs, numbers = {}, options.particles
    for label, (filling, dt, *_) in VARIANTS.items():
        batch = scenes(filling, numbers, dt)
        steps = int(batch.steps_per_cycle[0])
        batch.advance(steps)
        timings = []
        for k in range(len(numbers)):
            timings.append(time_cycle(batch, k, options))
            bar.count(len(costs) * len(numbers) + k + 1, len(VARIANTS) * len(numbers))
        costs[label] = {"timings": timings, "steps": steps, "compile_s": batch.compile_seconds}
    return costs


def scenes(filling, particles, dt):
    """A batch of scenes near resonance, started; particles or dt may be several."""
    batch = Batch(filling, SceneTable(particles, 1, dt, FREQUENCY, BASE_AMPLITUDE))
    # Swinging fully from the first cycle, so that the particles fly from then on.
    batch.start("empty")
    return batch


def cycle_seconds(batch, scene, cycles):
    """CPU time of some cycles of one scene [s]; the others stand."""
    steps = [0] * batch.count
    steps[scene] = cycles * int(batch.steps_per_cycle[scene])
    return seconds_of(batch.advance, steps)


def time_cycle(batch, scene, options):
    """Timing of a cycle of a scene in CPU seconds; at a time as many as fill a moment."""
    cycles = 1 + int(options.seconds / max(cycle_seconds(batch, scene, 1), 1e-6))
    return Timing.of([cycle_seconds(batch, scene, cycles) / cycles for _ in range(options.repeats)])


def outcomes(filling, steps, cycles):
    """Outcome of a run of 50 particles at every step: (dt, "runs" | "diverges" | "refused")."""
    allowed, found = [], []
    for dt in steps:
        try:
            filling.check(SOME, dt)
            allowed.append(dt)
        except InputError:
            found.append((dt, "refused"))
    while allowed:
        # A batch that holds a diverged scene goes no further: the rest gets one of its own.
        batch = scenes(filling, SOME, allowed)
        for k in range(batch.count):
            dt = allowed.pop(0)
            try:
                cycle_seconds(batch, k, cycles)
                found.append((dt, "runs"))
            except SimulationDiverged:
                found.append((dt, "diverges"))
                break
    return sorted(found)


def write_tables(costs, borne, options):
    """CSV of all timings, and of the steps tried."""
    timed = [
        (label, particles, cost["steps"], timing.median, timing.low, timing.high)
        for label, cost in costs.items()
        for particles, timing in zip(options.particles, cost["timings"])
    ]
    names = "variant particles steps cpu_s low_s high_s"
    write_rows(os.path.join(options.out, "cost.csv"), timed, names)
    tried = [(label, dt, word) for label, found in borne.items() for dt, word in found]
    write_rows(os.path.join(options.out, "steps.csv"), tried, "filling dt_s outcome")


def figures_of(costs, borne, options):
    """Seconds a cycle at 50 particles, rates, growth from fewest to most, longest steps."""
    figures = {}
    some = min(options.particles, key=lambda n: abs(n - SOME))
    place = options.particles.index(some)
    for label, cost in costs.items():
        seconds = [timing.median for timing in cost["timings"]]
        figures[f"cycle_ms_{label}_N{some}"] = figure(1e3 * seconds[place], "ms")
        rate = 1e-6 * some * cost["steps"] / seconds[place]
        figures[f"particle_steps_{label}_N{some}"] = figure(rate, "million/s")
        figures[f"growth_{label}"] = figure(seconds[-1] / seconds[0], "1")
    for label, found in borne.items():
        running = [dt for dt, word in found if word == "runs"]
        figures[f"longest_step_{label}"] = figure(max(running, default=None), "s")
    return figures


def print_costs(costs, particles):
    """Print the milliseconds a cycle."""
    timings = zip(*(cost["timings"] for cost in costs.values()))
    rows = [(n, *(f"{1e3 * t.median:.3g}" for t in row)) for n, row in zip(particles, timings)]
    print("CPU milliseconds a cycle")
    print_table(rows, ["N", *costs])
    print()


def picture_cost(path, particles, costs):
    """CPU time of a cycle over the number of particles, linear and logarithmic."""
    with picture(path, 1, 2, (10.0, 5.0)) as (figure, axes):
        for label, cost in costs.items():
            filling, _, words, mark, line = VARIANTS[label]
            style = STYLES[filling.label]
            look = {"color": style.colour, "marker": mark, "ms": 4, "ls": line, "lw": 1.2}
            low, middle, high = (
                [1e3 * getattr(timing, name) for timing in cost["timings"]]
                for name in ("low", "median", "high")
            )
            bars = [np.subtract(middle, low), np.subtract(high, middle)]
            for axis in axes:
                axis.errorbar(particles, middle, bars, label=f"{style.label}, {words}", **look)
        axes[0].set(title="bars: range of the repeats", ylim=(0, None))
        axes[1].set(title="the same, logarithmic", yscale="log")
        for axis in axes:
            axis.set(xlabel="particles N [1]", ylabel="CPU time of a cycle [ms]")
        handles, labels = axes[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper left", ncols=3)


def picture_steps(path, borne):
    """Outcome of a run at each step: a row a filling. borne: {name: [(dt [s], outcome)]}."""
    styles = styles_of(borne)
    with picture(path, 1, 1, (7.0, 1.2 + 0.5 * len(borne))) as (_, axis):
        for word, (words, mark) in OUTCOMES.items():
            axis.plot([], [], mark, color=BLACK, label=words, ms=7)
            for row, (name, found) in enumerate(borne.items()):
                steps = [1e6 * dt for dt, outcome in found if outcome == word]
                axis.plot(steps, [row] * len(steps), mark, color=styles[name].colour, ms=7)
        axis.set(xscale="log", xlabel="step [µs]", ylim=(-0.6, len(borne) - 0.4))
        axis.set_yticks(range(len(borne)), [style.label for style in styles.values()])
        axis.legend(ncols=3, loc="lower center", bbox_to_anchor=(0.5, 1.0))


if __name__ == "__main__":
    sys.exit(main(run, options_parser()))
