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


@ti.data_oriented
class Neighbours:
    """For each body the bodies of higher index near it, in order.

    first[i] .. last[i]: those of body i, in body, with some room behind. faces: which of the two
    bodies' faces are near, bit 4 f + g for faces f and g; broken: which of these are broken too,
    and spheres: how many of their spheres are within the skin, for ``BroadPhase``. cluster: centre
    of the ball around the spheres of a face, at the last search [m]. placed_at, turned_to: where a
    body was when it was listed. gone: bodies that have left the list's reach since, whose entries
    are made anew; a few fragments fly faster than all the rest. stale: STALE when all are. full: 1
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
        self.cluster = ti.Vector.field(3, real, shape=4 * n)
        self.placed_at = ti.Vector.field(3, real, shape=n)
        self.turned_to = ti.Matrix.field(3, 3, real, shape=n)
        self.gone = ti.field(ti.i32, shape=n)
        self.gone_count = ti.field(ti.i32, shape=())
        self.stale = ti.field(ti.i32, shape=())
        self.full = ti.field(ti.i32, shape=())
        then(self.stale.fill, STALE)

    @ti.func
    def place(self, i):
        """Bring the clusters of body i to where it is, and see whether it left the list's reach."""
        position, rotation = self.state.position[i], self.state.rotation[i]
        for face in range(4 * i, 4 * i + 4):
            self.cluster[face] = position + rotation @ self.model.cluster[face].xyz
        # No point of the body went further than this: a norm of a matrix bounds what it does.
        way = (position - self.placed_at[i]).norm()
        way += (rotation - self.turned_to[i]).norm() * self.model.radius[i]
        if not way < 0.5 * (REACH - 1.0) * self.skin[None]:
            self.gone[ti.atomic_add(self.gone_count[None], 1)] = i

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
    def count(self, i):
        """Count the neighbours of body i, when the list is stale."""
        if self.stale[None] == MAKING:
            self._listed(i)
            self.first[i + 1] = self._visit(i, 0, False) + ROOM

    @ti.func
    def _listed(self, i):
        self.placed_at[i], self.turned_to[i] = self.state.position[i], self.state.rotation[i]

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
            if self.full[None] == 0:
                self.last[i] = self.first[i] + self._visit(i, self.first[i], True)
        elif self.gone_count[None] > 0:
            self._amend(i)

    @ti.func
    def _amend(self, i):
        """Take those that are gone off the neighbours of body i, and list them where they are.

        A row without room leaves the list stale, to be made anew.
        """
        if self._is_gone(i):
            self.last[i] = self.first[i]
            for j in range(i + 1, self.model.body_count):
                self._add(i, j)
        else:
            end = self.first[i]
            for k in range(self.first[i], self.last[i]):
                if not self._is_gone(self.body[k]):
                    self._move(k, end)
                    end += 1
            self.last[i] = end
            for a in range(self.gone_count[None]):
                if self.gone[a] > i:
                    self._add(i, self.gone[a])

    @ti.func
    def _is_gone(self, i):
        found = False
        for a in range(self.gone_count[None]):
            found |= self.gone[a] == i
        return found

    @ti.func
    def _add(self, i, j):
        """List body j as neighbour of body i, if it is one."""
        faces = self._faces_near(i, j)
        if faces != 0:
            if self.last[i] < self.first[i + 1]:
                self._insert(self.first[i], self.last[i], j, faces)
                self.last[i] += 1
            else:
                self.stale[None] = STALE

    @ti.func
    def making(self):
        """Whether the list is being made anew."""
        return self.stale[None] == MAKING

    @ti.func
    def end(self):
        """The list serves until a body has left its reach."""
        for a in range(self.gone_count[None]):
            self._listed(self.gone[a])
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

    @ti.func
    def _move(self, k, place):
        """Move an entry."""
        self.body[place], self.faces[place] = self.body[k], self.faces[k]
        self.broken[place], self.spheres[place] = self.broken[k], self.spheres[k]

    @ti.func
    def _faces_near(self, i, j):
        """Which faces of two bodies are near; balls around the bodies are compared first."""
        wide, faces = REACH * self.skin[None], 0
        reach = self.model.radius[i] + self.model.radius[j] + wide
        if (self.state.position[j] - self.state.position[i]).norm_sqr() < reach * reach:
            for f in range(4):
                if self._cluster_near(4 * i + f, j, wide):
                    for g in range(4):
                        if self.clusters_near(4 * i + f, 4 * j + g, wide):
                            faces |= 1 << (4 * f + g)
        return faces

    @ti.func
    def _cluster_near(self, face, j, wide):
        """Whether the ball around the spheres of a face comes near the ball around a body."""
        reach = self.model.cluster[face][3] + self.model.radius[j] + wide
        return (self.state.position[j] - self.cluster[face]).norm_sqr() < reach * reach

    @ti.func
    def clusters_near(self, face_i, face_j, wide):
        """Whether the balls around the spheres of two faces come nearer than wide [m]."""
        reach = self.model.cluster[face_i][3] + self.model.cluster[face_j][3] + wide
        return (self.cluster[face_j] - self.cluster[face_i]).norm_sqr() < reach * reach
