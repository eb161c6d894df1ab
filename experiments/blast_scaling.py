"""What does it take to keep many workers busy while the work moves over the block?

The paper's blast is run once by the paper's rule; evaluations are counted for each body in
intervals of 50 largest steps. Then simulated workers share this work in four ways: fixed ranges of
bodies; ranges that change after each interval by the workers' times (the paper, Figs 8 and 9) or by
the bodies' costs; and equal parts of what is due at each tick, which the lists of this program
provide at no cost. At the end of a tick all wait for the slowest; messages cost nothing.

Expect fixed shares to differ by factors of 5 to 15, as the work is where the block breaks, and
rebalanced ones by 1.2. The paper has 5.8 and 1.1, which saves 8 min of 541. Balance over the run is
not enough: at many ticks few bodies are active, all in one region, so workers with ranges of bodies
often wait.

    python experiments/blast_scaling.py             # most of ten minutes
    python experiments/blast_scaling.py --l 1e-7    # a longer run

Two threads are measured, not simulated: whole steps of the parallel driver on a large bar and on
the paper's block, each in its own process, fastest of repeats; other programs that use the cores
make the gain less.

Writes scaling.png, scaling.csv, shares.csv and summary.json to results/blast_scaling/.
"""

import sys
from functools import partial

import numpy as np

from _blast import blast_parser, paper_scene
from _scaling import Workers, record_workload
from _threads import ROUNDS, thread_gains
from taichi_dem import Multirate
from taichi_dem.kit import study
from taichi_dem.kit.files import write_csv
from taichi_dem.kit.plot_style import BLACK, BLUE, GREEN, GREY, PURPLE, RED, picture

