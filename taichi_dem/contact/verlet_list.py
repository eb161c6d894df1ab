"""Verlet list of the contact search: bodies that are near each other, within several skins.

It contains all bodies, free or not, so one list serves many searches.
"""

import taichi as ti

from taichi_dem.contact.cell_grid import CellGrid, Reach
from taichi_dem.contact.contacts import Contacts
from taichi_dem.kit.allocation import assign
from taichi_dem.kit.types import real
from taichi_dem.methods import Method
from taichi_dem.state.capacity import SPARE_NEIGHBOURS
from taichi_dem.state.model import Model

#: State of the list when it must be rebuilt, and while it is being rebuilt.
STALE, MAKING = 1, 2
#: Spare entries in the row of each body, for fast bodies that come near.
SPARE = 16
#: Most escaped bodies that are listed again one by one.
MOST_ESCAPED = 1024


@ti.data_oriented
class VerletList:
    """For each body the bodies of higher index near it, in order.

    first[i] .. last[i]: row of body i, followed by spare entries. Of an entry: body: the second of
    the two; slot: of the pair in the store, -1 while it is not near; until: sum of the paths of
    both up to which nothing of them can touch but what the pair holds [m]; found: number of its
    contacts; is_new: 1 while they are not written yet. changed: 1 for a row whose near pairs may
    have changed.
    reach: the ``Reach`` that bodies may not leave. stale: STALE when all rows are to be rebuilt.
    limit: entries that the scene allows. full: 1 when they are exceeded.
    """

    def __init__(self, contacts: Contacts):
        n = contacts.tables.capacity.bodies
        self.tables, self.state, self.contacts = contacts.tables, contacts.state, contacts
        self.store, self.capacity = contacts.store, contacts.tables.capacity.neighbour_entries
        self.limit = ti.field(ti.i32, shape=())
        self.reach = Reach(contacts)
        self.grid = CellGrid(self.tables, self.reach)
        self.first = ti.field(ti.i32, shape=n + 1)
        self.last, self.changed = (ti.field(ti.i32, shape=n) for _ in range(2))
        # Stored contiguously: every search reads many entries that are no longer in the cache.
        read = [ti.field(ti.i32), ti.field(real)]
        ti.root.dense(ti.i, self.capacity).place(*read)
        self.body, self.until = read
        self.slot, self.found, self.is_new = (
            ti.field(ti.i32, shape=self.capacity) for _ in range(3)
        )
        self.stale = ti.field(ti.i32, shape=())
        self.full = ti.field(ti.i32, shape=())

    def load(self, model: Model, method: Method) -> None:
        """Set the limit of a scene; the next search rebuilds the list."""
        assign(self.stale, STALE)
        each = model.contact.neighbours_per_body
        assign(self.limit, model.body_count * each + SPARE_NEIGHBOURS)

    def clear(self) -> None:
        """Forget all neighbours; the next search rebuilds the list."""
        for field in (self.first, self.last):
            assign(field, 0)
        assign(self.stale, STALE)

    @ti.func
    def begin(self):
        """Decide whether so many bodies have left their reach that the list is rebuilt."""
        self.full[None] = 0
        if self.reach.escaped_count[None] > ti.min(
            self.tables.body_count[None] // 16, MOST_ESCAPED
        ):
            self.stale[None] = STALE
        if self.stale[None] == STALE:
            self.stale[None] = MAKING

    @ti.func
    def making(self):
        """1 while the list is being rebuilt."""
        return ti.cast(self.stale[None] == MAKING, ti.i32)

    @ti.func
    def amending(self):
        """1 while escaped bodies are being listed again."""
        return ti.cast(self.stale[None] != MAKING and self.reach.escaped_count[None] > 0, ti.i32)

    @ti.func
    def list_anew(self, i):
        """Note where body i is."""
        self.contacts.set_body_skin(i)
        self.reach.note_place(i)

    @ti.func
    def count(self, i):
        """Count the neighbours of body i; near pairs that are none of them find room besides."""
        near = self.store.first_of[i + 1] - self.store.first_of[i]
        self.first[i + 1] = self._visit(i, 0, False) + ti.max(near, SPARE)

    @ti.func
    def allot(self):
        """Allot a row of the list to every body."""
        self.first[0] = 0
        for i in range(self.tables.body_count[None]):
            self.first[i + 1] = self.first[i + 1] + self.first[i]
        if self.first[self.tables.body_count[None]] > self.limit[None]:
            self.full[None] = 1
            for i in range(self.tables.body_count[None] + 1):
                self.first[i] = 0
        for i in range(self.tables.body_count[None]):
            self.last[i] = self.first[i]

    @ti.func
    def fill(self, i):
        """List the neighbours of body i, when there is room; near pairs keep their slots."""
        self.changed[i] = 1
        if self.full[None] == 0:
            self.last[i] = self.first[i] + self._visit(i, self.first[i], True)
            for a in range(self.store.first_of[i], self.store.first_of[i + 1]):
                self._list_near(i, self.store.near_slot[a])

    @ti.func
    def _list_near(self, i, p):
        """Enter the slot of a pair that was near into the row of body i."""
        j = self.store.body[p][1]
        place = self._find_row_index(i, j)
        if self._is_listed(i, place, j):
            self.slot[place] = p
        else:
            self._insert(self.first[i], self.last[i], j, p)
            self.last[i] = self.last[i] + 1

    @ti.func
    def amend(self, i):
        """List the escaped bodies at their present positions, among the neighbours of body i.

        Outdated entries stay while there is room: they cost a comparison only. A full row leaves
        the list stale.
        """
        escaped, count = self.reach.left[i] == 1, self.reach.escaped_count[None]
        if escaped:
            count = self.tables.body_count[None] - i - 1
        for a in range(count):
            j = i + 1 + a
            if not escaped:
                j = self.reach.escaped[a]
            if j > i and self.reach.are_near(i, j):
                self._add(i, j)

    @ti.func
    def _add(self, i, j):
        """List body j as a neighbour of body i; without room in its row the list is stale."""
        if not self._is_listed(i, self._find_row_index(i, j), j):
            self._drop_far(i)
            if self.last[i] < self.first[i + 1]:
                self._insert(self.first[i], self.last[i], j, -1)
                self.last[i] = self.last[i] + 1
            else:
                self.stale[None] = STALE

    @ti.func
    def _is_listed(self, i, place, j):
        """Whether the entry at a place in the row of body i is body j."""
        return place < self.last[i] and self.body[ti.min(place, self.capacity - 1)] == j

    @ti.func
    def _drop_far(self, i):
        """Drop entries that are no longer near body i when its row is full.

        Pairs that were near stay until they have lost their slot.
        """
        if self.last[i] == self.first[i + 1]:
            place = self.first[i]
            for k in range(self.first[i], self.last[i]):
                near = self.reach.are_near(i, self.body[k])
                if not near:
                    self._forget(k)
                    self.changed[i] = 1
                if near or self.slot[k] >= 0:
                    self._move(k, place)
                    place += 1
            self.last[i] = place

    @ti.func
    def _find_row_index(self, i, j):
        """First place among the neighbours of body i with an index of at least j."""
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
                    if j > i and self.reach.are_near(i, j):
                        if write:
                            self._insert(start, start + count, j, -1)
                        count += 1
        return count

    @ti.func
    def _insert(self, start, end, j, p):
        """Enter body j into a row from start to end, in order; p: slot of the pair, or -1."""
        place = end
        while place > start and self.body[ti.max(place - 1, 0)] > j:
            self._move(place - 1, place)
            place -= 1
        self.body[place], self.slot[place] = j, p
        self._forget(place)

    @ti.func
    def _forget(self, k):
        """Forget the last search of entry k: it has to be compared."""
        self.found[k], self.is_new[k], self.until[k] = 0, 0, 0.0

    @ti.func
    def _move(self, k, place):
        """Move entry k to another place."""
        self.body[place], self.slot[place] = self.body[k], self.slot[k]
        self.found[place], self.is_new[place] = self.found[k], self.is_new[k]
        self.until[place] = self.until[k]

    @ti.func
    def note_found(self, k, i, count, until, keeps):
        """Note the contacts of entry k of body i, and up to which paths there are no others [m].

        keeps: whether those that it has had are the same.
        """
        if self.found[k] + count > 0 and not keeps:
            self.changed[i], self.is_new[k] = 1, ti.cast(count > 0, ti.i32)
        self.found[k], self.until[k] = count, until
