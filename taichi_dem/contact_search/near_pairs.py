"""Which pairs of the Verlet list are near, and the order in which they are visited."""

import taichi as ti

from taichi_dem.contact_search.cell_grid import group


@ti.data_oriented
class NearPairs:
    """Sorts the near pairs of a ``PairStore``: those with sphere pairs, or an impulse waiting.

    neighbours: the ``VerletList``, whose rows are in order. Of body i: row: slots of its near
    pairs, from neighbours.first[i] on; row_count: how many there are, row_spheres: number of their
    sphere pairs; row_is_new: 1 where they may be others than before. full: 1 or 2 when there is no
    capacity for pairs or for sphere pairs.
    """

    scratch_fields = ("row_is_new",)

    def __init__(self, contacts, neighbours):
        self.model, self.contacts, self.store = contacts.model, contacts, contacts.store
        self.neighbours = neighbours
        n = self.model.body_count
        self.row = ti.field(ti.i32, shape=2 * neighbours.capacity)
        self.row_count, self.row_spheres = (ti.field(ti.i32, shape=n) for _ in range(2))
        self.row_is_new = ti.field(ti.i32, shape=n)
        self.full = ti.field(ti.i32, shape=())

    @ti.func
    def update_row(self, i):
        """List the near pairs of which body i is the first, where they may be others."""
        self.row_is_new[i] = self.neighbours.changed[i]
        if self.row_is_new[i] == 1:
            start, count, spheres, waiting = self.neighbours.first[i], 0, 0, 0
            for k in range(start, self.neighbours.last[i]):
                p = self.neighbours.slot[k]
                found = self.store.found[p]
                if found > 0 or self.store.waits(p):
                    self.row[start + count] = p
                    count += 1
                    spheres += found
                    waiting |= ti.cast(found == 0, ti.i32)
                elif self.store.is_near[p] == 1:
                    self.store.leave(p)
            self.row_count[i], self.row_spheres[i] = count, spheres
            # Pairs that merely wait leave at the next search.
            self.neighbours.changed[i] = waiting

    @ti.func
    def number(self, exposed: ti.template(), count):
        """Number the near pairs in order, and give those with new spheres places for them.

        exposed: the bodies with spheres, count of them: others are in no pair, now or before.
        """
        self._count_rows()
        if self.store.near_count[None] > self.store.near_pairs:
            self.full[None] = 1
        else:
            for a in range(count):
                self._reserve_row(exposed[a])
        if self.full[None] != 0:
            self._clear_order()

    @ti.func
    def _count_rows(self):
        pairs, spheres = 0, 0
        for i in range(self.model.body_count):
            self.store.first_of[i] = pairs
            if self.contacts.exposed_faces[i] != 0:
                pairs += self.row_count[i]
                spheres += self.row_spheres[i]
        self.store.first_of[self.model.body_count] = pairs
        self.store.near_count[None], self.store.sphere_count[None] = pairs, spheres

    @ti.func
    def _reserve_row(self, i):
        if self.row_is_new[i] == 1:
            start = self.neighbours.first[i]
            for k in range(start, start + self.row_count[i]):
                if self.store.new_faces[self.row[k]] != 0:
                    if self.store.reserve_spheres(self.row[k]) == 1:
                        self.full[None] = 2

    @ti.func
    def _clear_order(self):
        """List nothing: the run ends with an error."""
        self.store.near_count[None] = 0
        for i in range(self.model.body_count + 1):
            self.store.first_of[i] = 0

    @ti.func
    def listed_count(self, i):
        """Number of near pairs of which body i is the first; 0 where lists are full."""
        return ti.select(self.full[None] == 0, self.row_count[i], 0)

    @ti.func
    def put(self, i, k):
        """Put the k-th near pair of body i where it is visited; its slot."""
        p = self.row[self.neighbours.first[i] + k]
        self.store.near_slot[self.store.first_of[i] + k] = p
        return p

    @ti.func
    def index_second(self):
        """List for every body the near pairs in which it is second, in order."""
        start, slots, count = ti.static(
            self.store.second_start, self.store.second_slot, self.store.near_count
        )
        group(start, slots, self.model.body_count, count[None], self._second_of)
        for a in range(count[None]):
            slots[a] = self.store.near_slot[slots[a]]

    @ti.func
    def _second_of(self, a):
        return self.store.body[self.store.near_slot[a]][1]
