"""Keys of bodies, bonds and pairs by which they are listed, and how listed members move.

And what bodies that touch owe each other: how far levels differ, how far impulses reach.
"""

from typing import Any

import taichi as ti

from taichi_dem.stability.body_limits import CLOSE
from taichi_dem.state.timeline import MAX_LEVEL, ticks_of
from taichi_dem.step.sleeping import ASLEEP


@ti.data_oriented
class Members:
    """Base of ``Schedule``, which owns all that is used here."""

    @ti.func
    def bond_key(self, b):
        """Finer level of the bodies of an intact bond, -1 for one that is not evaluated."""
        key = -1
        if self.state.broken_tick[b] < 0:
            slots = self.tables.bond_slots[b]
            i, j = slots[0] >> 2, slots[1] >> 2
            key = self._key(i, j)
            if ti.static(self.sleeps):
                # At the start those that sleep act once.
                if not self.sleeping.both_awake(i, j) and self.starting[None] == 0:
                    key = -1
        return key

    @ti.func
    def pair_key(self, p):
        """Finer level of the bodies of a pair."""
        pair = self.store.body[p]
        return self._key(pair[0], pair[1])

    @ti.func
    def body_key(self, i):
        """Own level, or the finest level among those it touches where neighbours drift along."""
        key = self._key(i, i)
        if ti.static(self.drifted):
            for f in range(4):
                j = self.tables.neighbour[4 * i + f]
                if j >= 0:
                    if self.state.broken_tick[self.tables.face_bond[4 * i + f]] < 0:
                        key = ti.max(key, self.state.level[j])
            if ti.static(self.has_contact):
                key = ti.max(key, self.contacts.finest_partner(i))
        if ti.static(self.sleeps):
            if self.sleeping.awake[i] == ASLEEP:
                key = -1
        return key

    @ti.func
    def _key(self, i, j):
        """Finer level of two bodies; where all step alike, all are active at every tick."""
        key = MAX_LEVEL
        if ti.static(not self.uniform):
            key = ti.max(self.state.level[i], self.state.level[j])
        return key

    @ti.func
    def admit_woken(self):
        """List the bodies woken since the last call, and the bonds that now act."""
        sleeping = self.sleeping
        for a in range(sleeping.woken_count[None]):
            i = sleeping.woken[a]
            self.bodies.insert(i)
            for f in range(4):
                b = self.tables.face_bond[4 * i + f]
                if b >= 0:
                    if self.bonds.insert(b):
                        sleeping.left_out[b] = sleeping.left_out_now(b, self.seconds(1), True)
        sleeping.unsorted[None] = sleeping.unsorted[None] + sleeping.woken_count[None]
        sleeping.woken_count[None] = 0

    @ti.func
    def admit_in_search(self, a):
        """Note what the bonds of a body woken by a search have left out, before all are listed."""
        self._admit(a, False)

    @ti.func
    def admit_in_step(self, a):
        """The same in a step, in which bodies have moved since bonds were evaluated."""
        self._admit(a, True)

    @ti.func
    def _admit(self, a, moved: ti.template()):
        sleeping, i = self.sleeping, self.sleeping.woken[a]
        for f in range(4):
            b = self.tables.face_bond[4 * i + f]
            if b >= 0:
                if self.bonds.key[b] < 0 and self.bond_key(b) >= 0:
                    sleeping.left_out[b] = sleeping.left_out_now(b, self.seconds(1), moved)

    @ti.func
    def woken_count(self):
        """Number of bodies woken since they were listed."""
        return self.sleeping.woken_count[None]

    @ti.func
    def end_listing(self, one):
        """All members are listed: none has changed or been woken since."""
        self.changed_count[None] = 0
        if ti.static(self.sleeps):
            self.starting[None], self.sleeping.woken_count[None] = 0, 0
        self._find_finest()

    @ti.func
    def sort_woken(self, one):
        """Renew the bound of sleep; bring bodies woken of late into the order of the others."""
        if self.sleeping.is_due():
            self.sleeping.renew_bound()
            if self.sleeping.unsorted[None] > 0:
                self.sleeping.unsorted[None] = 0
                self.bodies.listing.sort()
                self.bonds.listing.sort()

    @ti.func
    def move_entries(self, i):
        """Move body i, its bonds and its pairs to their present keys."""
        self.bodies.renew(i)
        for f in range(4):
            b = self.tables.face_bond[4 * i + f]
            if b >= 0:
                if self.bonds.key[b] >= 0:
                    self.bonds.renew(b)
                if ti.static(self.drifted):
                    j = self.tables.neighbour[4 * i + f]
                    self.bodies.renew(j)
        for first, slots, other in ti.static(self.beside):
            for k in range(first[i], first[i + 1]):
                self.pairs.renew(slots[k])
                if ti.static(self.drifted):
                    j = self.store.body[slots[k]][other]
                    self.bodies.renew(j)


