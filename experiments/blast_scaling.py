"""What does it take to keep many workers busy while the work moves over the block?

The paper's blast by the paper's rule is run once and what it evaluates is counted, body by body, in
intervals of 50 largest steps. Then workers are simulated that share this work in four ways: fixed
runs of bodies; runs cut anew after each interval by the workers' times (the paper, Figs 8 and 9) or
by the bodies' own costs; and equal parts of what is due at each tick, which the lists of this
program give for nothing. All wait at the end of a tick for the slowest; messages are free.

Expect: fixed shares 5 to 15 times apart, as the work is where the block breaks; rebalanced ones
within 1.2. In the paper 5.8 and 1.1, and 8 min less of 541. Balance over the run is not all: many
ticks bring few bodies, and those sit side by side, so workers with runs of bodies often rest.

    python experiments/blast_scaling.py             # most of ten minutes
    python experiments/blast_scaling.py --l 1e-7    # a minute for the run

Two threads are measured, not simulated: whole steps of the parallel driver on a large bar and on
the paper's block, each in a process of its own, fastest of repeats. Where other programs keep the
cores busy, look at what the busiest thread took of the cores instead (..._busy).

Writes scaling.png, scaling.csv, shares.csv and summary.json to results/blast_scaling/.
"""

import sys
from functools import partial

import numpy as np

from _blast import blast_parser, paper_scene
from _scaling_threads import ROUNDS, thread_gains
from _scaling_work import record_workload
from _scaling_workers import WAYS, Workers, draw_acceleration, draw_cuts, draw_shares
from taichi_dem import Multirate, ProgressBar
from taichi_dem.kit import study
from taichi_dem.kit.files import write_csv
from taichi_dem.kit.plot_style import BLACK, PURPLE, RED, picture

NAME = "blast_scaling"
SETTINGS = {
    "until": (5e-4, 5e-5, study.number(0, 1), "simulated time [s], 5e-4"),
    "l": (1e-8, 1e-7, study.number(0, 1), "the paper's way of a body in a step [m]"),
    "every": (50, 50, study.whole(1, 100000), "steps an interval, 50"),
    "repeats": (5, 1, study.whole(1, 100), "of the threads' times"),
    "counts": ((*range(1, 25), 32, 48, 64, 96, 128, 192, 256), (1, 2, 4, 8, 16, 24, 64, 256)),
    # Boxes of the bar for the threads, six tetrahedra each, and turns of one and two threads.
    "cells": ((40, 20, 20), (10, 5, 5)),
    "rounds": (ROUNDS, 1),
}
DT0 = 1e-8
#: Method of the threads' times.
METHOD = "paper_multirate"
#: Workers of the paper's Fig 15, and the share of one's time that is not contact.
PAPER_WORKERS, PAPER_SERIAL = 24, 0.05
#: By way of sharing: longest over shortest time of a worker in Fig 15, and minutes of one process
#: over those of 24 (4.3, 4.4).
PAPER_IMBALANCE = {"static": 20381.0 / 3493.0, "rebalanced": 9787.0 / 9023.0}
PAPER_SPEEDUP = {"static": 2702.0 / 541.0, "rebalanced": 2702.0 / 501.0}
TABLE = study.Table(
    workers=("workers", "workers"),
    way=("way", "way of sharing"),
    contact=(lambda one: one.acceleration(), "contact", ".3g"),
    whole=(lambda one: one.acceleration(PAPER_SERIAL), "whole", ".3g"),
    imbalance=("imbalance", "slowest/fastest", ".3g"),
)
options_parser = partial(blast_parser, NAME, __doc__, (), settings=SETTINGS)