NAME = "blast_scaling"
SETTINGS = {
    "until": (5e-4, 5e-5, study.number(0, 1), "simulated time [s], default 5e-4"),
    "l": (1e-8, 1e-7, study.number(0, 1), "limit of a displacement in a step [m], default 1e-8"),
    "every": (50, 50, study.whole(1, 100000), "largest steps in an interval, default 50"),
    "repeats": (5, 1, study.whole(1, 100), "timings of the threads, default 5"),
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
#: Way of sharing -> words. Those with cuts give every worker a run of bodies.
WAYS = {
    "static": "fixed shares, by N - i",
    "polyline": "rebalanced by workers' times (the paper)",
    "rebalanced": "rebalanced by bodies' costs",
    "due": "equal parts of active bodies",
}
#: Colour and line by way of sharing.
LOOK = dict(zip(WAYS, ((RED, "-."), (PURPLE, "--"), (BLUE, "-"), (GREEN, (0, (8, 2))))))
TABLE = study.Table(
    workers=("workers", "workers"),
    way=("way", "way of sharing"),
    contact=(lambda one: one.acceleration(), "contact", ".3g"),
    whole=(lambda one: one.acceleration(PAPER_SERIAL), "whole", ".3g"),
    imbalance=("imbalance", "slowest/fastest", ".3g"),
)
options_parser = partial(blast_parser, NAME, __doc__, (), settings=SETTINGS)


def draw_acceleration(axes, shared, most=np.inf, serial=0.0):
    """Acceleration over the number of workers by way of sharing, and the bound of all ways.

    shared: by way and number of workers. serial: share of one worker's time that is not shared.
    """
    for way, by_count in shared.items():
        counts = np.array([count for count in by_count if count <= most])
        gains = [by_count[count].acceleration(serial) for count in counts]
        colour, line = LOOK[way]
        axes.plot(counts, gains, ls=line, color=colour, label=WAYS[way])
    bound = counts / (1.0 + serial * (counts - 1.0))
    axes.plot(counts, bound, ":", color=GREY, label="bound: no worker waits")
    axes.set(xlabel="workers [1]", ylabel="acceleration [1]")


def draw(path, shared, chosen, time_s, measured):
    """Acceleration, shares and cuts, as the paper's Figs 14, 15 and 9; time_s: of the cuts."""
    with picture(path, 2, 2, size=(9.2, 8.4)) as (figure, ((whole, contact), (shares, cuts))):
        draw_acceleration(whole, shared, PAPER_WORKERS, PAPER_SERIAL)
        for (way, gain), filled in zip(PAPER_SPEEDUP.items(), (RED, PURPLE)):
            words = "measured in the paper, " + way.replace("static", "fixed")
            whole.plot(PAPER_WORKERS, gain, "o", color=filled, label=words)
        for (name, one), mark in zip(measured.items(), "*P"):
            words = f"measured here, 2 threads, {name}"
            whole.plot(2, one["gain"], mark, color=BLACK, ms=9, label=words)
        words = f"Whole run, simulated workers, {100 * PAPER_SERIAL:g} % not shared (Fig 14)"
        whole.set(xlim=(0, PAPER_WORKERS + 1), ylim=(0, None), title=words)
        handles = whole.get_legend_handles_labels()
        figure.legend(*handles, loc="outside lower center", ncols=3)
        draw_acceleration(contact, shared)
        words = "Contact calculation alone, many simulated workers"
        contact.set(xscale="log", yscale="log", title=words)
        for way, one in chosen.items():
            if way != "due":
                colour, line = LOOK[way]
                look = {"color": colour, "ls": line, "label": f"{WAYS[way]}: {one.imbalance:.3g}"}
                seconds = one.seconds / one.seconds.mean()
                shares.step(np.arange(1, one.workers + 1), seconds, where="mid", **look)
        shares.set(xlabel="number of the worker [1]", ylabel="time of its work / mean [1]")
        shares.set(xlim=(0.5, PAPER_WORKERS + 0.5), ylim=(0.0, 1.4 * shares.get_ylim()[1]))
        shares.set_title("Simulated workers: slowest over fastest in the run (Fig 15)")
        shares.legend(loc="upper right")
        places = chosen["rebalanced"].cuts
        cuts.plot(1e3 * time_s, places[:, 1:-1], color=BLUE, linewidth=0.5)
        cuts.set(xlabel="time [ms]", ylabel="number of the body [1]")
        cuts.set(xlim=(0.0, 1e3 * time_s[-1]), ylim=(0, places[0, -1]))
        cuts.set_title("Lines: where simulated workers' shares begin (Fig 9)")
        words = "Lines: simulated workers that share the work of one recorded run"
        figure.suptitle(f"{words};\npoints: measured times of processes or threads")


def run(options):
    """Record, simulate, measure, picture."""
    scene, at = paper_scene(options.mesh), study.output_paths(options.out)
    counting = options.until, options.every
    workload, simulation = record_workload(scene, Multirate(DT0, options.l), *counting)
    workers = Workers(workload)
    shared = {way: {n: workers.share(way, n) for n in options.counts} for way in WAYS}
    chosen = {way: by_count[PAPER_WORKERS] for way, by_count in shared.items()}
    # Gains of a second thread on a bar, and on the paper's block.
    jobs = {"bar": ("", options.cells, [METHOD], 10), "block": (options.mesh, None, [METHOD], 400)}
    often = options.rounds, options.repeats
    gains = {name: thread_gains(*job, *often)[METHOD] for name, job in jobs.items()}
    rows = TABLE.rows(one for by_count in shared.values() for one in by_count.values())
    study.write_rows(at("scaling.csv"), rows)
    each = {f"{way}_s": one.seconds for way, one in chosen.items()}
    write_csv(at("shares.csv"), {"worker": np.arange(1, PAPER_WORKERS + 1), **each})
    draw(at("scaling.png"), shared, chosen, workload.time, gains)
    TABLE.show([row for row in rows if row["workers"] in (2, 4, PAPER_WORKERS, 256)])
    figures = {}
    for way, one in chosen.items():
        if way != "due":
            figures[f"imbalance_24_{way}"] = one.imbalance, "1", PAPER_IMBALANCE.get(way)
        figures[f"contact_24_{way}"] = one.acceleration(), "1"
        name = "speedup_24_simulated" if way == "rebalanced" else f"speedup_24_{way}"
        figures[name] = one.acceleration(PAPER_SERIAL), "1", PAPER_SPEEDUP.get(way)
    for end, row in zip(("", "_paper_block"), gains.values()):
        figures[f"speedup_2_threads{end}"] = row["gain"], "1"
    figures["speedup_2_threads_bodies"] = gains["bar"]["bodies"], "1"
    for kind, price in zip(("bond", "pair", "sphere_pair"), workers.prices):
        figures[f"ns_a_{kind}"] = 1e9 * float(price), "ns"
    study.finish(options, NAME, figures, simulation.compile_seconds)


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
