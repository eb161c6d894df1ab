"""Verlet list of the contact search: faces that come near each other while the block hardly moves.

It reaches several skins and takes in every face, broken or not, so one list serves many searches.
"""

import taichi as ti

from taichi_dem.fields import then
from taichi_dem.step.cells import CellGrid
from taichi_dem.types import real

#: What the list is when it needs to be made anew, and while it is.
STALE, MAKING = 1, 2
#: Room left behind the neighbours of each body, for fast ones that come.
ROOM = 16
#: Reach of the list in skins of the search: a longer list against fewer of them.
REACH = 8.0
#: Share of its skin that a body may use up before a search looks at it.
FAR = 0.25


@ti.data_oriented
class Neighbours:
    """For each body the bodies of higher index near it, in order.

    first[i] .. last[i]: those of body i, in body, with some room behind. faces: which of the two
    bodies' faces are near, bit 4 f + g for faces f and g; broken: which of these are broken too,
    and spheres: how many of their spheres are within the skin, for ``BroadPhase``; news: 1 until
    that is taken note of; met: how many entries of a body have any. cluster: centre of the ball
    around the spheres of a face, where the body was last looked at [m], and way: how far any point
    of it had gone by then [m]; until: how far the two of an entry may go, together, before spheres
    can come within the skin [m]. placed_at, turned_to, listed: where a body was when it was listed,
    and its clusters. gone: bodies that have left the list's reach since, left: 1 for them; they are
    listed anew, as a few fragments fly faster than all the rest. stale: STALE when all are. full: 1
    when there is no room.
    """

    def __init__(self, contacts, brute_force=False):
        n = contacts.model.body_count
        self.model, self.state, self.skin = contacts.model, contacts.state, contacts.skin
        self.capacity = n * contacts.law.neighbours_per_body + 1024
        self.grid = CellGrid(self.model, self.state, brute_force)
        self.first = ti.field(ti.i32, shape=n + 1)
        self.last = ti.field(ti.i32, shape=n)
        self.body = ti.field(ti.i32, shape=self.capacity)
        self.faces = ti.field(ti.i32, shape=self.capacity)
        self.broken = ti.field(ti.i32, shape=self.capacity)
        self.spheres = ti.field(ti.i32, shape=self.capacity)
        self.news = ti.field(ti.i32, shape=self.capacity)
        self.met = ti.field(ti.i32, shape=n)
        self.until = ti.field(real, shape=self.capacity)
        self.way = ti.field(real, shape=n)
        self.cluster = ti.Vector.field(3, real, shape=4 * n)
        self.placed_at = ti.Vector.field(3, real, shape=n)
        self.turned_to = ti.Matrix.field(3, 3, real, shape=n)
        self.listed = ti.Vector.field(3, real, shape=4 * n)
        self.gone = ti.field(ti.i32, shape=n)
        self.gone_count = ti.field(ti.i32, shape=())
        self.left = ti.field(ti.i32, shape=n)
        self.stale = ti.field(ti.i32, shape=())
        self.full = ti.field(ti.i32, shape=())
        then(self.stale.fill, STALE)

    @ti.func
    def notice(self, i):
        """See whether body i, which is looked at, has left the list's reach."""
        # No point of the body went further than this: a norm of a matrix bounds what it does.
        way = (self.state.position[i] - self.placed_at[i]).norm()
        way += (self.state.rotation[i] - self.turned_to[i]).norm() * self.model.radius[i]
        # It goes on for FAR before it is looked at again, and so may what it meets.
        if not way < (0.5 * (REACH - 1.0) - FAR) * self.skin[None]:
            self.left[i] = 1
            self.gone[ti.atomic_add(self.gone_count[None], 1)] = i
            self._list(i)

    @ti.func
    def _list(self, i):
        """Note where body i and its clusters are now."""
        self.placed_at[i], self.turned_to[i] = self.state.position[i], self.state.rotation[i]
        for face in range(4 * i, 4 * i + 4):
            self.listed[face] = self._middle(i, face)

    @ti.func
    def place(self, i, travel):
        """Note where the clusters of body i are, which has come a way of travel [m] since."""
        self.way[i] += travel
        for face in range(4 * i, 4 * i + 4):
            self.cluster[face] = self._middle(i, face)

    @ti.func
    def _middle(self, i, face):
        """Centre of a face's cluster now [m]."""
        return self.state.position[i] + self.state.rotation[i] @ self.model.cluster[face].xyz

    @ti.func
    def begin(self):
        """Sort all bodies into cells, when many have left the list's reach."""
        self.full[None] = 0
        if self.gone_count[None] > self.model.body_count // 16:
            self.stale[None] = STALE
        if self.stale[None] == STALE:
            self.stale[None] = MAKING
            self.grid.fill(REACH * self.skin[None])

    @ti.func
    def list_anew(self, i):
        """Note where body i is, when the list is stale."""
        if self.stale[None] == MAKING:
            self._list(i)

    @ti.func
    def count(self, i):
        """Count the neighbours of body i, when the list is stale."""
        if self.stale[None] == MAKING:
            self.first[i + 1] = self._visit(i, 0, False) + ROOM

    @ti.func
    def allot(self):
        """Give every body its part of the list, when that is stale."""
        if self.stale[None] == MAKING:
            self.first[0] = 0
            for i in range(self.model.body_count):
                self.first[i + 1] += self.first[i]
            if self.first[self.model.body_count] > self.capacity:
                self.full[None] = 1
                for i in range(self.model.body_count + 1):
                    self.first[i] = 0
            for i in range(self.model.body_count):
                self.last[i] = self.first[i]

    @ti.func
    def fill(self, i):
        """List the neighbours of body i, when the list is stale and has room; else amend them."""
        if self.stale[None] == MAKING:
            self.met[i] = 0
            if self.full[None] == 0:
                self.last[i] = self.first[i] + self._visit(i, self.first[i], True)
        elif self.gone_count[None] > 0:
            self._amend(i)

    @ti.func
    def _amend(self, i):
        """List those that are gone where they are now, among the neighbours of body i.

        Entries where they were stay, until all are made anew: nothing comes of them but a look. A
        row without room leaves the list stale.
        """
        if self.left[i] == 1:
            for j in range(i + 1, self.model.body_count):
                self._add(i, j)
        else:
            for a in range(self.gone_count[None]):
                if self.gone[a] > i:
                    self._add(i, self.gone[a])

    @ti.func
    def _add(self, i, j):
        """List body j as neighbour of body i, if it is one, with the faces that are near."""
        faces = self._faces_near(i, j)
        if faces != 0:
            place = self._place_of(i, j)
            if place < self.last[i] and self.body[ti.min(place, self.capacity - 1)] == j:
                self.faces[place] = faces
            elif self.last[i] < self.first[i + 1]:
                self._insert(place, self.last[i], j, faces)
                self.last[i] += 1
            else:
                self.stale[None] = STALE

    @ti.func
    def _place_of(self, i, j):
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
    def making(self):
        """Whether the list is being made anew."""
        return self.stale[None] == MAKING

    @ti.func
    def end(self):
        """The list serves until a body has left its reach."""
        for a in range(self.gone_count[None]):
            self.left[self.gone[a]] = 0
        self.gone_count[None] = 0
        if self.stale[None] == MAKING:
            self.stale[None] = ti.select(self.full[None] == 1, STALE, 0)

    @ti.func
    def _visit(self, i, start, write):
        """Number of neighbours of body i; writes them in order from start on."""
        count = 0
        low, high = self.grid.around(i, REACH * self.skin[None])
        for z in range(low[2], high[2]):
            for y in range(low[1], high[1]):
                first, last = self.grid.row(z, y, low[0], high[0])
                for k in range(first, last):
                    j = self.grid.member[k]
                    if j > i:
                        faces = self._faces_near(i, j)
                        if faces != 0:
                            if write:
                                self._insert(start, start + count, j, faces)
                            count += 1
        return count

    @ti.func
    def _insert(self, start, end, j, faces):
        place = end
        while place > start and self.body[ti.max(place - 1, 0)] > j:
            self._move(place - 1, place)
            place -= 1
        self.body[place], self.faces[place] = j, faces
        self.broken[place], self.spheres[place] = 0, 0
        self.until[place], self.news[place] = 0.0, 0

    @ti.func
    def _move(self, k, place):
        """Move an entry."""
        self.body[place], self.faces[place] = self.body[k], self.faces[k]
        self.broken[place], self.spheres[place] = self.broken[k], self.spheres[k]
        self.until[place], self.news[place] = self.until[k], self.news[k]

    @ti.func
    def may_touch(self, k, i, faces):
        """Whether entry k, of body i, may have more spheres within the skin; faces: broken now."""
        gone_on = faces != 0 and self._way(k, i) > self.until[k]
        return gone_on or self.broken[k] != faces

    @ti.func
    def found(self, k, i, faces, spheres, gap):
        """Note the spheres of entry k within the skin; gap: the smallest of the others [m]."""
        self.news[k] = 1
        self.met[i] += ti.cast(spheres > 0, ti.i32) - ti.cast(self.spheres[k] > 0, ti.i32)
        self.broken[k], self.spheres[k] = faces, spheres
        self.until[k] = self._way(k, i) + gap - self.skin[None]

    @ti.func
    def take_news(self, k):
        """Broken faces of entry k if its spheres have just been found, else 0; once."""
        faces = self.news[k] * self.broken[k]
        self.news[k] = 0
        return faces

    @ti.func
    def _way(self, k, i):
        """How far the two bodies of entry k have gone, together [m]."""
        return self.way[i] + self.way[self.body[k]]

    @ti.func
    def _faces_near(self, i, j):
        """Which faces of two bodies are near; balls around the bodies are compared first."""
        wide, faces = REACH * self.skin[None], 0
        reach = self.model.radius[i] + self.model.radius[j] + wide
        if (self.placed_at[j] - self.placed_at[i]).norm_sqr() < reach * reach:
            for f in range(4):
                faces |= self._near_face(4 * i + f, j, wide) << (4 * f)
        return faces

    @ti.func
    def _near_face(self, face, j, wide):
        """Which faces of body j, a bit each, come near a face of another."""
        faces, reach = 0, self.model.cluster[face][3] + wide
        whole = reach + self.model.radius[j]
        if (self.placed_at[j] - self.listed[face]).norm_sqr() < whole * whole:
            for g in range(4):
                other = reach + self.model.cluster[4 * j + g][3]
                apart = self.listed[4 * j + g] - self.listed[face]
                faces |= ti.cast(apart.norm_sqr() < other * other, ti.i32) << g
        return faces

    @ti.func
    def clusters_near(self, face_i, face_j, wide):
        """Whether the balls around the spheres of two faces come nearer than wide [m]."""
        reach = self.model.cluster[face_i][3] + self.model.cluster[face_j][3] + wide
        return (self.cluster[face_j] - self.cluster[face_i]).norm_sqr() < reach * reach