def run(options):
    """Record, simulate, measure, picture."""
    scene, at = paper_scene(options.mesh), study.output_paths(options.out)
    counting = options.until, options.every
    workload, simulation = record_workload(scene, Multirate(DT0, options.l), *counting)
    workers = Workers(workload)
    shared = {way: {n: workers.share(way, n) for n in options.counts} for way in WAYS}
    bar, block = gains = measured(options)
    rows = TABLE.rows(one for by_count in shared.values() for one in by_count.values())
    study.write_rows(at("scaling.csv"), rows)
    chosen = {way: by_count[PAPER_WORKERS] for way, by_count in shared.items()}
    each = {f"{way}_s": one.seconds for way, one in chosen.items()}
    write_csv(at("shares.csv"), {"worker": np.arange(1, PAPER_WORKERS + 1), **each})
    draw(at("scaling.png"), shared, chosen, workload, {"bar": bar["gain"], "block": block["gain"]})
    shown = [row for row in rows if row["workers"] in (2, 4, PAPER_WORKERS, 256)]
    TABLE.show([{**row, "way": WAYS[row["way"]]} for row in shown])
    figures = figures_of(chosen, workers.prices, *gains)
    study.finish(options, NAME, figures, simulation.compile_seconds)


def measured(options):
    """Gains of a second thread on the bar, and on the paper's block."""
    gains, often = [], (options.rounds, options.repeats)
    with ProgressBar("two threads") as bar:
        for mesh, cells, steps in (("", options.cells, 10), (options.mesh, None, 400)):
            bar.count(len(gains), 2)
            found = thread_gains(mesh, cells, [METHOD], steps, *often)
            gains.append(found[METHOD])
    return gains


def figures_of(chosen, prices, bar, block):
    """Figures for summary.json, beside the paper's."""
    made = {}
    for way, one in chosen.items():
        if way != "due":
            made[f"imbalance_24_{way}"] = (one.imbalance, "1", PAPER_IMBALANCE.get(way))
        made[f"contact_24_{way}"] = (one.acceleration(), "1")
        name = "speedup_24_simulated" if way == "rebalanced" else f"speedup_24_{way}"
        made[name] = (one.acceleration(PAPER_SERIAL), "1", PAPER_SPEEDUP.get(way))
    for name, row in (("", bar), ("_paper_block", block)):
        made[f"speedup_2_threads{name}"] = (row["gain"], "1")
        made[f"speedup_2_threads_busy{name}"] = (row["busy"], "1")
    made["speedup_2_threads_bodies"] = (bar["bodies"], "1")
    kinds = ("bond", "pair", "sphere_pair")
    return {**made, **{f"ns_a_{kind}": (1e9 * float(s), "ns") for kind, s in zip(kinds, prices)}}


def draw(path, shared, chosen, workload, measured):
    """Acceleration and shares, as the paper's Figs 9, 14 and 15; see ``run``."""
    names = [["whole", "contact"], ["shares", "cuts"]]
    with picture(path, 0, size=(9.2, 8.4)) as (figure, _):
        axes = figure.subplot_mosaic(names)
        draw_acceleration(axes["whole"], shared, PAPER_WORKERS, PAPER_SERIAL)
        look = {"ls": "none", "marker": "o"}
        for (way, gain), filled in zip(PAPER_SPEEDUP.items(), (RED, PURPLE)):
            words = "measured in the paper, " + way.replace("static", "fixed")
            axes["whole"].plot(PAPER_WORKERS, gain, color=filled, label=words, **look)
        look = {"ls": "none", "color": BLACK, "ms": 9}
        for (name, gain), mark in zip(measured.items(), "*P"):
            words = f"measured here, 2 threads, {name}"
            axes["whole"].plot(2, gain, marker=mark, label=words, **look)
        words = f"Whole run, simulated workers, {100 * PAPER_SERIAL:g} % not shared (Fig 14)"
        axes["whole"].set(xlim=(0, PAPER_WORKERS + 1), ylim=(0, None), title=words)
        handles = axes["whole"].get_legend_handles_labels()
        figure.legend(*handles, loc="outside lower center", ncols=3)
        draw_acceleration(axes["contact"], shared)
        words = "Contact calculation alone, many simulated workers"
        axes["contact"].set(xscale="log", yscale="log", title=words)
        draw_shares(axes["shares"], chosen)
        axes["shares"].set_title("Simulated workers: slowest over fastest in the run (Fig 15)")
        draw_cuts(axes["cuts"], chosen["rebalanced"], workload.time)
        axes["cuts"].set_title("Lines: where simulated workers' shares begin (Fig 9)")
        words = "Lines: simulated workers that share the work of one recorded run"
        figure.suptitle(f"{words};\npoints: measured times of processes or threads")


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
