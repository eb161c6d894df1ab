"""Evaluations of a run, counted by body and interval, and workers that share them in simulation.

A body is charged with the bonds of which it is the master and the contact pairs of which it is the
first, as the paper charges its master elements. All workers wait for the slowest at the end of
every tick, as a body's step needs the impulses of all that touch it; the cost of waiting itself is
left out. A share is a run of neighbours in the order of the work; cuts are places in it, (workers +
1,) whole numbers that never fall: the paper's rebalancing (Konno et al., 3.2, Figs 8 and 9).
"""

from dataclasses import dataclass

import numpy as np
import taichi as ti
from scipy.optimize import nnls

from taichi_dem import Collector, Every, Simulation
from taichi_dem.kit.allocation import values
from taichi_dem.kit.ordered import Once
from taichi_dem.simulate import run_simulation
from taichi_dem.state.timeline import MAX_LEVEL
from taichi_dem.step.drivers import Resident
from taichi_dem.step.explicit import ExplicitStep
from taichi_dem.step.phases import STEP

#: What is counted: bonds, contact pairs, and the pairs of spheres that are compared in these.
KINDS = ("bonds", "pairs", "spheres")


@dataclass(frozen=True, eq=False)
class Workload:
    """Evaluations and costs of a run, an entry an interval.

    time: at the end of each [s]. counts: of KINDS by body and class, (intervals, bodies, classes,
    kinds). ticks: (intervals, classes). seconds: CPU time of each. searches: contact searches in
    each. A tick at which level k and all finer ones are due is of class k: within it nobody waits
    for anybody, between ticks all wait for the last.
    """

    time: np.ndarray
    counts: np.ndarray
    ticks: np.ndarray
    seconds: np.ndarray
    searches: np.ndarray

    def prices(self):
        """Seconds a bond, a pair, a pair of spheres, a tick, and a search, fitted to the intervals.

        The price of a bond contains the work of its bodies, as both are due together.
        """
        work = self.counts.sum(axis=(1, 2)).astype(float)
        # As shares of each interval: early ones tell what a bond costs, late ones what a pair does.
        seconds = np.maximum(self.seconds, 1e-12)[:, None]
        table = np.column_stack([work, self.ticks.sum(axis=1), self.searches]) / seconds
        scale = table.max(axis=0)
        scale[scale == 0.0] = 1.0
        return nnls(table / scale, np.ones(len(table)))[0] / scale


@ti.data_oriented
class EvaluationCounter:
    """Counts evaluations by body and by the coarsest level that was due at their tick.

    counts: (bodies, classes) of KINDS. ticks: how many there were of each class.
    """

    def __init__(self, simulation):
        engine = simulation.engine
        self.tables, self.schedule = engine.tables, engine.schedule
        self.store = engine.contacts.store
        shape = (simulation.model.body_count, MAX_LEVEL + 1)
        self.counts = ti.Vector.field(len(KINDS), ti.i32, shape=shape)
        self.ticks = ti.field(ti.i32, shape=MAX_LEVEL + 1)

    @ti.func
    def tick(self, one):
        """Count the tick."""
        ti.atomic_add(self.ticks[self.schedule.low[None]], 1)

    @ti.func
    def bond(self, b):
        """Charge the master of a bond that is due."""
        master = self.tables.bond_slots[b][0] >> 2
        ti.atomic_add(self.counts[master, self.schedule.low[None]][0], 1)

    @ti.func
    def pair(self, p):
        """Charge the first body of a contact pair that is due."""
        counted = self.counts[self.store.body[p][0], self.schedule.low[None]]
        spheres = self.store.last[p] - self.store.first[p]
        self.counts[self.store.body[p][0], self.schedule.low[None]] = counted + ti.Vector(
            [0, 1, spheres]
        )

    def read(self, _=None):
        """Counts (bodies, classes, kinds) and ticks (classes,) since the last time; then zero."""
        found = values(self.counts), values(self.ticks)
        self.counts.fill(0)
        self.ticks.fill(0)
        return found


class CountedStep(ExplicitStep):
    """A step that counts the evaluations that are due; in one serial kernel only."""

    def __init__(self, counter, *parts):
        self.counter = counter
        super().__init__(*parts)
        self.arrange()

    def phases(self):
        """Those of the step, with the pairs counted first, ticks and bonds last."""
        counter, lists = self.counter, self.schedule.lists
        ends = (STEP, Once(), counter.tick), (STEP, lists.bonds, counter.bond)
        return ((STEP, lists.pairs, counter.pair), *super().phases(), *ends)


