"""Verlet list of the contact search: faces that come near each other while the block hardly moves.

It reaches several skins and takes in every face, broken or not, so one list serves many searches.
"""

import taichi as ti

from taichi_dem.contact_search.cell_grid import CellGrid
from taichi_dem.contact_search.lengths import SPARE_NEIGHBOURS
from taichi_dem.contact_search.pair_cache import PairCache
from taichi_dem.kit.allocation import assign
from taichi_dem.kit.types import real

#: What the list is when it needs to be made anew, and while it is.
STALE, MAKING = 1, 2
#: Room left behind the neighbours of each body, for fast ones that come.
SPARE = 16
#: Reach of the list around a body, in body skins and in skins: a longer list against fewer of them.
BODY_SKINS, SKINS = 2.0, 3.5
#: Largest steps by which a body is listed ahead of where it is, most of those that leave their
#: reach being adrift, and the share of its reach that this may take.
AHEAD, SHARE = 256.0, 0.8
#: Bodies that leave their reach at once, at most, to be listed anew one by one.
MOST_ESCAPED = 1024
#: Share of its body skin that a body may use up before a search looks at it.
FAR = 0.6


@ti.data_oriented
class VerletList:
    """For each body the bodies of higher index near it, in order.

    first[i] .. last[i]: those of body i, in body, with some room behind; known: what a
    ``PairCache`` knows of them. placed_at, turned_to, listed: where a body was listed, and its
    clusters [m]. reach: how far it may be from there, its body skin included [m], and ball: radius
    of the ball around it and its reach [m]. escaped: bodies that have left their reach since, left:
    1 for them; they are listed anew, as a few fragments fly faster than all the rest. stale: STALE
    when all are. limit: entries that the scene allows. full: 1 when there is no room.
    """

    def __init__(self, contacts, brute_force=False):
        n = contacts.tables.capacity.bodies
        self.tables, self.state, self.contacts = contacts.tables, contacts.state, contacts
        self.capacity = contacts.tables.capacity.neighbour_entries
        self.limit = ti.field(ti.i32, shape=())
        self.reach = ti.field(real, shape=n)
        self.ball = ti.field(real, shape=n)
        self.grid = CellGrid(self.tables, self.state, self.ball, brute_force)
        self.first = ti.field(ti.i32, shape=n + 1)
        self.last = ti.field(ti.i32, shape=n)
        self.body = ti.field(ti.i32, shape=self.capacity)
        self.pair_cache = PairCache(contacts, self.capacity)
        self.placed_at = ti.Vector.field(3, real, shape=n)
        self.turned_to = ti.Matrix.field(3, 3, real, shape=n)
        self.listed = ti.Vector.field(3, real, shape=4 * n)
        self.escaped = ti.field(ti.i32, shape=n)
        self.escaped_count = ti.field(ti.i32, shape=())
        self.left = ti.field(ti.i32, shape=n)
        self.stale = ti.field(ti.i32, shape=())
        self.full = ti.field(ti.i32, shape=())

    def load(self, model, method):
        """Let the list be made anew."""
        assign(self.stale, STALE)
        each = model.contact.neighbours_per_body
        assign(self.limit, model.body_count * each + SPARE_NEIGHBOURS)

    @ti.func
    def notice(self, i):
        """See whether body i, which is looked at, has left the list's reach."""
        # No point of the body went further than this: a norm of a matrix bounds what it does.
        way = (self.state.position[i] - self.placed_at[i]).norm()
        way += (self.state.rotation[i] - self.turned_to[i]).norm() * self.tables.extent[i]
        if not way + self.contacts.body_skin[i] < self.reach[i]:
            self.left[i] = 1
            self.escaped[ti.atomic_add(self.escaped_count[None], 1)] = i
            self._list(i)

    @ti.func
    def _list(self, i):
        """Note where body i and its clusters are, or will soon be if it goes on like this."""
        self.reach[i] = BODY_SKINS * self.contacts.body_skin[i] + SKINS * self.contacts.skin[None]
        self.ball[i] = self.tables.extent[i] + self.reach[i]
        ahead = AHEAD * self.contacts.pace[0] * self.state.velocity[i]
        most = SHARE * (self.reach[i] - self.contacts.body_skin[i])
        ahead *= most / ti.max(ahead.norm(), most)
        self.placed_at[i] = self.state.position[i] + ahead
        self.turned_to[i] = self.state.rotation[i]
        for face in range(4 * i, 4 * i + 4):
            self.listed[face] = self.pair_cache.middle(i, face) + ahead

    @ti.func
    def begin(self):
        """See whether so many bodies have left their reach that the list is made anew."""
        self.full[None] = 0
        if self.escaped_count[None] > ti.min(self.tables.body_count[None] // 16, MOST_ESCAPED):
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
        return ti.cast(self.stale[None] != MAKING and self.escaped_count[None] > 0, ti.i32)

    @ti.func
    def list_anew(self, i):
        """Note where body i is."""
        self.contacts.set_body_skin(i)
        self._list(i)

    @ti.func
    def count(self, i):
        """Count the neighbours of body i."""
        self.first[i + 1] = self._visit(i, 0, False) + SPARE

    @ti.func
    def allot(self):
        """Give every body its part of the list."""
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
        """List the neighbours of body i, when there is room."""
        self.pair_cache.met[i], self.pair_cache.changed[i] = 0, 1
        if self.full[None] == 0:
            self.last[i] = self.first[i] + self._visit(i, self.first[i], True)

    @ti.func
    def amend(self, i):
        """List those that have escaped where they are now, among the neighbours of body i.

        Entries where they were stay while there is room: nothing comes of them but a look. A row
        without room leaves the list stale.
        """
        if self.left[i] == 1:
            for j in range(i + 1, self.tables.body_count[None]):
                self._add(i, j)
        else:
            for a in range(self.escaped_count[None]):
                if self.escaped[a] > i:
                    self._add(i, self.escaped[a])

    @ti.func
    def _balls_near(self, i, j):
        """Whether the balls around two bodies with their reaches meet, where these were listed."""
        reach = self.ball[i] + self.ball[j]
        return (self.placed_at[j] - self.placed_at[i]).norm_sqr() < reach * reach

    @ti.func
    def _add(self, i, j):
        """List body j as neighbour of body i, if it is one, with the faces that are near."""
        faces = 0
        if self._balls_near(i, j):
            faces = self._faces_near(i, j)
        if faces != 0:
            place = self._find_row_index(i, j)
            if place < self.last[i] and self.body[ti.min(place, self.capacity - 1)] == j:
                self.pair_cache.faces[place] = faces
            else:
                self._drop_far(i)
                if self.last[i] < self.first[i + 1]:
                    self._insert(self.first[i], self.last[i], j, faces)
                    self.last[i] = self.last[i] + 1
                else:
                    self.stale[None] = STALE

    @ti.func
    def _drop_far(self, i):
        """Drop those that are near body i no more when its row is full."""
        if self.last[i] == self.first[i + 1]:
            place = self.first[i]
            for k in range(self.first[i], self.last[i]):
                if self._faces_near(i, self.body[k]) != 0:
                    self._move(k, place)
                    place += 1
                else:
                    self.pair_cache.forget(k, i)
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
        for a in range(self.escaped_count[None]):
            self.left[self.escaped[a]] = 0
        self.escaped_count[None] = 0
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
                    if j > i and self._balls_near(i, j):
                        faces = self._faces_near(i, j)
                        if faces != 0:
                            if write:
                                self._insert(start, start + count, j, faces)
                            count += 1
        return count

    @ti.func
    def _insert(self, start, end, j, faces):
        """Enter body j into a row from start to end, in order."""
        place = end
        while place > start and self.body[ti.max(place - 1, 0)] > j:
            self._move(place - 1, place)
            place -= 1
        self.body[place] = j
        self.pair_cache.begin(place, faces)

    @ti.func
    def _move(self, k, place):
        self.body[place] = self.body[k]
        self.pair_cache.move(k, place)

    @ti.func
    def _faces_near(self, i, j):
        """Which faces of two bodies are near."""
        wide, faces = self.reach[i] + self.reach[j], 0
        for f in range(4):
            faces |= self._near_face(4 * i + f, j, wide) << (4 * f)
        return faces

    @ti.func
    def _near_face(self, face, j, wide):
        """Which faces of body j, a bit each, come near a face of another."""
        faces, reach = 0, self.tables.cluster[face][3] + wide
        whole = reach + self.tables.extent[j]
        if (self.placed_at[j] - self.listed[face]).norm_sqr() < whole * whole:
            for g in range(4):
                other = reach + self.tables.cluster[4 * j + g][3]
                apart = self.listed[4 * j + g] - self.listed[face]
                faces |= ti.cast(apart.norm_sqr() < other * other, ti.i32) << g
        return faces
