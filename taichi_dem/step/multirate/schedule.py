"""Levels of the bodies: who is due at a tick, which level comes next, and how lists follow."""

import taichi as ti

from taichi_dem.contact.contacts import Contacts
from taichi_dem.kit.allocation import raise_to
from taichi_dem.kit.ordered import Once, Phases
from taichi_dem.methods import Method
from taichi_dem.state.model import Model
from taichi_dem.state.state import State
from taichi_dem.state.tables import Tables
from taichi_dem.state.timeline import MAX_LEVEL, coarsest_active, ticks_of
from taichi_dem.step.multirate.active_lists import ActiveLists
from taichi_dem.step.multirate.clock import Clock
from taichi_dem.step.multirate.levels import AppliedUntil, LevelLimit
from taichi_dem.step.waking import Waking
from taichi_dem.step_control import DISPLACEMENT, LARGEST, NEIGHBOUR


@ti.data_oriented
class Schedule(Clock):
    """Levels of the bodies, and the lists of what is due.

    criterion: the method's rule from ``step_control``. undivided: 1 once the finest level of all
    was reached. applied_until: time up to which bonds and pairs have applied their impulses, where
    bodies may be woken. level_limit: largest difference of levels between neighbours.
    """

    def __init__(self, tables: Tables, state: State, contacts: Contacts | None, method: Method):
        super().__init__(tables, state, contacts, method)
        self.criterion = method.criterion()
        self.undivided, self.wanted = (ti.field(ti.i32, shape=()) for _ in range(2))
        self.lists = ActiveLists(self, method.neighbour == "drifted")
        self.waking = Waking(self, self.lists) if self.sleeps else None
        self.applied_until = AppliedUntil(self) if self.controlled else None
        self.spreads = self.controlled and not self.uniform and self.limits.spreads
        self.level_limit = LevelLimit(self, self.lists) if self.spreads else None

    def upload(self, model: Model, method: Method, sleep: float) -> None:
        """Upload the steps of a method; sleep: see ``Scene``."""
        super().upload(model, method, sleep)
        # A user-defined rule may have no numbers to upload.
        getattr(self.criterion, "upload", lambda *_: None)(method.distance, method.dt0)

    @ti.func
    def advance_clock(self, item):
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
        """Phases that take in the pairs of a new contact search; neighbours may reach further."""
        if self.sleeps:
            return self.waking.search_phases()
        return self.lists.filling(*((self.lists.pairs,) if self.uniform else ()))

    @ti.func
    def forget(self, item):
        """Empty the list of bodies whose rates have been updated."""
        self.limits.listed_count[None] = 0

    @ti.func
    def reorder(self, item):
        """Move the entries of changed bodies, and count the evaluations of this tick."""
        self.rearrange(0)
        self._count_tick()

    @ti.func
    def end_reordering(self, item):
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
    def rearrange(self, item):
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
    def end_listing(self, item):
        """All members are listed: none has changed or been woken since."""
        self.lists.changed_count[None] = 0
        if ti.static(self.sleeps):
            self.sleeping.starting[None], self.sleeping.woken_count[None] = 0, 0
        self._find_finest()

    @ti.func
    def level_all(self, item):
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
