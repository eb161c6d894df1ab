"""Which pairs of the Verlet list are near, and the order in which they are visited."""

import taichi as ti

from taichi_dem.contact.cell_grid import group
from taichi_dem.contact.contacts import Contacts
from taichi_dem.contact.verlet_list import VerletList


@ti.data_oriented
class NearPairs:
    """Sorts the near pairs of a ``PairStore``: those with sphere pairs, or with a pending impulse.

    neighbours: the ``VerletList``, whose rows are in order. Of body i: row: slots of its near
    pairs, from neighbours.first[i] on; row_count: their number; row_spheres: number of their sphere
    pairs; row_is_new: 1 where they may have changed. full: 1 or 2 when there is no capacity for
    pairs or for sphere pairs.
    """

    scratch_fields = ("row_is_new",)

    def __init__(self, contacts: Contacts, neighbours: VerletList):
        self.tables, self.contacts, self.store = contacts.tables, contacts, contacts.store
        self.neighbours = neighbours
        n = self.tables.capacity.bodies
        self.row = ti.field(ti.i32, shape=neighbours.capacity)
        self.row_count, self.row_spheres = (ti.field(ti.i32, shape=n) for _ in range(2))
        self.row_is_new = ti.field(ti.i32, shape=n)
        self.full = ti.field(ti.i32, shape=())

    @ti.func
    def number(self, free: ti.template(), count):
        """Number the near pairs in order; new ones get slots, others lose theirs.

        free: the bodies that can touch others, count of them; the rest are in no pair.
        """
        for a in range(count):
            i = free[a]
            self.row_is_new[i] = self.neighbours.changed[i]
            if self.row_is_new[i] == 1:
                self._renew_row(i)
        self._count_rows()
        if self.full[None] != 0:
            self._clear_order()

    @ti.func
    def _renew_row(self, i):
        """List the near pairs of which body i is the first."""
        start, count, spheres, waiting = self.neighbours.first[i], 0, 0, 0
        for k in range(start, self.neighbours.last[i]):
            p, found = self.neighbours.slot[k], self.neighbours.found[k]
            stays = found > 0
            if p >= 0 and found == 0:
                stays = self.store.waits(p)
                waiting |= ti.cast(stays, ti.i32)
                if not stays:
                    self.store.release(p)
                    self.neighbours.slot[k] = -1
            if stays:
                self.row[start + count] = self._slot_of(k, i)
                count += 1
                spheres += found
        self.row_count[i], self.row_spheres[i] = count, spheres
        # Pairs that only hold a pending impulse leave at the next search.
        self.neighbours.changed[i] = waiting

    @ti.func
    def _slot_of(self, k, i):
        """Slot of entry k of body i, new or not, with places for sphere pairs just found."""
        p = self.neighbours.slot[k]
        if p < 0:
            p = self.store.allocate(i, self.neighbours.body[k])
            self.neighbours.slot[k] = p
        if p < 0:
            self.full[None] = 1
        elif self.neighbours.is_new[k] == 1:
            if self.store.reserve_spheres(p, self.neighbours.found[k]) == 1:
                self.full[None] = 2
        return p

    @ti.func
    def _count_rows(self):
        pairs, spheres = 0, 0
        for i in range(self.tables.body_count[None]):
            self.store.first_of[i] = pairs
            if self.contacts.free[i] == 1:
                pairs += self.row_count[i]
                spheres += self.row_spheres[i]
        self.store.first_of[self.tables.body_count[None]] = pairs
        self.store.near_count[None], self.store.sphere_count[None] = pairs, spheres

    @ti.func
    def _clear_order(self):
        """List nothing: the run ends with an error."""
        self.store.near_count[None] = 0
        for i in range(self.tables.body_count[None] + 1):
            self.store.first_of[i] = 0

    @ti.func
    def put_row(self, i):
        """Put the near pairs of body i where they are visited."""
        start, first = self.neighbours.first[i], self.store.first_of[i]
        for k in range(self.row_count[i]):
            self.store.near_slot[first + k] = self.row[start + k]

    @ti.func
    def index_second(self):
        """List for every body the near pairs in which it is second, in order."""
        start, slots, count = ti.static(
            self.store.second_start, self.store.second_slot, self.store.near_count
        )
        group(start, slots, self.tables.body_count[None], count[None], self._second_of)
        for a in range(count[None]):
            slots[a] = self.store.near_slot[slots[a]]

    @ti.func
    def _second_of(self, a):
        return self.store.body[self.store.near_slot[a]][1]
