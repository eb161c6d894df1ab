"""Verlet list of the contact search: bodies that are near each other, within several skins."""

import taichi as ti

from taichi_dem.contact.cell_grid import CellGrid, Reach
from taichi_dem.contact.contacts import Contacts
from taichi_dem.kit.allocation import assign
from taichi_dem.kit.ordered import Grouping, RunningSums, Some
from taichi_dem.kit.types import ivec3, real

#: State of the list when it must be rebuilt, and while it is being rebuilt.
STALE, MAKING = 1, 2
#: Spare entries in the row of each body, for fast bodies that come near.
SPARE = 16
#: Most escaped bodies that are listed again one by one.
MOST_ESCAPED = 1024


@ti.data_oriented
class VerletList:
    """For each body the bodies of higher index near it, in order."""

    scratch_fields = ("wanted",)

    def __init__(self, contacts: Contacts):
        n = contacts.tables.capacity.bodies
        self.tables, self.state, self.contacts = contacts.tables, contacts.state, contacts
        self.store, self.capacity = contacts.store, contacts.tables.capacity.neighbour_entries
        self.reach = Reach(contacts)
        self.grid = CellGrid(self.tables, self.reach, self.listed_anew)
        self.first = ti.field(ti.i32, shape=n + 1)
        self.last, self.changed = (ti.field(ti.i32, shape=n) for _ in range(2))
        # Apart, as every search reads the bodies of all entries, and little else of most.
        self.until = ti.field(real, shape=self.capacity)
        self.body, self.slot, self.found, self.is_new = (
            ti.field(ti.i32, shape=self.capacity) for _ in range(4)
        )
        self.stale = ti.field(ti.i32, shape=())
        self.lacking = ti.field(ti.i32, shape=())
        self.wanted = ti.field(ti.i32, shape=n)
        allotted = self._wanted, self._allot, self._end_allotting
        self.allotting = RunningSums(Some(self.listed_anew, n), 1, *allotted)

    def forget(self) -> None:
        """The next search rebuilds the list."""
        assign(self.stale, STALE)

    def renew_all(self) -> None:
        """The next search renews the pairs of all rows."""
        assign(self.changed, 1)

    @ti.func
    def begin(self, free):
        """Decide whether the list is rebuilt; free: number of bodies that others can touch."""
        self.lacking[None] = 0
        if self.reach.escaped_count[None] > ti.min(
            self.tables.body_count[None] // 16, MOST_ESCAPED
        ):
            self.stale[None] = STALE
        # A solid in one piece has no use of it before its first break.
        if self.stale[None] == STALE and free > 0:
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
        self.wanted[i] = self._visit(i, 0, False) + ti.max(near, SPARE)

    @ti.func
    def listed_anew(self):
        """Number of bodies whose rows are being rebuilt: all or none."""
        return self.making() * self.tables.body_count[None]

    @ti.func
    def _wanted(self, i):
        return ti.Vector([self.wanted[i]])

    @ti.func
    def _allot(self, i, before, value):
        self.first[i], self.last[i] = before[0], before[0]

    @ti.func
    def _end_allotting(self, total):
        self.first[self.tables.body_count[None]] = total[0]

    @ti.func
    def check_room(self, item):
        """Empty all rows where they exceed the room, and note how long they would be."""
        if self.making() == 1:
            n = self.tables.body_count[None]
            if self.first[n] > self.capacity:
                self.lacking[None] = self.first[n]
                for i in range(n):
                    self.first[i], self.last[i] = 0, 0
                self.first[n] = 0

    @ti.func
    def fill(self, i):
        """List the neighbours of body i, when there is room; near pairs keep their slots."""
        self.changed[i] = 1
        if self.lacking[None] == 0:
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
        """List the escaped bodies at their present positions, among the neighbours of body i."""
        # Outdated entries stay while there is room: they cost one comparison. A full row makes the
        # list stale.
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
        """Drop entries that are no longer near body i when its row is full."""
        # Pairs that were near stay until they have lost their slot.
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
            self.stale[None] = ti.select(self.lacking[None] > 0, STALE, 0)

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
        self.found[k], self.is_new[k], self.until[k] = 0, 0, 0.0

    @ti.func
    def _move(self, k, place):
        self.body[place], self.slot[place] = self.body[k], self.slot[k]
        self.found[place], self.is_new[place] = self.found[k], self.is_new[k]
        self.until[place] = self.until[k]

    @ti.func
    def note_found(self, k, i, count, until, keeps):
        """Note the contacts of entry k of body i, and up to which paths there are no others [m]."""
        if self.found[k] + count > 0 and not keeps:
            self.changed[i], self.is_new[k] = 1, ti.cast(count > 0, ti.i32)
        self.found[k], self.until[k] = count, until


