"""What a blast by the paper's rule evaluates, body by body and interval by interval.

A body is charged with the bonds of which it is the master and the contact pairs of which it is the
first, as the paper charges its master elements.
"""

from dataclasses import dataclass

import numpy as np
import taichi as ti
from scipy.optimize import nnls

from taichi_dem import Every, Simulation
from taichi_dem.simulate import run_simulation
from taichi_dem.step.drivers import Once, Resident, Step
from taichi_dem.timeline import MAX_LEVEL

#: What is counted: bonds, contact pairs, and the pairs of spheres that are compared in these.
KINDS = ("bonds", "pairs", "spheres")


@ti.data_oriented
class Counter:
    """Counts evaluations by body and by the coarsest level that was due at their tick.

    A tick at which level k and all finer ones are due is of class k: within it nobody waits for
    anybody, between ticks all wait for the last. counts: (bodies, classes) of KINDS. ticks: how
    many there were of each class.
    """

    def __init__(self, simulation):
        engine = simulation.loan.engine
        self.tables, self.schedule, self.contacts = engine.tables, engine.schedule, engine.contacts
        shape = (simulation.model.body_count, MAX_LEVEL + 1)
        self.counts = ti.Vector.field(len(KINDS), ti.i32, shape=shape)
        self.ticks = ti.field(ti.i32, shape=MAX_LEVEL + 1)

    @ti.func
    def tick(self, one):
        """Count the tick."""
        self.ticks[self.schedule.low[None]] += 1

    @ti.func
    def bond(self, b):
        """Charge the master of a bond that is due."""
        self.counts[self.tables.bond_slots[b][0] >> 2, self.schedule.low[None]][0] += 1

    @ti.func
    def pair(self, p):
        """Charge the first body of a contact pair that is due."""
        place = self.contacts.pair_body[p][0], self.schedule.low[None]
        self.counts[place][1] += 1
        self.counts[place][2] += self.contacts.pair_last[p] - self.contacts.pair_first[p]

    def take(self):
        """Counts (bodies, classes, kinds) and ticks (classes,) since the last time; then zero."""
        taken = self.counts.to_numpy(), self.ticks.to_numpy()
        self.counts.fill(0)
        self.ticks.fill(0)
        return taken


class CountedStep(Step):
    """A step that counts what is due before it is evaluated; in one serial kernel only."""

    def __init__(self, counter, *parts):
        self.counter = counter
        super().__init__(*parts)

    def _parts(self):
        counter, schedule = self.counter, self.schedule
        (phases,) = super()._parts()
        return (
            (
                (schedule.pairs, counter.pair),
                *phases,
                (Once(), counter.tick),
                (schedule.bonds, counter.bond),
            ),
        )


@dataclass(frozen=True, eq=False)
class Record:
    """Costs of a run, an entry an interval.

    time: at the end of each [s]. counts: (intervals, bodies, classes, kinds). ticks: (intervals,
    classes). seconds: CPU time of each. searches: contact searches in each.
    """

    time: np.ndarray
    counts: np.ndarray
    ticks: np.ndarray
    seconds: np.ndarray
    searches: np.ndarray

    def prices(self):
        """Seconds a bond, a pair, a pair of spheres, a tick, and a search, fitted to the intervals.

        What a bond costs contains what its bodies do, as both are due together.
        """
        work = self.counts.sum(axis=(1, 2)).astype(float)
        # As shares of each interval: early ones tell what a bond costs, late ones what a pair does.
        seconds = np.maximum(self.seconds, 1e-12)[:, None]
        table = np.column_stack([work, self.ticks.sum(axis=1), self.searches]) / seconds
        scale = table.max(axis=0)
        scale[scale == 0.0] = 1.0
        fitted, _ = nnls(table / scale, np.ones(len(table)))
        return fitted / scale


class Intervals:
    """Observer that takes what has been counted, a row an interval of some largest steps."""

    def __init__(self, simulation, counter, every):
        self.when, self.simulation, self.counter = Every(steps=every), simulation, counter
        self.rows, self.before = [], np.zeros(2)

    def observe(self, view):
        """End an interval; what was counted before the first step belongs to none."""
        taken, now = self.counter.take(), np.array([view.cpu_seconds, self.simulation.searches])
        if view.step > 0:
            self.rows.append((view.time_s, *taken, *(now - self.before)))
            self.before = now


def record(scene, method, until, every, progress):
    """Run a scene and count, in intervals of some largest steps: (Record, Simulation).

    The run is stopped between two steps only, so its bits are those of an undisturbed one.
    """
    simulation = Simulation(scene, method, "resident")
    counter, engine = Counter(simulation), simulation.loan.engine
    step = CountedStep(counter, engine.advance, engine.schedule, engine.broad_phase)
    simulation.driver = Resident(step)
    made = Intervals(simulation, counter, every)
    run_simulation(simulation, until=until, samples=1, progress=progress, observers=[made])
    time_s, counts, ticks, seconds, searches = map(np.array, zip(*made.rows))
    used = 1 + int(np.flatnonzero(ticks.any(axis=0)).max())
    return Record(time_s, counts[:, :, :used], ticks[:, :used], seconds, searches), simulation
