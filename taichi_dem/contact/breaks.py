"""Bonds between the bodies of a pair, and overlaps that a break at this tick creates."""

import taichi as ti

from taichi_dem.contact.contacts import Contacts


@ti.data_oriented
class Breaks:
    """Which pairs are bonded, and which overlaps are new, for the contact search.

    fresh: 1 when a face has got its spheres since the last search, whose injection is booked.
    newest: last tick at which a face of a body got its spheres, negative for none.
    """

    scratch_fields = ("newest",)

    def __init__(self, contacts: Contacts):
        self.contacts, self.store = contacts, contacts.store
        self.tables, self.state = contacts.tables, contacts.state
        self.fresh = ti.field(ti.i32, shape=())
        self.newest = ti.field(ti.i64, shape=self.tables.capacity.bodies)

    @ti.func
    def exposed_faces(self, i):
        """Bit f for a face f of body i with spheres; notes when it got the last of them."""
        exposed, newest = 0, self.state.exposed_tick[4 * i]
        for f in range(4):
            since = self.state.exposed_tick[4 * i + f]
            newest = ti.max(newest, since)
            exposed |= ti.cast(since >= 0, ti.i32) << f
        self.newest[i] = newest
        return exposed

    @ti.func
    def expose_outer(self):
        """Put spheres on all outer faces once a bond has broken, where they wait for that."""
        if self.contacts.outer_waits[None] == 1:
            broken = False
            for b in range(self.tables.bond_count[None]):
                broken = broken or self.state.broken_tick[b] >= 0
            if broken:
                self.contacts.outer_waits[None] = 0
                for face in range(4 * self.tables.body_count[None]):
                    bare = self.state.exposed_tick[face] < 0
                    if bare and self.tables.face_bond[face] < 0:
                        self.state.exposed_tick[face] = self.state.tick[None]

    @ti.func
    def note_newest(self, newest):
        """Note the last tick at which a face got its spheres.

        A second search at the tick of a break must not book its injection again.
        """
        self.fresh[None] = ti.cast(newest > self.state.injected_tick[None], ti.i32)
        self.state.injected_tick[None] = newest

    @ti.func
    def bonded(self, i, j):
        """Whether two bodies share a bond that holds."""
        bonded = False
        for f in range(4):
            if self.tables.neighbour[4 * i + f] == j:
                bonded = self.state.broken_tick[self.tables.face_bond[4 * i + f]] < 0
        return bonded

    @ti.func
    def exposed_since(self, i, tick):
        """1 when a face of body i has got its spheres at a tick or later."""
        return ti.cast(self.newest[i] >= tick, ti.i32)

    @ti.func
    def injected(self, p):
        """Energy [J] of overlaps of a pair that this tick's breaks have brought into being."""
        i, j = self.store.body[p][0], self.store.body[p][1]
        energy, tick = 0.0, self.state.tick[None]
        fresh, freed = self.fresh[None] == 1, self._freed_at(i, j, tick)
        for k in range(self.store.first[p], self.store.last[p]):
            a, b = self.store.sphere[k][0], self.store.sphere[k][1]
            size = self.tables.face_spheres[None]
            born = ti.max(self.state.exposed_tick[a // size], self.state.exposed_tick[b // size])
            if fresh and (freed or born == tick):
                overlap = ti.max(0.0, -self.contacts.gap(i, j, a, b))
                energy += self.contacts.law.stored(self.tables.pair(i, j), overlap)
        return energy

    @ti.func
    def _freed_at(self, i, j, tick):
        """Whether the bond of two bodies was released at a tick."""
        freed = False
        for f in range(4):
            if self.tables.neighbour[4 * i + f] == j:
                freed = self.state.broken_tick[self.tables.face_bond[4 * i + f]] == tick
        return freed
