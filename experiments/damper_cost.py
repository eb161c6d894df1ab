"""Cost of a cycle over the number of particles, and the stable steps of fillings (Fig. 12).

    python experiments/damper_cost.py
    python experiments/damper_cost.py --quick

Spheres run with all pairs, as in the paper, and with cells, at 2e-5 s. The automaton runs with a
scan of all cells, as in the paper, and with a list of particles, at the paper's 1e-4 s and at the
spheres' 2e-5 s. Times are CPU seconds of one core for a cycle of 6 Hz on the spring, median of
repeats, without compiling. Then every filling is run at longer and longer steps until it refuses or
diverges. A quick run leaves out variants that need further programs, such as all pairs.
"""

import sys
from dataclasses import replace
from functools import partial
from statistics import median

import pandas as pd

import ca_damper
from ca_damper import Automaton, Batch, InputError, Paper, SceneTable, Spheres
from taichi_dem.kit import study
from taichi_dem.kit.plot_style import BLACK, STYLES, picture, styles_of
from taichi_dem.kit.study import several, whole

NAME = "damper_cost"
FREQUENCY, BASE_AMPLITUDE = 6.0, 0.6e-3
#: Particles in the search for the longest step.
SOME = 50
NUMBERS = [1, 2, 5, 10, 20, 30, 40, 50, 60, 80, 100, 120, 140, 160]
#: Steps tried for stability [s].
STEPS = (1e-5, 2e-5, 3e-5, 5e-5, 7e-5, 1e-4, 2e-4, 3e-4, 5e-4, 7e-4, 1e-3, 1.5e-3, 2e-3, 3e-3)
PAIRS, PAPER = Spheres(search="all_pairs"), Automaton(rules=Paper())
SCAN = replace(PAPER, traversal="scan")
#: Label: filling, step [s], search or traversal with the step, marker, line. The paper's way is
#: dashed, markers tell the automaton's steps apart.
VARIANTS = {
    "dem_pairs": (PAIRS, 2e-5, "all pairs, 20 µs", "^", "--"),
    "dem_cells": (Spheres(), 2e-5, "cells, 20 µs", "^", "-"),
    "ca_scan_1e-4": (SCAN, 1e-4, "scan, 100 µs", "o", "--"),
    "ca_list_1e-4": (PAPER, 1e-4, "list, 100 µs", "o", "-"),
    "ca_scan_2e-5": (SCAN, 2e-5, "scan, 20 µs", "s", "--"),
    "ca_list_2e-5": (PAPER, 2e-5, "list, 20 µs", "s", "-"),
}
SETTINGS = {
    "particles": (NUMBERS, [1, 10, 50, 160], several(whole(1, 160)), "default from 1 to 160"),
    "repeats": (5, 3, whole(1, 1000), "repeats of every timing, default 5"),
    "seconds": (0.05, 0.01),
    "cycles": (20, 3),
    # Those of a quick run need the fewest programs.
    "variants": (tuple(VARIANTS), ("dem_cells", "ca_scan_1e-4", "ca_list_1e-4", "ca_list_2e-5")),
    # Of the automaton in the search for the longest step.
    "accountings": (("all", "landing"), ("all",)),
    "steps": (STEPS, (2e-5, 1e-4, 1e-3, 2e-3)),
}
#: Marker of each outcome of a run.
OUTCOMES = {"runs": "o", "diverges": "X", "refused": "|"}
#: Times are of one thread.
options_parser = partial(study.parser, NAME, __doc__, settings=SETTINGS, threads=1)


def cost_of(label, options):
    """CPU seconds a cycle of a variant, a row for each number of particles; those of compiling."""
    filling, dt, *_ = VARIANTS[label]
    batch, rows = scenes(filling, options.particles, dt), []
    steps = int(batch.steps_per_cycle[0])
    batch.advance(steps)
    for k, particles in enumerate(options.particles):
        # At a time as many cycles as fill a moment.
        cycles = 1 + int(options.seconds / max(cycle_seconds(batch, k, 1), 1e-6))
        repeats = [cycle_seconds(batch, k, cycles) / cycles for _ in range(options.repeats)]
        row = {"variant": label, "particles": particles, "steps": steps, "cpu_s": median(repeats)}
        rows.append({**row, "low_s": min(repeats), "high_s": max(repeats)})
    return rows, batch.compile_seconds


def scenes(filling, particles, dt):
    """A batch of scenes near resonance, started; particles may be several."""
    batch = Batch(filling, SceneTable(particles, 1, dt, FREQUENCY, BASE_AMPLITUDE))
    # Swinging fully from the first cycle, so that the particles fly from then on.
    batch.start("empty")
    return batch


