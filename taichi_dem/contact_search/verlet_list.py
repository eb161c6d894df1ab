"""Verlet list of the contact search: faces that come near each other while the block hardly moves.

It reaches several skins and takes in every face, broken or not, so one list serves many searches.
"""

import taichi as ti

from taichi_dem.contact_search.cell_grid import CellGrid
from taichi_dem.contact_search.reach import Reach
from taichi_dem.kit.allocation import defer_fill

#: What the list is when it needs to be made anew, and while it is.
STALE, MAKING = 1, 2
#: Room left behind the neighbours of each body, for fast ones that come.
SPARE = 16
#: Bodies that leave their reach at once, at most, to be listed anew one by one.
MOST_ESCAPED = 1024
#: Share of its body skin that a body may use up before a search looks at it.
FAR = 0.6


@ti.data_oriented
class VerletList:
    """For each body the bodies of higher index near it, in order.

    first[i] .. last[i]: row of body i, with some room behind. Of an entry: body; slot: of the pair
    in the ``PairStore``, -1 until it gets one; faces: which faces are near, bit 4 f + g for faces f
    and g. A list that is made anew is written into the other half of these fields, so that pairs
    that stay find their slots; old_first, old_last: the rows before. start: of the half in use.
    changed: 1 for a body the near pairs of whose row may be others.
    reach: the ``Reach`` that bodies may not leave. stale: STALE when all rows are to be made anew.
    full: 1 when there is no capacity.
    """

    scratch_fields = ("old_first", "old_last")

    def __init__(self, contacts, brute_force=False):
        n = contacts.model.body_count
        self.model, self.state, self.contacts = contacts.model, contacts.state, contacts
        self.store, self.capacity = contacts.store, contacts.neighbour_capacity
        self.reach = Reach(contacts)
        self.grid = CellGrid(self.model, self.state, self.reach.ball, brute_force)
        self.first = ti.field(ti.i32, shape=n + 1)
        self.last = ti.field(ti.i32, shape=n)
        self.old_first, self.old_last = (ti.field(ti.i32, shape=n) for _ in range(2))
        self.body, self.slot, self.faces = (
            ti.field(ti.i32, shape=2 * self.capacity) for _ in range(3)
        )
        self.start = ti.field(ti.i32, shape=())
        self.changed = ti.field(ti.i32, shape=n)
        self.stale = ti.field(ti.i32, shape=())
        self.full = ti.field(ti.i32, shape=())
        defer_fill(self.stale.fill, STALE)

    def clear(self):
        """Forget all neighbours; the next search lists them anew."""
        self.first.fill(0)
        self.last.fill(0)
        self.stale.fill(STALE)

    @ti.func
    def begin(self):
        """See whether so many bodies have left their reach that the list is made anew."""
        self.full[None] = 0
        if self.reach.escaped_count[None] > ti.min(self.model.body_count // 16, MOST_ESCAPED):
            self.stale[None] = STALE
        if self.stale[None] == STALE:
            self.stale[None] = MAKING

    @ti.func
    def making(self):
        """1 while the list is made anew."""
        return ti.cast(self.stale[None] == MAKING, ti.i32)

    @ti.func
    def amending(self):
        """1 while bodies that have escaped are listed anew."""
        return ti.cast(self.stale[None] != MAKING and self.reach.escaped_count[None] > 0, ti.i32)

    @ti.func
    def list_anew(self, i):
        """Note where body i is, and its row."""
        self.contacts.set_body_skin(i)
        self.reach.note_place(i)
        self.old_first[i], self.old_last[i] = self.first[i], self.last[i]

    @ti.func
    def count(self, i):
        """Count the neighbours of body i, and the pairs that may have to stay."""
        waiting = 0
        for k in range(self.old_first[i], self.old_last[i]):
            waiting += ti.cast(self.store.waits(self.slot[k]), ti.i32)
        self.first[i + 1] = self._visit(i, 0, False) + waiting + SPARE

    @ti.func
    def allot(self):
        """Give every body its part of the list."""
        self.start[None] = self.capacity - self.start[None]
        self.first[0] = self.start[None]
        for i in range(self.model.body_count):
            self.first[i + 1] = self.first[i + 1] + self.first[i]
        if self.first[self.model.body_count] - self.start[None] > self.capacity:
            self.full[None] = 1
            for i in range(self.model.body_count + 1):
                self.first[i] = self.start[None]
        for i in range(self.model.body_count):
            self.last[i] = self.first[i]

    @ti.func
    def fill(self, i):
        """List the neighbours of body i, when there is room; pairs that were listed stay so."""
        self.changed[i] = 1
        if self.full[None] == 0:
            self.last[i] = self.first[i] + self._visit(i, self.first[i], True)
            for k in range(self.old_first[i], self.old_last[i]):
                self._list_again(i, k)

    @ti.func
    def _list_again(self, i, k):
        """Give entry k of the row before its slot in the new one, or free it if it may go."""
        j, p = self.body[k], self.slot[k]
        place = self._find_row_index(i, j)
        self.store.forget_search(p)
        if self._is_listed(i, place, j):
            self.slot[place] = p
        elif self.store.waits(p):
            self._insert(self.first[i], self.last[i], j, 0, p)
            self.last[i] = self.last[i] + 1
        else:
            self.store.release(p)

    @ti.func
    def assign_slots(self, i):
        """Give the new neighbours of body i their slots, when there is room."""
        for k in range(self.first[i], self.last[i]):
            if self.slot[k] < 0:
                self.slot[k] = self.store.allocate(i, self.body[k])
                if self.slot[k] < 0:
                    self.full[None] = 1

    @ti.func
    def amend(self, i):
        """List those that have escaped where they are now, among the neighbours of body i.

        Entries where they were stay while there is room: nothing comes of them but a look. A row
        without room leaves the list stale.
        """
        if self.reach.left[i] == 1:
            for j in range(i + 1, self.model.body_count):
                self._add(i, j)
        else:
            for a in range(self.reach.escaped_count[None]):
                if self.reach.escaped[a] > i:
                    self._add(i, self.reach.escaped[a])

    @ti.func
    def _add(self, i, j):
        """List body j as neighbour of body i, if it is one, with the faces that are near.

        Without room in its row or in the store the list is stale.
        """
        faces = 0
        if self.reach.balls_near(i, j):
            faces = self.reach.faces_near(i, j)
        if faces != 0:
            place = self._find_row_index(i, j)
            if self._is_listed(i, place, j):
                self.faces[place] = faces
            else:
                self._drop_far(i)
                p = -1
                if self.last[i] < self.first[i + 1]:
                    p = self.store.allocate(i, j)
                if p >= 0:
                    self._insert(self.first[i], self.last[i], j, faces, p)
                    self.last[i] = self.last[i] + 1
                else:
                    self.stale[None] = STALE

    @ti.func
    def _is_listed(self, i, place, j):
        """Whether the entry at a place in the row of body i is body j."""
        return place < self.last[i] and self.body[ti.min(place, 2 * self.capacity - 1)] == j

    @ti.func
    def _drop_far(self, i):
        """Drop those that are near body i no more when its row is full, unless something waits."""
        if self.last[i] == self.first[i + 1]:
            place = self.first[i]
            for k in range(self.first[i], self.last[i]):
                near, p = self.reach.faces_near(i, self.body[k]) != 0, self.slot[k]
                if near or self.store.waits(p):
                    self._move(k, place)
                    place += 1
                else:
                    self.store.release(p)
                if not near:
                    self.store.forget_search(p)
                    self.changed[i] = 1
            self.last[i] = place

    @ti.func
    def _find_row_index(self, i, j):
        """First place among the neighbours of body i whose body is not before j."""
        low, high = self.first[i], self.last[i]
        while low < high:
            middle = (low + high) // 2
            if self.body[middle] < j:
                low = middle + 1
            else:
                high = middle
        return low

    @ti.func
    def end(self):
        """The list serves until a body has left its reach."""
        self.reach.end()
        if self.stale[None] == MAKING:
            self.stale[None] = ti.select(self.full[None] == 1, STALE, 0)

    @ti.func
    def _visit(self, i, start, write):
        """Number of neighbours of body i; writes them in order from start on."""
        count = 0
        low, high = self.grid.around(i)
        for z in range(low[2], high[2]):
            for y in range(low[1], high[1]):
                first, last = self.grid.row(z, y, low[0], high[0])
                for k in range(first, last):
                    j = self.grid.member[k]
                    if j > i and self.reach.balls_near(i, j):
                        faces = self.reach.faces_near(i, j)
                        if faces != 0:
                            if write:
                                self._insert(start, start + count, j, faces, -1)
                            count += 1
        return count

    @ti.func
    def _insert(self, start, end, j, faces, p):
        """Enter body j, with which a body has slot p, into its row from start to end, in order."""
        place = end
        while place > start and self.body[ti.max(place - 1, 0)] > j:
            self._move(place - 1, place)
            place -= 1
        self.body[place], self.faces[place], self.slot[place] = j, faces, p

    @ti.func
    def _move(self, k, place):
        self.body[place] = self.body[k]
        self.faces[place], self.slot[place] = self.faces[k], self.slot[k]
