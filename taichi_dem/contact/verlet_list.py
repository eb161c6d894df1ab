"""Verlet list of the contact search: bodies that are near each other, within several skins.

It contains all bodies, free or not, so one list serves many searches.

Of its pairs those that are near are visited, in order.
"""

import taichi as ti

from taichi_dem.contact.cell_grid import CellGrid, Reach, group
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
    def allot(self, one):
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