@ti.data_oriented
class NearPairs:
    """Sorts the pairs of a ``PairStore`` that are near or have an impulse pending."""

    scratch_fields = ("row_is_new", "wanted", "total", "begin")

    def __init__(self, contacts: Contacts, neighbours: VerletList):
        self.tables, self.contacts, self.store = contacts.tables, contacts, contacts.store
        self.neighbours = neighbours
        n = self.tables.capacity.bodies
        self.row = ti.field(ti.i32, shape=neighbours.capacity)
        self.row_count, self.row_spheres = (ti.field(ti.i32, shape=n) for _ in range(2))
        self.row_is_new, self.begin = (ti.field(ti.i32, shape=n) for _ in range(2))
        self.wanted = ti.Vector.field(3, ti.i32, shape=n)
        self.total = ti.Vector.field(3, ti.i32, shape=())
        self.lacking = ti.Vector.field(2, ti.i32, shape=())
        self.full = ti.field(ti.i32, shape=())
        bodies = Some(self._body_count, n, light=True)
        rows = self._row_sums, self._begin_row, self._end_rows
        self.numbering = RunningSums(bodies, 5, *rows)
        # For every body the near pairs in which it is second, in order.
        self.second = Grouping(
            self.store.second_start,
            self.store.second_slot,
            bodies,
            Some(self.store.number, self.store.slots, light=True),
            self._second_of,
            self.store.slot_at,
        )

    @ti.func
    def count_row(self, i):
        """Count the near pairs whose first body is i, and the places that they take and free."""
        # Pairs that only hold a pending impulse leave at the next search.
        self.row_is_new[i] = self.neighbours.changed[i]
        self.wanted[i] = ivec3(0)
        if self.row_is_new[i] == 1:
            count, spheres, waiting, wanted = 0, 0, 0, ivec3(0)
            for k in range(self.neighbours.first[i], self.neighbours.last[i]):
                partners = self.neighbours.found[k]
                spheres += partners
                if partners > 0:
                    count += 1
                    wanted[0] += ti.cast(self.neighbours.slot[k] < 0, ti.i32)
                    wanted[1] += partners * self.neighbours.is_new[k]
                elif self._leaves(k):
                    wanted[2] += 1
                elif self.neighbours.slot[k] >= 0:
                    count += 1
                    waiting = 1
            self.row_count[i], self.row_spheres[i], self.wanted[i] = count, spheres, wanted
            self.neighbours.changed[i] = waiting

    @ti.func
    def _body_count(self):
        return self.tables.body_count[None]

    @ti.func
    def _row_sums(self, i):
        sums = ti.Vector.zero(ti.i32, 5)
        if self.contacts.free[i] == 1:
            wanted = self.wanted[i]
            sums[0], sums[1] = self.row_count[i], self.row_spheres[i]
            sums[2], sums[3], sums[4] = wanted[0], wanted[1], wanted[2]
        return sums

    @ti.func
    def _begin_row(self, i, before, value):
        self.begin[i] = before[0]
        self.wanted[i] = ivec3(before[2], before[3], before[4])

    @ti.func
    def _end_rows(self, total):
        """Find whether there is room for all, and take over their numbers."""
        slots, places = self.store.slots_with(total[2], total[4]), self.store.places_with(total[3])
        self.lacking[None] = [0, 0]
        self.full[None] = ti.cast(self.neighbours.lacking[None] > 0, ti.i32)
        if slots > self.store.slots or places > self.store.spheres:
            self.lacking[None], self.full[None] = [slots, places], 1
        if self.full[None] == 0:
            self.store.first_of[self.tables.body_count[None]] = total[0]
            self.store.near_count[None], self.store.sphere_count[None] = total[0], total[1]
            self.total[None] = ivec3(total[2], total[3], total[4])

    @ti.func
    def place_row(self, i):
        """Take over where the pairs of body i begin, when there is room."""
        if self.full[None] == 0:
            self.store.first_of[i] = self.begin[i]

    @ti.func
    def release(self, i):
        """Free the slots of pairs of body i that are near no longer, when its row changes."""
        if self.full[None] == 0 and self.row_is_new[i] == 1:
            place = self.wanted[i][2]
            for k in range(self.neighbours.first[i], self.neighbours.last[i]):
                if self._leaves(k):
                    self.store.release(self.neighbours.slot[k], place)
                    self.neighbours.slot[k] = -1
                    place += 1

    @ti.func
    def _leaves(self, k):
        """Whether entry k gives its slot back: nothing of the pair is near, and nothing waits."""
        p, leaves = self.neighbours.slot[k], False
        if p >= 0 and self.neighbours.found[k] == 0:
            leaves = not self.store.waits(p)
        return leaves

    @ti.func
    def renew_row(self, i):
        """List the near pairs of which body i is the first, new ones in slots of their own."""
        start, count, wanted = self.neighbours.first[i], 0, self.wanted[i]
        fresh, place = wanted[0], self.store.sphere_end[None] + wanted[1]
        for k in range(start, self.neighbours.last[i]):
            p, partners = self.neighbours.slot[k], self.neighbours.found[k]
            if p < 0 and partners > 0:
                p = self.store.allocate(fresh, self.total[None][2], i, self.neighbours.body[k])
                self.neighbours.slot[k] = p
                fresh += 1
            if p >= 0:
                if partners > 0 and self.neighbours.is_new[k] == 1:
                    self.store.reserve_spheres(p, place)
                    place += partners
                self.row[start + count] = p
                count += 1

    @ti.func
    def end(self):
        """Take over what rows have taken and freed."""
        if self.full[None] == 0:
            total = self.total[None]
            self.store.take(total[0], total[1], total[2])

    @ti.func
    def put_row(self, i):
        """Put the near pairs of body i where they are visited."""
        start, first = self.neighbours.first[i], self.store.first_of[i]
        for k in range(self.row_count[i]):
            self.store.near_slot[first + k] = self.row[start + k]

    @ti.func
    def _second_of(self, a):
        return self.store.body[self.store.near_slot[a]][1]
