"""The clock of a run and the levels of its bodies: who is due at a tick, and until when."""

from typing import Any

import numpy as np
import taichi as ti

from taichi_dem.contact.contacts import Contacts
from taichi_dem.kit.allocation import assign, raise_to, values
from taichi_dem.kit.ordered import Once, Phases
from taichi_dem.kit.types import real
from taichi_dem.methods import Method
from taichi_dem.stability.body_limits import StabilityLimits
from taichi_dem.state.model import Model
from taichi_dem.state.state import State
from taichi_dem.state.tables import Tables
from taichi_dem.state.timeline import MACRO_TICKS, MAX_LEVEL, coarsest_active, ticks_of
from taichi_dem.step.multirate.active_lists import ActiveLists
from taichi_dem.step.multirate.levels import AppliedUntil, LevelLimit
from taichi_dem.step.sleeping import Sleeping
from taichi_dem.step.waking import Waking
from taichi_dem.step_control import DISPLACEMENT, LARGEST, NEIGHBOUR


@ti.data_oriented
class Schedule:
    """Clock of a run, levels of its bodies, and the lists of what is due.

    criterion: the method's rule from ``step_control``. uniform: all bodies share the finest level
    wanted.
    finest: finest level present. undivided: 1 once it was the last one, below which no step is
    divided further. low: coarsest level active now.
    limits: the ``StabilityLimits`` of the bodies, None where the rule needs none. controlled:
    whether they choose the steps, and bodies may be brought to the present between their own times;
    applied_until then holds the time up to which bonds and pairs have applied their impulses.
    every_bond_acts: whether each that holds does in every substep: its impulse then replaces the
    last one, which its bodies have taken, instead of being added to it.
    level_limit: largest difference of levels between neighbours. evaluations: substeps, bodies
    advanced, bonds and pairs evaluated, and the bonds and pairs that one step for all would have
    evaluated in the same substeps, and the bonds whose laws were called.
    """

    def __init__(self, tables: Tables, state: State, contacts: Contacts | None, method: Method):
        self.tables, self.state, self.contacts = tables, state, contacts
        self.has_limits = method.control is not None or method.dashpot == "limited"
        self.limits: Any = None
        if self.has_limits:
            self.limits = StabilityLimits(tables, state, contacts, method)
        self.sleeps = tables.on_demand
        self.sleeping = Sleeping(tables, state) if self.sleeps else None
        self.controlled, self.uniform = method.control is not None, method.uniform
        self.every_bond_acts = self.uniform and not self.controlled and not self.sleeps
        self.step_seconds = ti.field(real, shape=MAX_LEVEL + 1)
        self.store, self.has_contact = getattr(contacts, "store", None), contacts is not None
        self.criterion = method.criterion()
        self.low, self.finest, self.undivided, self.wanted = (
            ti.field(ti.i32, shape=()) for _ in range(4)
        )
        self.evaluations = ti.field(ti.i64, shape=6)
        self.lists = ActiveLists(self, method.neighbour == "drifted")
        self.waking = Waking(self) if self.sleeps else None
        self.applied_until = AppliedUntil(self) if self.controlled else None
        self.spreads = self.controlled and not self.uniform and self.limits.spreads
        self.level_limit = LevelLimit(self) if self.spreads else None

    def load(self, model: Model, method: Method, sleep: float) -> None:
        """Load the steps of a method; sleep: see ``Scene``."""
        assign(self.step_seconds, method.dt0 / 2.0 ** np.arange(MAX_LEVEL + 1))
        # A user-defined rule may have no numbers to load.
        getattr(self.criterion, "load", lambda *_: None)(method.distance, method.dt0)
        if self.has_limits:
            self.limits.load(model, method)
        if self.sleeping is not None:
            self.sleeping.load(model, sleep)

    @property
    def dt0(self) -> float:
        """Largest step [s]."""
        return float(values(self.step_seconds)[0])

    @property
    def tick_seconds(self) -> float:
        """Seconds of a tick."""
        return self.dt0 / MACRO_TICKS

    @property
    def time_s(self) -> float:
        """Present time [s]."""
        return int(values(self.state.tick)) * self.tick_seconds

    @ti.func
    def pair_step(self, i, j):
        """Time [s] until a pair of bodies is evaluated again: the smaller of their steps."""
        return self.step_seconds[ti.max(self.state.level[i], self.state.level[j])]

    @ti.func
    def own_step(self, i):
        """Step of body i [s]."""
        return self.step_seconds[self.state.level[i]]

    @ti.func
    def elapsed(self, i):
        """Seconds since body i was last advanced."""
        return self.seconds(self.state.tick[None] - self.state.last_tick[i])

    @ti.func
    def seconds(self, tick):
        """Time of a tick [s]."""
        return ti.cast(tick, real) * self.step_seconds[MAX_LEVEL]

    @ti.func
    def advance_clock(self, one):
        """Move the clock to the next tick at which a body is active."""
        if ti.static(self.has_contact):
            pairs = self.lists.pairs
            self.evaluations[3] = self.evaluations[3] + pairs.end[self.low[None]]
            self.evaluations[4] = self.evaluations[4] + pairs.end[0]
        self.state.tick[None] = self.state.tick[None] + ticks_of(self.finest[None])
        self.low[None] = coarsest_active(self.state.tick[None])
        self.wanted[None] = 0
        if ti.static(self.has_limits and not self.controlled and not self.has_contact):
            self.forget(0)

    @ti.func
    def choose_level(self, i, speed2):
        """Choose the level of body i, if the present is one of its own times."""
        low, level = self.low[None], self.state.level[i]
        if level >= low:
            wanted = low
            if ti.static(self.controlled):
                wanted, bound = self.controlled_level(i)
                wanted = ti.max(wanted, low)
                self.state.bound[i] = bound
            else:
                wanted = self.criterion.wanted(level, speed2, low)
                self.state.bound[i] = ti.select(wanted > 0, DISPLACEMENT, LARGEST)
            if ti.static(self.uniform):
                raise_to(self.wanted, wanted)
            elif wanted != level:
                self.state.level[i] = wanted
                self.lists.note_change(i)

    @ti.func
    def controlled_level(self, i):
        """Level that the rates and the neighbours of body i require, and its criterion."""
        wanted, bound = self.limits.wanted(i, self.seconds(self.state.tick[None]))
        if ti.static(self.spreads):
            # Neighbours are visited only where the finest level of all could bind.
            if self.level_limit.least_beside(self.finest[None]) > wanted:
                least = self.level_limit.least(i)
                if least > wanted:
                    wanted, bound = least, NEIGHBOUR
        return wanted, bound

    def reordering(self) -> Phases:
        """Phases that bring changed members to their places, and count a tick's evaluations."""
        return self._rearranging(self.reorder, self.end_reordering)

    def applying(self) -> Phases:
        """Phases that do so after bodies have been brought to the present, and clear their list."""
        if self.controlled:
            return ((Once(), self.forget), *self._rearranging(self.rearrange, self.end_listing))
        # Without contact nothing is noted before the clock moves on.
        return ((Once(), self.forget),) if self.has_limits and self.has_contact else ()

    def _rearranging(self, move, end) -> Phases:
        before: Phases = ((self.lists.changes, self.spread),) if self.spreads else ()
        if self.sleeps:
            before += ((self.waking, self.waking.admit_in_step),)
        return self.lists.reordering(move, end, *before)

    def pair_phases(self) -> Phases:
        """Phases that take in the pairs of a new contact search; neighbours may reach further.

        All lists are filled again, which restores contiguous visits; moving entries destroys them
        with time (5 % of the time of a run).
        """
        if self.sleeps:
            return self.waking.search_phases()
        return self.lists.filling(*((self.lists.pairs,) if self.uniform else ()))

    @ti.func
    def forget(self, one):
        """Empty the list of bodies whose rates have been updated."""
        self.limits.listed_count[None] = 0

    @ti.func
    def reorder(self, one):
        """Move the entries of changed bodies, and count the evaluations of this tick."""
        self.rearrange(0)
        self._count_tick()

    @ti.func
    def end_reordering(self, one):
        """The same where all members have been listed."""
        self.end_listing(0)
        self._count_tick()

    @ti.func
    def _count_tick(self):
        low, bodies, bonds = self.low[None], self.lists.bodies, self.lists.bonds
        self.evaluations[0] = self.evaluations[0] + 1
        self.evaluations[1] = self.evaluations[1] + bodies.count(low)
        self.evaluations[2] = self.evaluations[2] + bonds.count(low)
        self.evaluations[4] = self.evaluations[4] + bonds.end[0]
        self.evaluations[5] = self.evaluations[5] + bonds.count(low)

    @ti.func
    def rearrange(self, one):
        """Move the entries of changed bodies."""
        if ti.static(self.uniform):
            self.level_all(0)
        if ti.static(self.sleeps):
            self.waking.admit()
        for a in range(self.lists.changed_count[None]):
            self.lists.move_entries(self.lists.changed[a])
            if ti.static(self.spreads):
                self.spread(a)
        self.lists.changed_count[None] = 0
        self._find_finest()

    @ti.func
    def spread(self, a):
        """List bodies that are too coarse beside one that has changed."""
        self.level_limit.spread(self.lists.changed[a])

    @ti.func
    def end_listing(self, one):
        """All members are listed: none has changed or been woken since."""
        self.lists.changed_count[None] = 0
        if ti.static(self.sleeps):
            self.sleeping.starting[None], self.sleeping.woken_count[None] = 0, 0
        self._find_finest()

    @ti.func
    def level_all(self, one):
        """Set every body to the finest level that any of them wants."""
        if self.wanted[None] != self.state.level[0]:
            for i in range(self.tables.body_count[None]):
                self.state.level[i] = self.wanted[None]

    @ti.func
    def _find_finest(self):
        if ti.static(self.uniform):
            self.finest[None] = self.wanted[None]
        else:
            self.finest[None] = self.lists.finest()
        if self.finest[None] == MAX_LEVEL:
            self.undivided[None] = 1

    @ti.func
    def count_sweep(self, with_bonds: ti.template()):
        """Count the visits of a sweep over all dashpots as evaluations."""
        visits = ti.cast(0, ti.i64)
        if ti.static(with_bonds):
            visits += self.lists.bonds.end[0]
            self.evaluations[2] = self.evaluations[2] + visits
        if ti.static(self.has_contact):
            self.evaluations[3] = self.evaluations[3] + self.lists.pairs.end[0]
            visits += self.lists.pairs.end[0]
        self.evaluations[4] = self.evaluations[4] + visits
