"""What bodies that touch owe each other: how far their levels differ, how far impulses reach."""

from typing import Optional

import taichi as ti

from taichi_dem.contact.contacts import Contacts
from taichi_dem.stability.body_limits import CLOSE, StabilityLimits
from taichi_dem.state.state import State
from taichi_dem.state.tables import Tables
from taichi_dem.state.timeline import ticks_of


@ti.data_oriented
class LevelLimit:
    """A body takes a level at most jump below the finest of the bodies that it touches.

    It touches those to which it is bonded and those with which contacts are near. listed_level:
    levels at the last ordering of the lists, so that no result depends on the order of bodies.
    """

    def __init__(
        self,
        tables: Tables,
        state: State,
        contacts: Optional[Contacts],
        limits: StabilityLimits,
    ):
        self.tables, self.state, self.limits = tables, state, limits
        self.has_contact = contacts is not None
        self.store = contacts.store if self.has_contact else None
        self.listed_level = ti.field(ti.i32, shape=tables.capacity.bodies)

    @ti.func
    def note_all(self):
        """Note the levels of all bodies."""
        for i in range(self.tables.body_count[None]):
            self.listed_level[i] = self.state.level[i]

    @ti.func
    def least(self, i):
        """Coarsest level that body i may have beside those it touches; negative for any."""
        finest = -1
        for f in range(4):
            if self._bonded(4 * i + f):
                finest = ti.max(finest, self.listed_level[self.tables.neighbour[4 * i + f]])
        if ti.static(self.has_contact):
            for k in range(self.store.first_of[i], self.store.first_of[i + 1]):
                p = self.store.near_slot[k]
                if self.limits.contact_limits.count[p] > 0:
                    finest = ti.max(finest, self.listed_level[self.store.body[p][1]])
            for k in range(self.store.second_start[i], self.store.second_start[i + 1]):
                p = self.store.second_slot[k]
                if self.limits.contact_limits.count[p] > 0:
                    finest = ti.max(finest, self.listed_level[self.store.body[p][0]])
        return self.least_beside(finest)

    @ti.func
    def least_beside(self, finest):
        """Coarsest level that a body may have beside one of a level."""
        return finest - self.limits.jump[None]

    @ti.func
    def spread(self, i):
        """Note the level of body i, and list those it touches that are too coarse."""
        level = self.state.level[i]
        self.listed_level[i] = level
        for f in range(4):
            if self._bonded(4 * i + f):
                self._notify(self.tables.neighbour[4 * i + f], level)
        if ti.static(self.has_contact):
            for k in range(self.store.first_of[i], self.store.first_of[i + 1]):
                p = self.store.near_slot[k]
                if self.limits.contact_limits.count[p] > 0:
                    self._notify(self.store.body[p][1], level)
            for k in range(self.store.second_start[i], self.store.second_start[i + 1]):
                p = self.store.second_slot[k]
                if self.limits.contact_limits.count[p] > 0:
                    self._notify(self.store.body[p][0], level)

    @ti.func
    def _bonded(self, face):
        bonded = False
        if self.tables.neighbour[face] >= 0:
            bonded = self.state.broken_tick[self.tables.face_bond[face]] < 0
        return bonded

    @ti.func
    def _notify(self, j, level):
        if self.state.level[j] < level - self.limits.jump[None]:
            self.limits.notice(j, CLOSE)


@ti.data_oriented
class AppliedUntil:
    """Tick up to which each bond and pair has applied its impulse, where bodies may be woken early.

    A bond applies its impulse for the coming step of the finer body at once. When that body is
    woken and takes a shorter step, the bond becomes active although its impulse reaches ahead of
    the clock: it applies no more until that tick. This is a time of the coarser step and so of any
    finer one: no impulse is ever applied in part.
    bond, pair: that tick for every bond, and for every slot of the pair store. step_seconds: step
    of each level [s].
    """

    def __init__(
        self, tables: Tables, state: State, step_seconds: ti.Field, contacts: Optional[Contacts]
    ):
        self.state, self.step_seconds = state, step_seconds
        self.bond = ti.field(ti.i64, shape=tables.capacity.bonds)
        if contacts is not None:
            self.pair = contacts.store.column("applied_until", ti.i64)

    @ti.func
    def is_pending(self, b, i, j):
        """Whether bond b has yet to apply its impulse for the coming step of its two bodies."""
        return self.bond[b] < self._until(i, j)

    @ti.func
    def apply_bond(self, b, i, j):
        """Seconds for which a pending bond applies its force now; records them as applied."""
        self.bond[b] = self._until(i, j)
        return self._step(i, j)

    @ti.func
    def apply_pair(self, p, i, j):
        """The same for a pair in contact; 0 where it has applied its impulse already."""
        dt, until = 0.0, self._until(i, j)
        if self.pair[p] < until:
            dt = self._step(i, j)
            self.pair[p] = until
        return dt

    @ti.func
    def _step(self, i, j):
        return self.step_seconds[ti.max(self.state.level[i], self.state.level[j])]

    @ti.func
    def _until(self, i, j):
        """Tick at which a pair of bodies is evaluated again."""
        finer = ti.max(self.state.level[i], self.state.level[j])
        return self.state.tick[None] + ticks_of(finer)
