"""Verlet list of the contact search: faces that come near each other while the block hardly moves.

It reaches several skins and takes in every face, broken or not, so one list serves many searches.
"""

import taichi as ti

from taichi_dem.fields import then
from taichi_dem.step.cells import CellGrid
from taichi_dem.types import real

#: Reach of the list in skins of the search: a longer list against fewer of them.
REACH = 16.0


@ti.data_oriented
class Neighbours:
    """For each body the bodies of higher index near it, in order.

    first[i] .. first[i + 1]: those of body i, in body. faces: which of the two bodies' faces are
    near, bit 4 f + g for faces f and g. cluster: centre of the ball around the spheres of a face,
    at the last search [m]. placed_at, turned_to: where the bodies were when the list was made.
    full: 1 when the list has no room.
    """

    def __init__(self, contacts, brute_force=False):
        n = contacts.model.body_count
        self.model, self.state, self.skin = contacts.model, contacts.state, contacts.skin
        self.capacity = n * contacts.law.neighbours_per_body + 1024
        self.grid = CellGrid(self.model, self.state, brute_force)
        self.first = ti.field(ti.i32, shape=n + 1)
        self.body = ti.field(ti.i32, shape=self.capacity)
        self.faces = ti.field(ti.i32, shape=self.capacity)
        self.cluster = ti.Vector.field(3, real, shape=4 * n)
        self.placed_at = ti.Vector.field(3, real, shape=n)
        self.turned_to = ti.Matrix.field(3, 3, real, shape=n)
        self.stale = ti.field(ti.i32, shape=())
        self.full = ti.field(ti.i32, shape=())
        then(self.stale.fill, 1)

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
            self.stale[None] = 1

    @ti.func
    def begin(self):
        """Sort all bodies into cells, when the list is stale."""
        self.full[None] = 0
        if self.stale[None] == 1:
            self.grid.fill(REACH * self.skin[None])

    @ti.func
    def count(self, i):
        """Count the neighbours of body i, when the list is stale."""
        if self.stale[None] == 1:
            self.placed_at[i], self.turned_to[i] = self.state.position[i], self.state.rotation[i]
            self.first[i + 1] = self._visit(i, 0, False)

    @ti.func
    def allot(self):
        """Give every body its part of the list, when that is stale."""
        if self.stale[None] == 1:
            self.first[0] = 0
            for i in range(self.model.body_count):
                self.first[i + 1] += self.first[i]
            if self.first[self.model.body_count] > self.capacity:
                self.full[None] = 1
                for i in range(self.model.body_count + 1):
                    self.first[i] = 0

    @ti.func
    def fill(self, i):
        """List the neighbours of body i, when the list is stale and has room."""
        if self.stale[None] == 1 and self.full[None] == 0:
            self._visit(i, self.first[i], True)

    @ti.func
    def end(self):
        """The list serves until a body has left its reach."""
        self.stale[None] = self.full[None]

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
            self.body[place], self.faces[place] = self.body[place - 1], self.faces[place - 1]
            place -= 1
        self.body[place], self.faces[place] = j, faces

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