@ti.data_oriented
class LevelLimit:
    """A body takes a level at most jump below the finest of the bodies that it touches.

    It touches those to which it is bonded and those with which contacts are near. listed_level:
    levels at the last ordering of the lists, so that no result depends on the order of bodies.
    """

    def __init__(self, schedule: Any):
        self.tables, self.state, self.limits = schedule.tables, schedule.state, schedule.limits
        self.store, self.beside = schedule.store, schedule.beside
        self.listed_level = ti.field(ti.i32, shape=self.tables.capacity.bodies)

    @ti.func
    def least(self, i):
        """Coarsest level that body i may have beside those it touches; negative for any."""
        return self.least_beside(self._visit(i, 0, False))

    @ti.func
    def least_beside(self, finest):
        """Coarsest level that a body may have beside one of a level."""
        return finest - self.limits.jump[None]

    @ti.func
    def spread(self, i):
        """Note the level of body i, and list those it touches that are too coarse."""
        self.note(i)
        self._visit(i, self.state.level[i], True)

    @ti.func
    def note(self, i):
        """Note the level of body i."""
        self.listed_level[i] = self.state.level[i]

    @ti.func
    def _visit(self, i, level, lists: ti.template()):
        """Finest listed level of the bodies that body i touches, -1 for none."""
        finest = -1
        for f in range(4):
            if self._bonded(4 * i + f):
                j = self.tables.neighbour[4 * i + f]
                finest = ti.max(finest, self._visit_one(j, level, lists))
        for first, slots, other in ti.static(self.beside):
            for k in range(first[i], first[i + 1]):
                if self.limits.contact_limits.count[slots[k]] > 0:
                    j = self.store.body[slots[k]][other]
                    finest = ti.max(finest, self._visit_one(j, level, lists))
        return finest

    @ti.func
    def _visit_one(self, j, level, lists: ti.template()):
        if ti.static(lists):
            if self.state.level[j] < self.least_beside(level):
                self.limits.notice(j, CLOSE)
        return self.listed_level[j]

    @ti.func
    def _bonded(self, face):
        bonded = False
        if self.tables.neighbour[face] >= 0:
            bonded = self.state.broken_tick[self.tables.face_bond[face]] < 0
        return bonded


@ti.data_oriented
class AppliedUntil:
    """Tick up to which each bond and pair has applied its impulse, where bodies may be woken early.

    A bond applies its impulse for the coming step of the finer body at once. When that body is
    woken and takes a shorter step, the bond becomes active although its impulse reaches ahead of
    the clock: it applies no more until that tick. This is a time of the coarser step and so of any
    finer one: no impulse is ever applied in part.
    bond, pair: that tick for every bond, and for every slot of the pair store.
    """

    def __init__(self, schedule: Any):
        self.state = schedule.state
        self.bond = ti.field(ti.i64, shape=schedule.tables.capacity.bonds)
        if schedule.has_contact:
            self.pair = schedule.store.column("applied_until", ti.i64)

    @ti.func
    def until(self, i, j):
        """Tick at which a pair of bodies is evaluated again."""
        finer = ti.max(self.state.level[i], self.state.level[j])
        return self.state.tick[None] + ticks_of(finer)
