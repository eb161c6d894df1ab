"""Which bodies can touch others, which are bonded, and overlaps that a break creates."""

import taichi as ti

from taichi_dem.contact.contacts import Contacts
from taichi_dem.kit.allocation import assign
from taichi_dem.kit.ordered import Once, Phases, Some
from taichi_dem.state.model import Model

#: Outer faces wait for the first break to be free; they are set free in this search.
WAITING, ENDING = 1, 2


@ti.data_oriented
class Breaks:
    """What breaks have set free, for the contact search: spheres on free faces, and their corners.

    Around a free face lie bodies that reach the surface with an edge or a corner only. newest,
    latest: last tick at which a face of a body, of any body, was set free; fresh: since the last
    search.
    """

    constant_fields = ("corner",)
    scratch_fields = ("newest", "is_open")

    def __init__(self, contacts: Contacts):
        self.contacts, self.store = contacts, contacts.store
        self.tables, self.state = contacts.tables, contacts.state
        self.fresh = ti.field(ti.i32, shape=())
        self.latest = ti.field(ti.i64, shape=())
        self.newest = ti.field(ti.i64, shape=self.tables.capacity.bodies)
        if contacts.law.meets_bodies:
            self.corner, self.is_open = (
                ti.field(ti.i32, shape=self.tables.capacity.faces) for _ in range(2)
            )

    def load(self, model: Model) -> None:
        """Load the corners of a scene."""
        if self.contacts.law.meets_bodies:
            assign(self.corner, model.mesh.tetrahedra.reshape(-1))

    def phases(self, bodies: Some) -> Phases:
        """Phases that note which faces are free now, and when the last of them were set free."""
        waiting = Some(self._bonds_waited_for, self.tables.capacity.bonds, light=True)
        phases: Phases = ((waiting, self._note_break), (bodies, self._note))
        if self.contacts.law.meets_bodies:
            phases += ((bodies, self._open_corners),)
        return (*phases, (Once(), self._end))

    @ti.func
    def _bonds_waited_for(self):
        """Number of bonds, while outer faces wait for one of them to break."""
        waits = self.contacts.outer_waits[None] == WAITING
        return ti.select(waits, self.tables.bond_count[None], 0)

    @ti.func
    def _note_break(self, b):
        if self.state.broken_tick[b] >= 0:
            self.contacts.outer_waits[None] = ENDING

    @ti.func
    def _note(self, i):
        """Set outer faces of body i free, where they are to be now; note when the last one was."""
        newest = ti.cast(-1, ti.i64)
        for face in range(4 * i, 4 * i + 4):
            if self.contacts.outer_waits[None] == ENDING:
                bare = self.state.exposed_tick[face] < 0
                if bare and self.tables.face_bond[face] < 0:
                    self.state.exposed_tick[face] = self.state.tick[None]
            newest = ti.max(newest, self.state.exposed_tick[face])
            if ti.static(self.contacts.law.meets_bodies):
                self.is_open[face] = 0
        self.newest[i] = newest
        if newest > self.latest[None]:
            ti.atomic_max(self.latest[None], newest)

    @ti.func
    def _open_corners(self, i):
        """Mark the corners of the free faces; face f of a body lies opposite its corner f."""
        for f in range(4):
            if self.state.exposed_tick[4 * i + f] >= 0:
                for c in range(1, 4):
                    self.is_open[self.corner[4 * i + (f + c) % 4]] = 1

    @ti.func
    def _end(self, one):
        # A second search at the tick of a break must not book its injection again.
        self.fresh[None] = ti.cast(self.latest[None] > self.state.injected_tick[None], ti.i32)
        self.state.injected_tick[None] = self.latest[None]
        if self.contacts.outer_waits[None] == ENDING:
            self.contacts.outer_waits[None] = 0

    @ti.func
    def is_free(self, i):
        """1 for a body that others may touch."""
        free = ti.cast(self.newest[i] >= 0, ti.i32)
        if ti.static(self.contacts.law.meets_bodies):
            for c in range(4):
                free |= self.is_open[self.corner[4 * i + c]]
        return free

    @ti.func
    def free_since(self, i, tick):
        """1 when a face of body i has been set free at a tick or later."""
        return ti.cast(self.newest[i] >= tick, ti.i32)

    @ti.func
    def free_faces(self, i, j):
        """Bit 4 f + g for every free face f of the one and g of the other."""
        faces = 0
        for f in range(4):
            if self.state.exposed_tick[4 * i + f] >= 0:
                for g in range(4):
                    free = ti.cast(self.state.exposed_tick[4 * j + g] >= 0, ti.i32)
                    faces |= free << (4 * f + g)
        return faces

    @ti.func
    def bonded(self, i, j):
        """Whether two bodies share a bond that holds."""
        return self._shared(i, j, ti.cast(-1, ti.i64))

    @ti.func
    def _shared(self, i, j, tick):
        """Whether two bodies share a bond that was released at a tick; -1 for one that holds."""
        shared = False
        for f in range(4):
            if self.tables.neighbour[4 * i + f] == j:
                shared = self.state.broken_tick[self.tables.face_bond[4 * i + f]] == tick
        return shared

    @ti.func
    def injected(self, p):
        """Energy [J] of overlaps of a pair that this tick's breaks have brought into being."""
        i, j = self.store.body[p][0], self.store.body[p][1]
        energy, tick = 0.0, self.state.tick[None]
        fresh, freed = self.fresh[None] == 1, self._shared(i, j, tick)
        for k in range(self.store.first[p], self.store.last[p]):
            a, b = self.store.sphere[k][0], self.store.sphere[k][1]
            size = self.tables.face_spheres[None]
            born = ti.max(self.state.exposed_tick[a // size], self.state.exposed_tick[b // size])
            if fresh and (freed or born == tick):
                overlap = ti.max(0.0, -self.contacts.gap(i, j, a, b))
                energy += self.contacts.law.stored(self.tables.pair(i, j), overlap)
        return energy
