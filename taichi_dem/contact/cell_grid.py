"""Cell grid over the centres of bodies, and how far bodies may move from where they were listed."""

from collections.abc import Callable
from typing import Any

import taichi as ti

from taichi_dem.contact.contacts import Contacts
from taichi_dem.kit.ordered import Chunks, Grouping, Phases, Some
from taichi_dem.kit.products import norm, squared
from taichi_dem.kit.types import real
from taichi_dem.state.tables import Tables

#: Reach of the list around a body, in body skins and in skins: a longer list against fewer of them.
BODY_SKINS, SKINS = 2.0, 3.5
#: Largest steps by which a body is listed ahead of where it is, most of those that leave their
#: reach being adrift, and the share of its reach that this may take.
AHEAD, SHARE = 256.0, 0.8
#: Coordinates beyond this [m], and those that are no number, count as this: a run that diverges is
#: named after the step in which it does, and until then every body must have a cell.
_FAR = 1e30


@ti.data_oriented
class Reach:
    """The positions for which the Verlet list knows the neighbours of each body."""

    def __init__(self, contacts: Contacts):
        n = contacts.tables.capacity.bodies
        self.tables, self.state, self.contacts = contacts.tables, contacts.state, contacts
        self.reach, self.ball = (ti.field(real, shape=n) for _ in range(2))
        self.placed_at = ti.Vector.field(3, real, shape=n)
        self.escaped, self.left = (ti.field(ti.i32, shape=n) for _ in range(2))
        self.escaped_count = ti.field(ti.i32, shape=())

    @ti.func
    def notice(self, i):
        """Note whether body i, which is being searched, has left its reach."""
        moved = norm(self.state.position[i] - self.placed_at[i])
        if not moved + self.contacts.body_skin[i] < self.reach[i]:
            self.left[i] = 1
            self.escaped[ti.atomic_add(self.escaped_count[None], 1)] = i
            self.note_place(i)

    @ti.func
    def note_place(self, i):
        """Note the position of body i, extrapolated at its present velocity."""
        self.reach[i] = BODY_SKINS * self.contacts.body_skin[i] + SKINS * self.contacts.skin[i]
        self.ball[i] = self.tables.extent[i] + self.reach[i]
        ahead = AHEAD * self.contacts.pace[0] * self.state.velocity[i]
        most = SHARE * (self.reach[i] - self.contacts.body_skin[i])
        self.placed_at[i] = self.state.position[i] + ahead * most / ti.max(norm(ahead), most)

    @ti.func
    def end(self):
        """Clear the list of escaped bodies, which have been listed again."""
        for a in range(self.escaped_count[None]):
            self.left[self.escaped[a]] = 0
        self.escaped_count[None] = 0

    @ti.func
    def are_near(self, i, j):
        """Whether the balls around two bodies and their reach, where they were listed, meet."""
        reach = self.ball[i] + self.ball[j]
        return squared(self.placed_at[j] - self.placed_at[i]) < reach * reach


@ti.data_oriented
class CellGrid:
    """Sorts bodies by cell, so that neighbours are sought in the cells nearby only."""

    scratch_fields = (
        *("first", "member", "cell", "counts", "corner", "edge", "largest", "bounds"),
    )

    def __init__(self, tables: Tables, reach: Reach, number: Callable[..., Any]):
        n = tables.capacity.bodies
        self.tables, self.placed_at, self.ball = tables, reach.placed_at, reach.ball
        self.number = number
        self.first = ti.field(ti.i32, shape=4 * n + 66)
        self.member = ti.field(ti.i32, shape=n)
        self.cell = ti.field(ti.i32, shape=n)
        self.counts = ti.Vector.field(3, ti.i32, shape=())
        self.corner = ti.Vector.field(3, real, shape=())
        self.edge = ti.field(real, shape=())
        self.largest = ti.field(real, shape=())
        cells = Some(self._cell_count, 4 * n + 65, light=True)
        bodies = Some(number, n, light=True)
        parts = cells, bodies, self._cell_of_member, self._itself
        self.grouping = Grouping(self.first, self.member, *parts)
        self.chunks = Chunks(bodies)
        self.bounds = ti.Matrix.field(3, 3, real, shape=self.chunks.most)
        self.phases: Phases = (
            (self.chunks, self._bound),
            (Some(self._once, 1), self._size),
            (bodies, self._find_cell),
            *self.grouping.phases,
        )

    @ti.func
    def _once(self):
        return ti.min(self.number(), 1)

    @ti.func
    def _cell_count(self):
        counts = self.counts[None]
        return self._once() * counts[0] * counts[1] * counts[2]

    @ti.func
    def _find_cell(self, i):
        counts, cell = self.counts[None], self._cell_of(self._bounded(i))
        self.cell[i] = (cell[2] * counts[1] + cell[1]) * counts[0] + cell[0]

    @ti.func
    def _itself(self, i):
        return i

    @ti.func
    def around(self, i):
        """Cells with the centres of all whose balls meet that of body i: lowest, past highest."""
        position = self._bounded(i)
        reach = self.ball[i] + self.largest[None]
        low = ti.max(self._cell_of(position - reach), 0)
        high = ti.min(self._cell_of(position + reach) + 1, self.counts[None])
        return low, high

    @ti.func
    def row(self, z, y, low, high):
        """First place, and one past the last, of members of cells low .. high - 1 of a row."""
        cell = (z * self.counts[None][1] + y) * self.counts[None][0]
        return self.first[cell + low], self.first[cell + high]

    @ti.func
    def _bound(self, c):
        """Lowest and highest place of a chunk of bodies; sum and largest of their balls."""
        first, last = self.chunks.span(c)
        low, high, total, largest = self._bounded(first), self._bounded(first), 0.0, 0.0
        for i in range(first, last):
            place = self._bounded(i)
            low, high = ti.min(low, place), ti.max(high, place)
            total += self.ball[i]
            largest = ti.max(largest, self.ball[i])
        self.bounds[c] = ti.Matrix.rows([low, high, [total, largest, 0.0]])

    @ti.func
    def _size(self, item):
        """Choose cells about as wide as one of the balls."""
        first, count = self.bounds[0], self.tables.body_count[None]
        low, high, total, largest = first[0, :], first[1, :], 0.0, 0.0
        for c in range(self.chunks.count(0)):
            box = self.bounds[c]
            low, high = ti.min(low, box[0, :]), ti.max(high, box[1, :])
            total += box[2, 0]
            largest = ti.max(largest, box[2, 1])
        edge = 2.0 * total / count
        while _product(ti.floor((high - low) / edge) + 1.0) > 4 * count + 64:
            edge *= 1.25
        self.largest[None], self.edge[None], self.corner[None] = largest, edge, low
        self.counts[None] = ti.cast((high - low) / edge, ti.i32) + 1

    @ti.func
    def _bounded(self, i):
        """Place of a body, as far as it is one."""
        return ti.max(ti.min(self.placed_at[i], _FAR), -_FAR)

    @ti.func
    def _cell_of(self, position):
        return ti.cast(ti.floor((position - self.corner[None]) / self.edge[None]), ti.i32)

    @ti.func
    def _cell_of_member(self, i):
        return self.cell[i]


@ti.func
def _product(counts):
    return counts[0] * counts[1] * counts[2]
