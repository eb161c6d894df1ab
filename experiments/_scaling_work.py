"""Evaluations of a run, counted by body and interval (``blast_scaling.py``).

A body is charged with the bonds of which it is the master and the contact pairs of which it is the
first, as the paper charges its master elements.
"""

from dataclasses import dataclass
from itertools import chain, combinations

import numpy as np
import taichi as ti

from taichi_dem import Every, Simulation
from taichi_dem.kit.allocation import values
from taichi_dem.simulate import run_simulation
from taichi_dem.state.timeline import MAX_LEVEL
from taichi_dem.step.drivers import Resident
from taichi_dem.step.multirate.lists import Once
from taichi_dem.step.phases import Step

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
        return _least_squares(table / scale, np.ones(len(table))) / scale


def _least_squares(table, wanted):
    """Least squares without negative unknowns: the best of those that leave some of them out."""
    places = range(table.shape[1])
    best, least = np.zeros(table.shape[1]), np.inf
    for chosen in chain.from_iterable(combinations(places, 1 + k) for k in places):
        found = np.linalg.lstsq(table[:, chosen], wanted, rcond=None)[0]
        error = np.linalg.norm(table[:, chosen] @ found - wanted)
        if found.min() >= 0.0 and error < least:
            best, least = np.zeros(table.shape[1]), error
            best[list(chosen)] = found
    return best


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

    def read(self):
        """Counts (bodies, classes, kinds) and ticks (classes,) since the last time; then zero."""
        found = values(self.counts), values(self.ticks)
        self.counts.fill(0)
        self.ticks.fill(0)
        return found


class CountedStep(Step):
    """A step that counts the evaluations that are due; in one serial kernel only."""

    def __init__(self, counter, *parts):
        self.counter = counter
        super().__init__(*parts)

    def _parts(self):
        counter, schedule = self.counter, self.schedule
        (phases,) = super()._parts()
        ends = (Once(), counter.tick), (schedule.bonds, counter.bond)
        return (((schedule.pairs, counter.pair), *phases, *ends),)


class _Intervals:
    """Observer that reads the counter, a row an interval of some largest steps."""

    def __init__(self, simulation, counter, every):
        self.when, self.simulation, self.counter = Every(steps=every), simulation, counter
        self.rows, self.before = [], np.zeros(2)

    def observe(self, view):
        """End an interval; what was counted before the first step belongs to none."""
        counted, now = self.counter.read(), np.array([view.cpu_seconds, self.simulation.searches])
        if view.step > 0:
            self.rows.append((view.time_s, *counted, *(now - self.before)))
            self.before = now


def record_workload(scene, method, until, every):
    """Run a scene with contact to a time [s] and count its evaluations: workload, simulation.

    method: ``Uniform`` or ``Multirate``. every: largest steps of an interval. The run is stopped
    between two steps only, so its bits are those of an undisturbed one.
    """
    simulation = Simulation(scene, method, "resident")
    counter, engine = EvaluationCounter(simulation), simulation.engine
    step = CountedStep(counter, engine.advance, engine.broad_phase)
    simulation.driver = Resident(step)
    made = _Intervals(simulation, counter, every)
    run_simulation(simulation, until=until, samples=1, title="blast", observers=[made])
    time_s, counts, ticks, seconds, searches = map(np.array, zip(*made.rows))
    used = 1 + int(np.flatnonzero(ticks.any(axis=0)).max())
    return Workload(time_s, counts[:, :, :used], ticks[:, :used], seconds, searches), simulation
