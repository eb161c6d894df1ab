"""Lists of the bodies, bonds and pairs that are due at each level, and how they follow changes."""

from typing import Any

import taichi as ti

from taichi_dem.kit import backend
from taichi_dem.kit.ordered import Once, OnlyIf, Phases, Some, side_by_side
from taichi_dem.state.timeline import MAX_LEVEL
from taichi_dem.step.multirate.clock import Clock
from taichi_dem.step.multirate.lists import ActiveList, Everyone
from taichi_dem.step.sleeping import ASLEEP


@ti.data_oriented
class ActiveLists:
    """Bodies, bonds and pairs by the level at which they are due."""

    def __init__(self, clock: Clock, drifted: bool):
        self.drifted = drifted
        self.tables, self.state, self.contacts = clock.tables, clock.state, clock.contacts
        self.uniform = clock.uniform
        self.sleeps, self.sleeping = clock.sleeps, clock.sleeping
        self.store, self.has_contact = clock.store, clock.has_contact
        capacity, bodies = self.tables.capacity, self.tables.body_count
        bonds = Everyone(self.tables.bond_count, capacity.bonds)
        self.bodies = ActiveList(Everyone(bodies, capacity.bodies), self.body_key)
        self.bonds = ActiveList(bonds, self.bond_key)
        self.pairs = ActiveList(Everyone(bodies, 1), self.pair_key)
        self.beside: tuple = ()
        self.all: tuple[ActiveList, ...] = self.bodies, self.bonds
        if self.has_contact:
            # Pairs of which a body is the first, then those of which it is the second.
            as_second = self.store.second_start, self.store.second_slot, 0
            self.beside = (self.store.first_of, self.store.near_slot, 1), as_second
            near = Everyone(self.store.near_count, self.store.slots, self.store.near_slot)
            self.pairs = ActiveList(near, self.pair_key)
            self.all = *self.all, self.pairs
        self.changed_count = ti.field(ti.i32, shape=())
        self.changed = ti.field(ti.i32, shape=2 * capacity.bodies + 2 * capacity.bonds + 1)

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
                if not self.sleeping.both_awake(i, j) and self.sleeping.starting[None] == 0:
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
    def note_change(self, i):
        """Note that body i has another level, or has lost a bond."""
        self.changed[ti.atomic_add(self.changed_count[None], 1)] = i

    def filling(self, *lists: ActiveList) -> Phases:
        """Phases that list all members of some lists anew, or of all lists."""
        return side_by_side(*(active.listing.phases for active in lists or self.all))

    def reordering(self, move: Any, end: Any, *before: Any) -> Phases:
        """Phases that bring changed members to their places, after phases before."""
        if backend.is_cpu() or self.uniform:
            return ((Once(), move),)
        due = tuple((OnlyIf(self._has_changed, phase), item) for phase, item in self.filling())
        return (*before, *due, (Once(), end))

    @ti.func
    def _has_changed(self):
        """1 where a member has another key than when it was listed."""
        changed = self.changed_count[None]
        if ti.static(self.sleeps):
            changed += self.sleeping.woken_count[None]
        return ti.cast(changed > 0, ti.i32)

    @property
    def changes(self) -> Some:
        """List of the places of changed bodies."""
        return Some(self._changed_count, self.changed.shape[0])

    @ti.func
    def _changed_count(self):
        return self.changed_count[None]

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

    @ti.func
    def finest(self):
        """Finest level of a listed body."""
        finest = MAX_LEVEL
        while finest > 0 and self.bodies.end[finest] == 0:
            finest -= 1
        return finest
