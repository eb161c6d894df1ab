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

    placed_at: position at which a body was listed [m]. reach: distance that it may move from there,
    its body skin included [m]; ball: radius of the ball around all that it may touch with then [m].
    escaped: bodies that have left their reach since, escaped_count of them; left: 1 for them. They
    are listed again one by one, as a few fragments are faster than all others.
    """

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
        way = norm(self.state.position[i] - self.placed_at[i])
        if not way + self.contacts.body_skin[i] < self.reach[i]:
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
