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

import os
import sys
import time

import numpy as np

from _blast import blast_parser, paper_scene
from _scaling_picture import picture_scaling
from _scaling_record import record
from _scaling_simulate import WAYS, Workers, acceleration
from _scaling_threads import ROUNDS, thread_gain
from taichi_dem import Multirate
from taichi_dem.kit.files import output_folder, write_csv
from taichi_dem.kit.progress.progress_bar import ProgressBar
from taichi_dem.kit.study import (
    figure,
    finish,
    main,
    number,
    show_rows,
    take_defaults,
    whole,
    write_rows,
)
from taichi_dem.mesh.partition import imbalance

NAME = "blast_scaling"
QUICK = {"until": 1e-4, "l": 1e-7}
FULL = {"until": 5e-4, "l": 1e-8}
DT0 = 1e-8
COUNTS = (*range(1, 25), 32, 48, 64, 96, 128, 192, 256)
QUICK_COUNTS = (1, 2, 4, 8, 16, 24, 64, 256)
#: Workers of the paper's Fig 15, and its shortest and longest time of one [s].
PAPER_WORKERS = 24
PAPER_STATIC, PAPER_REBALANCED = 20381.0 / 3493.0, 9787.0 / 9023.0
#: Minutes of one process and of 24 with and without rebalancing (4.3, 4.4); share of one's time
#: that is not contact.
PAPER_ONE, PAPER_MANY, PAPER_FIXED, PAPER_SERIAL = 2702.0, 501.0, 541.0, 0.05
#: Boxes of the bar for the threads, six tetrahedra each.
CELLS, QUICK_CELLS = (40, 20, 20), (20, 10, 10)
TABLE = {
    "way of sharing": ("way", ""),
    "workers": ("workers", ""),
    "slowest/fastest": ("imbalance", ".3g"),
    "contact": ("contact", ".3g"),
    "whole": ("whole", ".3g"),
}


def options_parser():
    """Options of this experiment."""
    made = blast_parser(NAME, __doc__, ())
    made.add_argument("--until", type=number(0, 1), help="simulated time [s], 5e-4")
    made.add_argument("--l", type=number(0, 1), help="the paper's way of a body in a step [m]")
    made.add_argument("--every", type=whole(1, 100000), default=50, help="steps an interval, 50")
    made.add_argument("--repeats", type=whole(1, 100), default=5, help="of the threads' times")
    return made


def figures_of(workers, shared, gains):
    """Figures for summary.json, beside the paper's."""
    made = {}
    paper = {"static": PAPER_STATIC, "rebalanced": PAPER_REBALANCED}
    for way in ("static", "polyline", "rebalanced"):
        apart = imbalance(shared[way][PAPER_WORKERS].seconds)
        made[f"imbalance_24_{way}"] = figure(apart, "1", paper.get(way))
    paper = {"static": PAPER_ONE / PAPER_FIXED, "rebalanced": PAPER_ONE / PAPER_MANY}
    for way in WAYS:
        one = shared[way][PAPER_WORKERS]
        contact = acceleration(workers.total, one.elapsed, 0.0)
        made[f"contact_24_{way}"] = figure(contact, "1")
        gain = acceleration(workers.total, one.elapsed, PAPER_SERIAL)
        name = "speedup_24_simulated" if way == "rebalanced" else f"speedup_24_{way}"
        made[name] = figure(gain, "1", paper.get(way))
    bar, block = gains
    for name, row in (("", bar), ("_paper_block", block)):
        made[f"speedup_2_threads{name}"] = figure(row["gain"], "1")
        made[f"speedup_2_threads_busy{name}"] = figure(row["busy"], "1")
    made["speedup_2_threads_bodies"] = figure(bar["bodies"], "1")
    for name, price in zip(("bond", "pair", "sphere_pair"), workers.prices):
        made[f"ns_a_{name}"] = figure(1e9 * float(price), "ns")
    return made


def row_of(workers, way, count, one):
    """Acceleration and imbalance with a number of workers; one: a ``Shared``."""
    gains = [acceleration(workers.total, one.elapsed, share) for share in (0.0, PAPER_SERIAL)]
    names = ("workers", "way", "contact", "whole", "imbalance")
    return dict(zip(names, (count, way, *gains, imbalance(one.seconds))))


def run(options):
    """Record, simulate, measure, picture."""
    take_defaults(options, FULL, QUICK)
    scene = paper_scene(options.mesh)
    output_folder(options.out)
    started = time.perf_counter()
    with ProgressBar("blast") as bar:
        method = Multirate(DT0, options.l)
        recorded, simulation = record(scene, method, options.until, options.every, bar)
    workers, counts = Workers(recorded), QUICK_COUNTS if options.quick else COUNTS
    shared = {way: {count: workers.share(way, count) for count in counts} for way in WAYS}
    gains = measured(options)
    rows = [row_of(workers, way, *one) for way in WAYS for one in shared[way].items()]
    write_rows(os.path.join(options.out, "scaling.csv"), rows)
    each = {f"{way}_s": shared[way][PAPER_WORKERS].seconds for way in WAYS}
    numbers = np.arange(1, PAPER_WORKERS + 1)
    write_csv(os.path.join(options.out, "shares.csv"), {"worker": numbers, **each})
    path = os.path.join(options.out, "scaling.png")
    paper = PAPER_ONE / PAPER_FIXED, PAPER_ONE / PAPER_MANY
    points = dict(zip(("2 threads, bar", "2 threads, block"), ((2, g["gain"]) for g in gains)))
    picture_scaling(path, workers, shared, PAPER_WORKERS, PAPER_SERIAL, paper, points)
    shown = [row for row in rows if row["workers"] in (2, 4, PAPER_WORKERS, 256)]
    show_rows([{**row, "way": WAYS[row["way"]]} for row in shown], TABLE)
    seconds = simulation.compile_seconds, time.perf_counter() - started
    finish(options, NAME, figures_of(workers, shared, gains), seconds)


def measured(options):
    """What a second thread gains on the bar, and on the paper's block."""
    cells, *often = (QUICK_CELLS, 1, 2) if options.quick else (CELLS, ROUNDS, options.repeats)
    blocks = ("", cells, "paper_multirate", 10), (options.mesh, None, "paper_multirate", 400)
    gains = []
    with ProgressBar("two threads") as bar:
        for block in blocks:
            bar.count(len(gains), len(blocks))
            gains.append(thread_gain(*block, *often))
    return gains


if __name__ == "__main__":
    sys.exit(main(run, options_parser()))