def cycle_seconds(batch, scene, cycles):
    """CPU time of some cycles of one scene [s]; the others stand."""
    steps = [0] * batch.count
    steps[scene] = cycles * int(batch.steps_per_cycle[scene])
    return study.seconds_of(batch.advance, steps)


def outcome(filling, dt, cycles):
    """How a run of 50 particles at a step [s] ends, one of OUTCOMES."""
    try:
        filling.check(SOME, dt)
        cycle_seconds(scenes(filling, SOME, dt), 0, cycles)
    except (InputError, ca_damper.SimulationDiverged) as error:
        return "refused" if isinstance(error, InputError) else "diverges"
    return "runs"


def picture_cost(path, costs):
    """CPU time of a cycle over the number of particles, linear and logarithmic."""
    with picture(path, 1, 2, (9.2, 5.2)) as (figure, axes):
        for label, rows in costs.groupby("variant", sort=False):
            filling, _, words, mark, line = VARIANTS[label]
            style, middle = STYLES[filling.label], 1e3 * rows.cpu_s
            look = {"color": style.colour, "marker": mark, "ms": 4, "ls": line, "lw": 1.2}
            bars = middle - 1e3 * rows.low_s, 1e3 * rows.high_s - middle
            for axis in axes:
                words_of = {"label": f"{style.label}, {words}", **look}
                axis.errorbar(rows.particles, middle, bars, **words_of)
        axes[0].set(title="bars: range of the repeats", ylim=(0, None))
        axes[1].set(title="the same, logarithmic", yscale="log")
        for axis in axes:
            axis.set(xlabel="particles N [1]", ylabel="CPU time of a cycle [ms]")
        figure.legend(*axes[0].get_legend_handles_labels(), loc="outside upper left", ncols=3)


def picture_steps(path, borne):
    """Outcome of a run at each step: a row a filling."""
    names = [*borne.filling.unique()]
    styles = styles_of(names)
    with picture(path, 1, 1, (7.0, 1.2 + 0.5 * len(names))) as (_, axis):
        for word, mark in OUTCOMES.items():
            label = word.replace("refused", "refused before the first step")
            axis.plot([], [], mark, color=BLACK, label=label, ms=7)
        for filling, dt, word in borne.itertuples(index=False):
            look = {"color": styles[filling].colour, "ms": 7}
            axis.plot(1e6 * dt, names.index(filling), OUTCOMES[word], **look)
        axis.set(xscale="log", xlabel="step [µs]", ylim=(-0.6, len(names) - 0.4))
        axis.set_yticks(range(len(names)), [style.label for style in styles.values()])
        axis.legend(ncols=3, loc="lower center", bbox_to_anchor=(0.5, 1.0))


def run(options):
    """Time all variants, find their longest steps, write tables and pictures."""
    folder, rows, compiling, figures = study.begin(options), [], 0.0, {}
    with ca_damper.ProgressBar("timing") as bar:
        for k, label in enumerate(options.variants):
            own, seconds = cost_of(label, options)
            rows, compiling = rows + own, compiling + seconds
            bar.count(k + 1, len(options.variants))
    automata = [Automaton(Paper(word)) for word in options.accountings]
    tried = [
        {"filling": one.label, "dt_s": dt, "outcome": outcome(one, dt, options.cycles)}
        for one in (Spheres(), *automata)
        for dt in options.steps
    ]
    costs, borne = pd.DataFrame(rows), pd.DataFrame(tried)
    costs.to_csv(folder / "cost.csv", index=False)
    borne.to_csv(folder / "steps.csv", index=False)
    picture_cost(folder / "cost.png", costs)
    picture_steps(folder / "steps.png", borne)
    print("CPU milliseconds a cycle")
    table = 1e3 * costs.pivot(index="particles", columns="variant", values="cpu_s")
    print(table[[*options.variants]].to_string(float_format="{:.3g}".format), "\n")
    for label, own in costs.groupby("variant", sort=False):
        at = own.loc[(own.particles - SOME).abs().idxmin()]
        end, rate = f"{label}_N{at.particles}", 1e-6 * at.particles * at.steps / at.cpu_s
        figures[f"cycle_ms_{end}"] = 1e3 * at.cpu_s, "ms"
        figures[f"particle_steps_{end}"] = rate, "million/s"
        figures[f"growth_{label}"] = own.cpu_s.iloc[-1] / own.cpu_s.iloc[0], "1"
    for label, own in borne.groupby("filling", sort=False):
        running = own.dt_s[own.outcome == "runs"]
        figures[f"longest_step_{label}"] = running.max() if len(running) else None, "s"
    study.finish(options, NAME, figures, compiling)


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
