"""Positions at which bodies were listed as neighbours, and allowed distances from there."""

import taichi as ti

from taichi_dem.contact.contacts import Contacts
from taichi_dem.kit.products import norm, squared
from taichi_dem.kit.types import real

#: Reach of the list around a body, in body skins and in skins: a longer list against fewer of them.
BODY_SKINS, SKINS = 2.0, 3.5
#: Largest steps by which a body is listed ahead of where it is, most of those that leave their
#: reach being adrift, and the share of its reach that this may take.
AHEAD, SHARE = 256.0, 0.8


@ti.data_oriented
class Reach:
    """The positions for which the Verlet list knows the neighbours of each body.

    placed_at, turned_to, cluster: position and rotation at which a body was listed, and centres of
    the balls around the spheres of its faces [m]. reach: distance that it may move from there, its
    body skin included [m]; ball: radius of the ball around it and its reach [m]. escaped: bodies
    that have left their reach since, escaped_count of them; left: 1 for them. They are listed again
    one by one, as a few fragments are faster than all others.
    """

    def __init__(self, contacts: Contacts):
        n = contacts.tables.capacity.bodies
        self.tables, self.state, self.contacts = contacts.tables, contacts.state, contacts
        self.reach = ti.field(real, shape=n)
        self.ball = ti.field(real, shape=n)
        self.placed_at = ti.Vector.field(3, real, shape=n)
        self.turned_to = ti.Matrix.field(3, 3, real, shape=n)
        self.cluster = ti.Vector.field(3, real, shape=4 * n)
        self.escaped = ti.field(ti.i32, shape=n)
        self.escaped_count = ti.field(ti.i32, shape=())
        self.left = ti.field(ti.i32, shape=n)

    @ti.func
    def notice(self, i):
        """Note whether body i, which is being searched, has left its reach."""
        # Upper bound on the displacement of any point: a matrix norm bounds that of its product.
        way = norm(self.state.position[i] - self.placed_at[i])
        way += norm(self.state.rotation[i] - self.turned_to[i]) * self.tables.extent[i]
        if not way + self.contacts.body_skin[i] < self.reach[i]:
            self.left[i] = 1
            self.escaped[ti.atomic_add(self.escaped_count[None], 1)] = i
            self.note_place(i)

    @ti.func
    def note_place(self, i):
        """Note the position of body i and its clusters, extrapolated at its present velocity."""
        self.reach[i] = BODY_SKINS * self.contacts.body_skin[i] + SKINS * self.contacts.skin[i]
        self.ball[i] = self.tables.extent[i] + self.reach[i]
        ahead = AHEAD * self.contacts.pace[0] * self.state.velocity[i]
        most = SHARE * (self.reach[i] - self.contacts.body_skin[i])
        ahead *= most / ti.max(norm(ahead), most)
        self.placed_at[i] = self.state.position[i] + ahead
        self.turned_to[i] = self.state.rotation[i]
        for face in range(4 * i, 4 * i + 4):
            self.cluster[face] = self.contacts.cluster_centre(i, face) + ahead

    @ti.func
    def end(self):
        """Clear the list of escaped bodies, which have been listed again."""
        for a in range(self.escaped_count[None]):
            self.left[self.escaped[a]] = 0
        self.escaped_count[None] = 0

    @ti.func
    def is_near(self, j, place, ball):
        """Whether the ball around body j and its reach, where it was listed, meets another ball.

        place: of the other ball's centre [m]; ball: its radius [m].
        """
        reach = ball + self.ball[j]
        return squared(self.placed_at[j] - place) < reach * reach

    @ti.func
    def faces_near(self, i, j):
        """Pairs of faces of two bodies that are near: bit 4 f + g for faces f and g."""
        wide, faces = self.reach[i] + self.reach[j], 0
        for f in range(4):
            faces |= self._near_face(4 * i + f, j, wide) << (4 * f)
        return faces

    @ti.func
    def _near_face(self, face, j, wide):
        """Faces of body j, a bit each, that are near a face of another body."""
        faces, reach = 0, self.tables.cluster[face][3] + wide
        whole = reach + self.tables.extent[j]
        if squared(self.placed_at[j] - self.cluster[face]) < whole * whole:
            for g in range(4):
                other = reach + self.tables.cluster[4 * j + g][3]
                apart = self.cluster[4 * j + g] - self.cluster[face]
                faces |= ti.cast(squared(apart) < other * other, ti.i32) << g
        return faces
