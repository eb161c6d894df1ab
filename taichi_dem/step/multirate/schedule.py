"""Schedule: levels of bodies, and lists of active bodies, bonds and pairs by falling level.

Levels change seldom compared with their use, so a change of a body's level moves only its own
entries.
"""

from typing import Any

import numpy as np
import taichi as ti

from taichi_dem.contact.contacts import Contacts
from taichi_dem.kit import backend
from taichi_dem.kit.allocation import assign, raise_to, values
from taichi_dem.kit.ordered import Once, Phases, Some, When, side_by_side
from taichi_dem.kit.types import real
from taichi_dem.methods import Method
from taichi_dem.stability.body_limits import StabilityLimits
from taichi_dem.state.model import Model
from taichi_dem.state.state import State
from taichi_dem.state.tables import Tables
from taichi_dem.state.timeline import MACRO_TICKS, MAX_LEVEL, coarsest_active, ticks_of
from taichi_dem.step.multirate.lists import ActiveList, Everyone
from taichi_dem.step.multirate.members import AppliedUntil, LevelLimit, Members
from taichi_dem.step.sleeping import Sleeping
from taichi_dem.step_control import DISPLACEMENT, LARGEST, NEIGHBOUR


@ti.data_oriented
class Schedule(Members):
    """Clock and active lists of a run.

    criterion: the method's rule from ``step_control``. uniform: all bodies share the finest level
    wanted. drifted: neighbours of an active body are brought to its time too, else only active ones
    move.
    finest: finest level present. undivided: 1 once it was the last one, below which no step is
    divided further. low: coarsest level active now. changed: bodies whose own level or
    bonds changed since the lists were ordered.
    limits: the ``StabilityLimits`` of the bodies, None where the rule needs none. controlled:
    whether they choose the steps, and bodies may be brought to the present between their own times;
    applied_until then holds the time up to which bonds and pairs have applied their impulses.
    every_bond_acts: whether each that holds does in every substep: its impulse then replaces the
    last one, which its bodies have taken, instead of being added to it.
    beside: where the pairs of a body begin, their slots, and the place of the other body in them.
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
        self.beside: tuple = ()
        self.pairs = ActiveList(Everyone(tables.body_count, 1), self.pair_key)
        if self.store is not None:
            # Pairs of which a body is the first, then those of which it is the second.
            as_second = self.store.second_start, self.store.second_slot, 0
            self.beside = (self.store.first_of, self.store.near_slot, 1), as_second
            near = Everyone(self.store.near_count, self.store.slots, self.store.near_slot)
            self.pairs = ActiveList(near, self.pair_key)
        self.applied_until = AppliedUntil(self) if self.controlled else None
        self.spreads = self.controlled and not self.uniform and self.limits.spreads
        if self.spreads:
            self.level_limit = LevelLimit(self)
        self.criterion, self.drifted = method.criterion(), method.neighbour == "drifted"
        capacity = tables.capacity
        bodies, bonds = tables.body_count, tables.bond_count
        self.bodies = ActiveList(Everyone(bodies, capacity.bodies), self.body_key)
        self.bonds = ActiveList(Everyone(bonds, capacity.bonds), self.bond_key)
        self.low, self.finest, self.undivided = (ti.field(ti.i32, shape=()) for _ in range(3))
        self.wanted, self.changed_count = (ti.field(ti.i32, shape=()) for _ in range(2))
        self.changed = ti.field(ti.i32, shape=2 * capacity.bodies + 2 * capacity.bonds + 1)
        self.evaluations = ti.field(ti.i64, shape=6)
        self._lists = (self.bodies, self.bonds, *([self.pairs] if self.has_contact else []))
        if self.sleeps:
            self.starting = ti.field(ti.i32, shape=())
            self._woken = Some(self.woken_count, capacity.bodies)

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
            self.evaluations[3] = self.evaluations[3] + self.pairs.end[self.low[None]]
            self.evaluations[4] = self.evaluations[4] + self.pairs.end[0]
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
                self.note_change(i)

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

    @ti.func
    def note_change(self, i):
        """Note that body i has another level, or has lost a bond."""
        self.changed[ti.atomic_add(self.changed_count[None], 1)] = i

    def reordering(self) -> Phases:
        """Phases that bring changed members to their places, and count a tick's evaluations."""
        return self._rearranging(self.reorder, self.end_reordering)

    def applying(self) -> Phases:
        """Phases that do so after bodies have been brought to the present, and clear their list."""
        if self.controlled:
            return ((Once(), self.forget), *self._rearranging(self.rearrange, self.end_listing))
        # Without contact nothing is noted before the clock moves on.
        return ((Once(), self.forget),) if self.has_contact else ()

    def _rearranging(self, move, end) -> Phases:
        """A CPU moves members that have changed; a GPU, of which one thread is slow, lists all."""
        if backend.is_cpu() or self.uniform:
            return ((Once(), move),)
        phases: Phases = ()
        if self.spreads:
            changed = Some(self._changed_count, self.changed.shape[0])
            phases += ((changed, self.spread),)
        if self.sleeps:
            phases += ((self._woken, self.admit_in_step),)
        listing = self._listing(*self._lists)
        due = tuple((When(self._has_changed, members), item) for members, item in listing)
        return (*phases, *due, (Once(), end))

    @ti.func
    def _has_changed(self):
        """1 where a member has another key than when it was listed."""
        changed = self.changed_count[None]
        if ti.static(self.sleeps):
            changed += self.woken_count()
        return ti.cast(changed > 0, ti.i32)

    def _listing(self, *lists):
        return side_by_side(*(one.listing.phases for one in lists))

    def start_phases(self) -> Phases:
        """Phases that fill all lists at the start of a run."""
        phases: Phases = ((Once(), self.begin_lists),)
        if self.spreads:
            phases += ((self.bodies.everyone, self.level_limit.note),)
        return (*phases, *self._listing(*self._lists), (Once(), self.end_listing))

    def start_end_phases(self) -> Phases:
        """Phases after the bonds have acted once: those that sleep leave the list."""
        return self._listing(self.bodies, self.bonds) if self.sleeps else ()

    def pair_phases(self) -> Phases:
        """Phases that take in the pairs of a new contact search; neighbours may reach further."""
        phases: Phases = ()
        end: Phases = ()
        if self.sleeps:
            near = self.pairs.everyone
            phases = (near, self.awaken_pair), (self._woken, self.admit_in_search)
            end = ((Once(), self.end_search),)
        if self.uniform and not self.sleeps:
            return self._listing(self.pairs)
        return (*phases, *self._listing(*self._lists), *end)

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
        low = self.low[None]
        self.evaluations[0] = self.evaluations[0] + 1
        self.evaluations[1] = self.evaluations[1] + self.bodies.count(low)
        self.evaluations[2] = self.evaluations[2] + self.bonds.count(low)
        self.evaluations[4] = self.evaluations[4] + self.bonds.end[0]
        self.evaluations[5] = self.evaluations[5] + self.bonds.count(low)

    @ti.func
    def rearrange(self, one):
        """Move the entries of changed bodies."""
        if ti.static(self.uniform):
            self._level_all()
        if ti.static(self.sleeps):
            self.admit_woken()
        for a in range(self.changed_count[None]):
            self.move_entries(self.changed[a])
            if ti.static(self.spreads):
                self.spread(a)
        self.changed_count[None] = 0
        self._find_finest()

    @ti.func
    def spread(self, a):
        """List bodies that are too coarse beside one that has changed."""
        self.level_limit.spread(self.changed[a])

    @ti.func
    def _changed_count(self):
        return self.changed_count[None]

    @ti.func
    def begin_lists(self, one):
        """Give all bodies one level where they have one only; bonds that sleep act once."""
        if ti.static(self.uniform):
            self._level_all()
        if ti.static(self.sleeps):
            self.starting[None] = 1

    @ti.func
    def end_search(self, one):
        """The bodies woken by a search are listed."""
        self.sleeping.woken_count[None] = 0

    @ti.func
    def awaken_pair(self, p):
        """Wake both bodies of a pair."""
        for side in ti.static(range(2)):
            self.sleeping.awaken(self.store.body[p][side])

    @ti.func
    def _level_all(self):
        """Set every body to the finest level that any of them wants."""
        if self.wanted[None] != self.state.level[0]:
            for i in range(self.tables.body_count[None]):
                self.state.level[i] = self.wanted[None]

    @ti.func
    def _find_finest(self):
        if ti.static(self.uniform):
            self.finest[None] = self.wanted[None]
        else:
            finest = MAX_LEVEL
            while finest > 0 and self.bodies.end[finest] == 0:
                finest -= 1
            self.finest[None] = finest
        if self.finest[None] == MAX_LEVEL:
            self.undivided[None] = 1

    @ti.func
    def count_sweep(self, with_bonds: ti.template()):
        """Count the visits of a sweep over all dashpots as evaluations."""
        visits = ti.cast(0, ti.i64)
        if ti.static(with_bonds):
            visits += self.bonds.end[0]
            self.evaluations[2] = self.evaluations[2] + visits
        if ti.static(self.has_contact):
            self.evaluations[3] = self.evaluations[3] + self.pairs.end[0]
            visits += self.pairs.end[0]
        self.evaluations[4] = self.evaluations[4] + visits
