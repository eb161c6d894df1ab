"""What does it take to keep many workers busy while the work moves over the block?

The paper's blast is run once by the paper's rule; every 50 largest steps the levels of the bodies
and the near pairs are recorded, from which follow the evaluations of each body. Then simulated
workers share this work in three ways: fixed ranges of bodies; ranges that change after each
interval by the workers' times (the paper, Figs 8 and 9); and equal parts of what is due at each
tick, which the lists of this program provide at no cost. At the end of a tick all wait for the
slowest; messages cost nothing, and an evaluation of a bond or of a pair counts alike.

Expect fixed shares to differ by factors of 5 to 15, as the work is where the block breaks, and
rebalanced ones by 1.2. The paper has 5.8 and 1.1, which saves 8 min of 541. Balance over the run is
not enough: at many ticks few bodies are active, all in one region, so workers with ranges of bodies
often wait.

    python experiments/blast_scaling.py             # most of ten minutes
    python experiments/blast_scaling.py --l 1e-7    # a longer run

Writes scaling.png, scaling.csv, shares.csv and summary.json to results/blast_scaling/.
"""

import sys
from functools import partial
from typing import NamedTuple

import numpy as np

from cases.blast import blast_parser, paper_scene
from taichi_dem import Collector, Every, Multirate, Simulation
from taichi_dem.kit import study
from taichi_dem.kit.files import write_csv
from taichi_dem.kit.plot_style import BLUE, GREEN, GREY, PURPLE, RED, picture
from taichi_dem.simulate import run_simulation

NAME = "blast_scaling"
SETTINGS = {
    "until": (5e-4, 5e-5, study.number(0, 1), "simulated time [s], default 5e-4"),
    "l": (1e-8, 1e-7, study.number(0, 1), "limit of a displacement in a step [m], default 1e-8"),
    "every": (50, 50, study.whole(1, 100000), "largest steps in an interval, default 50"),
    "counts": (range(1, 25), (1, 2, 4, 8, 16, 24)),
}
DT0 = 1e-8
#: Workers of the paper's Fig 15, and the share of one's time that is not contact.
PAPER_WORKERS, PAPER_SERIAL = 24, 0.05
#: By way of sharing: longest over shortest time of a worker in Fig 15, and minutes of one process
#: over those of 24 (4.3, 4.4).
PAPER_IMBALANCE = {"static": 20381.0 / 3493.0, "rebalanced": 9787.0 / 9023.0}
PAPER_SPEEDUP = {"static": 2702.0 / 541.0, "rebalanced": 2702.0 / 501.0}
#: Words, colour and line by way of sharing. The first two give every worker a run of bodies.
WAYS = {
    "static": ("fixed shares, by N - i", RED, "-."),
    "rebalanced": ("rebalanced by workers' times (the paper)", PURPLE, "--"),
    "due": ("equal parts of active bodies", GREEN, "-"),
}
TABLE = study.Table(
    workers=("workers", "workers"),
    way=("way", "way of sharing"),
    acceleration=("acceleration", "acceleration", ".3g"),
    imbalance=("imbalance", "slowest/fastest", ".3g"),
)
options_parser = partial(blast_parser, NAME, __doc__, (), settings=SETTINGS)


def record(scene, options):
    """Run a scene by the paper's rule; times [s], entries by interval, body and level, simulation.

    A body is charged with the bonds of which it is the master and the near pairs of which it is the
    first, as the paper charges its master elements; an entry has the finer level of its two bodies.
    """
    simulation = Simulation(scene, Multirate(DT0, options.l), "resident")
    store, top = simulation.engine.contacts.store, simulation.model.topology
    seen = Collector(
        Every(steps=options.every),
        time=lambda view: view.time_s,
        level=lambda view: view.motion()["level"],
        pairs=lambda view: store.near_table()[0],
    )
    looks = {"samples": 1, "title": "blast", "observers": [seen]}
    run_simulation(simulation, until=options.until, **looks)
    levels = np.array(seen.rows["level"][1:])
    bonds = np.column_stack([top.master, top.slave])
    entries = np.zeros((*levels.shape, levels.max() + 1))
    for own, level, pairs in zip(entries, levels, seen.rows["pairs"][1:]):
        bodies = np.vstack([bonds, pairs])
        np.add.at(own, (bodies[:, 0], level[bodies].max(axis=1)), 1.0)
    return np.array(seen["time"][1:]), entries, simulation


def evaluations(entries, every):
    """Evaluations by interval, body and class of ticks, and ticks of each class in an interval.

    An entry of a level is due at the ticks of its own class and of all coarser ones: a tick of
    class k is one at which level k and all finer ones are due.
    """
    classes = np.arange(entries.shape[-1])
    ticks = every * np.where(classes > 0, 2.0 ** (classes - 1), 1.0)
    due = np.flip(np.cumsum(np.flip(entries, -1), axis=-1), -1)
    return due * ticks, ticks


class Shared(NamedTuple):
    """Work shared in a way: of each worker (workers,), total, all with waiting, cuts if any."""

    way: str
    workers: int
    work: np.ndarray
    elapsed: float
    cuts: np.ndarray

    @property
    def imbalance(self):
        """Work of the slowest worker over that of the fastest (Fig. 15); infinite if one rests."""
        slowest, fastest = self.work.max(), self.work.min()
        return float(slowest / fastest) if fastest > 0.0 else np.inf

    @property
    def acceleration(self):
        """Time of one worker over that of all, with the part that is not shared."""
        alone = self.work.sum() * PAPER_SERIAL / (1.0 - PAPER_SERIAL)
        return float((self.work.sum() + alone) / (self.elapsed + alone))