def record_workload(scene, method, until, every):
    """Run a scene with contact to a time [s] and count its evaluations: workload, simulation.

    method: ``Uniform`` or ``Multirate``. every: largest steps of an interval. The run is stopped
    between two steps only, so its bits are those of an undisturbed one.
    """
    simulation = Simulation(scene, method, "resident")
    counter, engine = EvaluationCounter(simulation), simulation.engine
    step = CountedStep(counter, engine.schedule, engine.broad_phase)
    simulation.driver = Resident(step)
    seen = Collector(
        Every(steps=every),
        time=lambda view: view.time_s,
        counted=counter.read,
        spent=lambda view: (view.cpu_seconds, simulation.searches),
    )
    run_simulation(simulation, until=until, samples=1, title="blast", observers=[seen])
    # What was counted before the first step belongs to no interval.
    counts, ticks = map(np.array, zip(*seen.rows["counted"][1:]))
    seconds, searches = np.diff(seen["spent"], axis=0).T
    used = 1 + int(np.flatnonzero(ticks.any(axis=0)).max())
    parts = seen["time"][1:], counts[:, :, :used], ticks[:, :used], seconds, searches
    return Workload(*parts), simulation


@dataclass(frozen=True, eq=False)
class SharedWork:
    """Work shared in a way. total: seconds of one worker. elapsed: of all, with waiting [s].

    seconds: of each worker for its own work (workers,). cuts: (intervals, workers + 1), None where
    there are none.
    """

    way: str
    total: float
    seconds: np.ndarray
    elapsed: float
    cuts: np.ndarray | None = None

    @property
    def workers(self):
        """Number of workers."""
        return len(self.seconds)

    @property
    def imbalance(self):
        """Time of the slowest worker over that of the fastest (Fig. 15); infinite if one rests."""
        slowest, fastest = self.seconds.max(), self.seconds.min()
        return float(slowest / fastest) if fastest > 0.0 else np.inf

    def acceleration(self, serial=0.0):
        """Time of one worker over that of all; serial: share of one's time that is not shared."""
        alone = self.total * serial / (1.0 - serial)
        return (self.total + alone) / (self.elapsed + alone)


class Workers:
    """Simulates workers on a workload.

    cost: seconds of every body and class of ticks, (intervals, bodies, classes). total: their sum.
    """

    def __init__(self, workload):
        self.workload, self.prices = workload, workload.prices()
        self.cost = workload.counts @ self.prices[: workload.counts.shape[-1]]
        self.total = float(self.cost.sum())

    def share(self, way, workers):
        """Work of a number of workers that share it in one of WAYS."""
        if way == "due":
            return self._equal_parts(workers)
        # Body i meets at most N - i others, of higher number: all that is known beforehand.
        cuts = even_cuts(np.arange(self.cost.shape[1], 0, -1) - 1.0, workers)
        seconds, elapsed, used = np.zeros(workers), 0.0, []
        for cost in self.cost:
            shares = share_costs(cost, cuts)
            used.append(cuts)
            seconds += shares.sum(axis=1)
            elapsed += float(shares.max(axis=0).sum())
            if way == "polyline":
                cuts = recut(cuts, shares.sum(axis=1))
            elif way == "rebalanced":
                cuts = even_cuts(cost.sum(axis=1), workers)
        return SharedWork(way, self.total, seconds, elapsed, np.array(used))

    def _equal_parts(self, workers):
        """Equal parts of the due bonds, then of the due pairs, of every tick."""
        counts, ticks = self.workload.counts.sum(axis=1), self.workload.ticks
        # A pair counts with the mean number of its spheres.
        spheres = counts[..., 2] / np.maximum(counts[..., 1], 1)
        prices = np.full(ticks.shape, self.prices[0]), self.prices[1] + self.prices[2] * spheres
        seconds, elapsed = np.zeros(workers), 0.0
        for due, price in zip((counts[..., 0], counts[..., 1]), prices):
            each = due / np.maximum(ticks, 1)
            full, rest = np.divmod(each, workers)
            for w in range(workers):
                mine = full + np.clip(rest - w, 0.0, 1.0)
                seconds[w] += float((ticks * price * mine).sum())
            elapsed += float((ticks * price * np.ceil(each / workers)).sum())
        return SharedWork("due", self.total, seconds, elapsed)


def even_cuts(cost, workers):
    """Cuts that divide the cumulative curve of the cost, (items,), evenly.

    The share of each worker takes at most the mean of the shares and the dearest item; together
    they hold every item once.
    """
    curve = np.concatenate([[0.0], np.cumsum(cost)])
    inner = curve[-1] * np.arange(1, workers) / workers
    return np.concatenate([[0], np.searchsorted(curve[1:], inner, side="right"), [len(curve) - 1]])


def recut(cuts, seconds):
    """Cuts after an interval in which every worker's share took some time, (workers,) [s].

    Only a worker's whole time is known, so that within a share all items count alike: the
    cumulative curve is a polyline with a corner at each cut, as in Figs 8 and 9.
    """
    workers, curve = len(seconds), np.concatenate([[0.0], np.cumsum(seconds)])
    # A share without items, or that took no time, leaves two corners at one place of an axis.
    _, corner = np.unique(curve, return_index=True)
    inner = np.interp(curve[-1] * np.arange(1, workers) / workers, curve[corner], cuts[corner])
    return np.concatenate([cuts[:1], np.rint(inner).astype(int), cuts[-1:]])


def share_costs(cost, cuts):
    """Cost of every share, (workers, ...); cost (items, ...)."""
    start = np.zeros((1, *np.shape(cost)[1:]))
    return np.diff(np.concatenate([start, np.cumsum(cost, axis=0)])[cuts], axis=0)
