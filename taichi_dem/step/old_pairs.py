"""The list of contact pairs before a search, and what the new one takes over from it."""

import taichi as ti

from taichi_dem.types import real, vec3


@ti.data_oriented
class OldPairs:
    """A copy of the pairs of a ``Contacts`` with what waits in their slots.

    Fields have the names of those they copy. first_of: first pair of each body then.
    """

    scratch_fields = ("first_of", "body", "first", "sphere", "slot", "full", "heat")

    def __init__(self, contacts):
        self.contacts = contacts
        n, pairs, spheres = contacts.model.body_count, contacts.capacity, contacts.sphere_capacity
        self.first_of = ti.field(ti.i32, shape=n + 1)
        self.body = ti.Vector.field(2, ti.i32, shape=pairs)
        self.first = ti.field(ti.i32, shape=pairs + 1)
        self.sphere = ti.Vector.field(2, ti.i32, shape=spheres)
        self.slot = ti.Vector.field(6, real, shape=2 * pairs)
        self.full = ti.field(ti.i32, shape=2 * pairs)
        self.heat = ti.Vector.field(3, real, shape=pairs)

    @ti.func
    def keep(self, p):
        """Copy the pair at place p."""
        self.body[p] = self.contacts.pair_body[p]
        first, last = self.contacts.pair_first[p], self.contacts.pair_first[p + 1]
        self.first[p] = first
        if p + 1 == self.contacts.pair_count[None]:
            self.first[p + 1] = last
        for k in range(first, last):
            self.sphere[k] = self.contacts.pair_sphere[k]
        for side in ti.static(range(2)):
            self.slot[2 * p + side] = self.contacts.pair_slot[2 * p + side]
            self.full[2 * p + side] = self.contacts.pair_full[2 * p + side]
        self.heat[p] = self.contacts.pair_heat[p]

    @ti.func
    def place(self, i, j):
        """Place of a pair of bodies in the old list, -1 if it was not there."""
        place = -1
        for p in range(self.first_of[i], self.first_of[i + 1]):
            if self.body[p][1] == j:
                place = p
        return place

    @ti.func
    def waits(self, p):
        """Whether an impulse or heat waits in a slot of an old pair."""
        return self.full[2 * p] == 1 or self.full[2 * p + 1] == 1

    @ti.func
    def hand_over(self, p, old, injected):
        """Give the new pair p what waits for it; old: its former place, or -1; injected [J]."""
        for side in ti.static(range(2)):
            waiting, full = 0.0 * self.contacts.pair_slot[2 * p + side], 0
            if old >= 0:
                waiting, full = self.slot[2 * old + side], self.full[2 * old + side]
            self.contacts.pair_slot[2 * p + side] = waiting
            self.contacts.pair_full[2 * p + side] = full
        heat = vec3(0.0, 0.0, injected)
        if old >= 0:
            heat += self.heat[old]
        self.contacts.pair_heat[p] = heat
        if injected > 0.0:
            self.contacts.pair_full[2 * p] = 1

    @ti.func
    def copy_spheres(self, p, old):
        """Give the new pair p the spheres that it had."""
        start = self.contacts.pair_first[p]
        for k in range(start, self.contacts.pair_first[p + 1]):
            self.contacts.pair_sphere[k] = self.sphere[self.first[old] + k - start]

    @ti.func
    def candidate(self, old, spheres, place):
        """Which of the candidates of an old pair a pair of spheres was, -1 for none of them.

        place: where it was, if nothing came or went before it.
        """
        found = -1
        if old >= 0:
            first, last = self.first[old], self.first[old + 1]
            if first + place < last:
                if self._is(first + place, spheres):
                    found = first + place
            if found < 0:
                for k in range(first, last):
                    if self._is(k, spheres):
                        found = k
        return found

    @ti.func
    def _is(self, k, spheres):
        same = self.sphere[k] == spheres
        return same.all()