def shared(way, workers, cost, ticks):
    """Work (intervals, bodies, classes) of a number of workers that share it in one of WAYS."""
    if way == "due":
        due = cost.sum(axis=1) / ticks
        elapsed = float((ticks * np.ceil(due / workers)).sum())
        even = np.full(workers, cost.sum() / workers)
        return Shared(way, workers, even, elapsed, np.empty(0))
    # Body i meets at most N - i others, of higher number: all that is known beforehand.
    cuts = even_cuts(np.arange(cost.shape[1], 0, -1) - 1.0, workers)
    work, elapsed, used = np.zeros(workers), 0.0, []
    for one in cost:
        shares = share_costs(one, cuts)
        used.append(cuts)
        work += shares.sum(axis=1)
        elapsed += float(shares.max(axis=0).sum())
        if way == "rebalanced":
            cuts = recut(cuts, shares.sum(axis=1))
    return Shared(way, workers, work, elapsed, np.array(used))


def even_cuts(cost, workers):
    """Cuts that divide the cumulative curve of the cost, (items,), evenly.

    The share of each worker takes at most the mean of the shares and the dearest item; together
    they hold every item once.
    """
    curve = np.concatenate([[0.0], np.cumsum(cost)])
    inner = curve[-1] * np.arange(1, workers) / workers
    return np.concatenate([[0], np.searchsorted(curve[1:], inner, side="right"), [len(curve) - 1]])


def recut(cuts, work):
    """Cuts after an interval in which every worker's share took some time, (workers,).

    Only a worker's whole time is known, so that within a share all items count alike: the
    cumulative curve is a polyline with a corner at each cut, as in Figs 8 and 9.
    """
    workers, curve = len(work), np.concatenate([[0.0], np.cumsum(work)])
    # A share without items, or that took no time, leaves two corners at one place of an axis.
    _, corner = np.unique(curve, return_index=True)
    inner = np.interp(curve[-1] * np.arange(1, workers) / workers, curve[corner], cuts[corner])
    return np.concatenate([cuts[:1], np.rint(inner).astype(int), cuts[-1:]])


def share_costs(cost, cuts):
    """Cost of every share, (workers, ...); cost (items, ...)."""
    start = np.zeros((1, *np.shape(cost)[1:]))
    return np.diff(np.concatenate([start, np.cumsum(cost, axis=0)])[cuts], axis=0)


def draw(path, made, time_s):
    """Acceleration, work of each worker and cuts, as the paper's Figs 14, 15 and 9."""
    with picture(path, 1, 3, size=(12.0, 4.8)) as (figure, (whole, each, cuts)):
        for way, (words, colour, line) in WAYS.items():
            own = [one for one in made if one.way == way]
            counts = np.array([one.workers for one in own])
            gains = [one.acceleration for one in own]
            whole.plot(counts, gains, ls=line, color=colour, label=words)
            if way in PAPER_SPEEDUP:
                gain, words = PAPER_SPEEDUP[way], f"measured in the paper, {way}"
                whole.plot(PAPER_WORKERS, gain, "o", color=colour, label=words)
                work = own[-1].work / own[-1].work.mean()
                look = {"color": colour, "ls": line, "label": f"{way}: {own[-1].imbalance:.3g}"}
                each.step(np.arange(1, PAPER_WORKERS + 1), work, where="mid", **look)
        bound = counts / (1.0 + PAPER_SERIAL * (counts - 1.0))
        whole.plot(counts, bound, ":", color=GREY, label="bound: no worker waits")
        whole.set(xlabel="workers [1]", ylabel="acceleration [1]", ylim=(0, None))
        whole.set_title(f"Whole run, {100 * PAPER_SERIAL:g} % not shared (Fig 14)")
        figure.legend(*whole.get_legend_handles_labels(), loc="outside lower center", ncols=3)
        each.set(xlabel="number of the worker [1]", ylabel="its work / mean [1]")
        each.set(ylim=(0.0, 1.4 * each.get_ylim()[1]), title="Slowest over fastest (Fig 15)")
        each.legend(loc="upper right")
        places = next(one.cuts for one in reversed(made) if one.way == "rebalanced")
        cuts.plot(1e3 * time_s, places[:, 1:-1], color=BLUE, linewidth=0.5)
        cuts.set(xlabel="time [ms]", ylabel="number of the body [1]", ylim=(0, places[0, -1]))
        cuts.set_title("Where rebalanced shares begin (Fig 9)")


def run(options):
    """Record, simulate, picture."""
    at = study.output_paths(options.out)
    time_s, entries, simulation = record(paper_scene(options.mesh), options)
    work = evaluations(entries, options.every)
    made = [shared(way, count, *work) for count in options.counts for way in WAYS]
    rows, last = TABLE.rows(made), made[-len(WAYS) :]
    study.write_rows(at("scaling.csv"), rows)
    each = {f"{one.way}_evaluations": one.work for one in last}
    write_csv(at("shares.csv"), {"worker": np.arange(1, PAPER_WORKERS + 1), **each})
    draw(at("scaling.png"), made, time_s)
    TABLE.show([row for row in rows if row["workers"] in (2, 4, PAPER_WORKERS)])
    figures = {}
    for one in last:
        if one.way in PAPER_IMBALANCE:
            figures[f"imbalance_24_{one.way}"] = one.imbalance, "1", PAPER_IMBALANCE[one.way]
        figures[f"speedup_24_{one.way}"] = one.acceleration, "1", PAPER_SPEEDUP.get(one.way)
    study.finish(options, NAME, figures, simulation.compile_seconds)


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
