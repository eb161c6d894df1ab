"""The list of contact pairs before a search, and what the new one takes over from it."""

import taichi as ti

from taichi_dem.kit.types import real, vec3


@ti.data_oriented
class OldPairs:
    """A copy of the pairs of a ``Contacts`` with what waits in their slots.

    Fields have the names of those they copy. first_of: first pair of each body then. former: place
    here of each pair of the new list, -1 for one that is new.
    """

    scratch_fields = ("first_of", "body", "first", "last", "former", "slot", "full", "heat")

    def __init__(self, contacts):
        self.contacts = contacts
        n, pairs = contacts.tables.capacity.bodies, contacts.capacity
        self.first_of = ti.field(ti.i32, shape=n + 1)
        self.body = ti.Vector.field(2, ti.i32, shape=pairs)
        self.first = ti.field(ti.i32, shape=pairs)
        self.last = ti.field(ti.i32, shape=pairs)
        self.former = ti.field(ti.i32, shape=pairs)
        self.slot = ti.Vector.field(6, real, shape=2 * pairs)
        self.full = ti.field(ti.i32, shape=2 * pairs)
        self.heat = ti.Vector.field(3, real, shape=pairs)

    @ti.func
    def keep(self, p):
        """Copy the pair at place p and empty its slots: another may come to this place."""
        self.body[p] = self.contacts.pair_body[p]
        self.first[p], self.last[p] = self.contacts.pair_first[p], self.contacts.pair_last[p]
        for slot in range(2 * p, 2 * p + 2):
            full = self.contacts.pair_full[slot]
            self.full[slot] = full
            if full == 1:
                self.slot[slot] = self.contacts.pair_slot[slot]
                self.contacts.pair_slot[slot] = 0.0 * self.slot[slot]
                self.contacts.pair_full[slot] = 0
        self.heat[p] = self.contacts.pair_heat[p]

    @ti.func
    def place(self, old, last, j):
        """Place old of a row that ends at last if the partner there is body j, else -1."""
        place = -1
        if old < last:
            if self.body[old][1] == j:
                place = old
        return place

    @ti.func
    def waits(self, p):
        """Whether an impulse or heat waits in a slot of an old pair."""
        return self.full[2 * p] == 1 or self.full[2 * p + 1] == 1

    @ti.func
    def hand_over(self, p, injected):
        """Give the new pair p what waits for it, and the energy that its birth injects [J]."""
        old = self.former[p]
        heat = vec3(0.0, 0.0, injected)
        if old >= 0:
            heat += self.heat[old]
            for side in range(2):
                if self.full[2 * old + side] == 1:
                    self.contacts.pair_slot[2 * p + side] = self.slot[2 * old + side]
                    self.contacts.pair_full[2 * p + side] = 1
        self.contacts.pair_heat[p] = heat
        if injected > 0.0:
            self.contacts.pair_full[2 * p] = 1

    @ti.func
    def candidate(self, p, spheres, place):
        """Which of its former candidates a pair of spheres of pair p was, -1 for none of them.

        place: where it was among them, if nothing came or went before it.
        """
        old, found = self.former[p], -1
        if old >= 0:
            first, last = self.first[old], self.last[old]
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
        same = self.contacts.pair_sphere[k] == spheres
        return same.all()
