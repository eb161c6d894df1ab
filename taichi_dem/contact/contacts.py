"""Pairs of bodies in contact: impulses, how far bodies may move, what breaks have set free."""

import numpy as np
import taichi as ti

from taichi_dem.kit.allocation import assign
from taichi_dem.kit.ordered import Once, Phases, Some
from taichi_dem.kit.products import norm, stacked
from taichi_dem.kit.types import real, vec3, vec4
from taichi_dem.laws.contact_contracts import ONCE_BROKEN, Touch
from taichi_dem.methods import Method
from taichi_dem.physics.rotation import place_in
from taichi_dem.physics.sphere_pair import DEEPEST_SHARE, SUNK, Nearest
from taichi_dem.state.model import Model
from taichi_dem.state.pair_store import PairStore
from taichi_dem.state.state import State
from taichi_dem.state.tables import Tables

#: Largest steps that a fast body makes before it is searched again.
STEPS = 16.0
#: Share of its extent beyond which it is searched again whatever its speed, and further than which
#: no step may carry it: spheres would pass each other unseen.
FARTHEST = 0.25
#: Gap of bodies that are not compared [m].
AWAY = 1e30
#: Outer faces wait for the first break to be free; they are set free in this search.
WAITING, ENDING = 1, 2


@ti.data_oriented
class Contacts:
    """Pairs of bodies that may touch soon; p: a slot of the ``PairStore``, called store.

    path: bound of the way that any point of a free body has gone [m]; horizon: path up to which its
    pairs are known [m]: a search comes before a path reaches it. skin: twice the least body skin.
    """

    def __init__(self, tables: Tables, state: State):
        n, capacity = tables.capacity.bodies, tables.capacity
        self.tables, self.state = tables, state
        self.law, self.geometry = tables.contact, tables.geometry
        self.pace = ti.field(real, shape=2)
        self.store = PairStore(n, capacity.pair_entries, capacity.contact_entries)
        for effect in tables.effects:
            effect.declare_columns(self.store)
        self.free = ti.field(ti.i32, shape=n)
        self.path, self.horizon = (ti.field(real, shape=n) for _ in range(2))
        self.skin, self.body_skin = (ti.field(real, shape=n) for _ in range(2))
        self.search_requested = ti.field(ti.i32, shape=())
        self.outer_waits = ti.field(ti.i32, shape=())

    def upload(self, model: Model, method: Method) -> None:
        """Upload the numbers of a scene and a method; no pairs exist yet."""
        effect = model.geometry
        assign(self.outer_waits, int(effect.outer_faces == ONCE_BROKEN))
        assign(self.skin, effect.skin * effect.extents(model))
        assign(self.pace, np.array([method.dt0, method.steps_ahead]))

    @ti.func
    def gap(self, i, j, a, b):
        """Gap between bodies i and j by an entry (a, b) of the pair store [m]."""
        state = self.state
        first, second = state.position[i], state.position[j]
        return self.geometry.gap(a, b, first, state.rotation(i), second, state.rotation(j))

    @ti.func
    def place(self, i, j):
        """Rotation and place [m] of body j in the frame of body i."""
        branch = self.state.position[j] - self.state.position[i]
        return place_in(self.state.rotation(i), self.state.rotation(j), branch)

    @ti.func
    def closer(self, p, margin):
        """Number of sphere pairs of a pair of bodies with a gap below a margin [m] now."""
        count = 0
        pair = self.store.body[p]
        for k in range(self.store.first[p], self.store.last[p]):
            spheres = self.store.sphere[k]
            count += ti.cast(self.gap(pair[0], pair[1], spheres[0], spheres[1]) < margin, ti.i32)
        return count

    @ti.func
    def touching(self, p):
        """Number of sphere pairs of a pair of bodies that overlap now."""
        return self.closer(p, 0.0)

    @ti.func
    def note_depth(self, p, deepest):
        """Keep the depth of a pair, a share of its size, and for good where one body sinks in."""
        self.store.deepest[p] = deepest
        if ti.static(not self.geometry.by_face):
            if deepest > DEEPEST_SHARE:
                for side in ti.static(range(2)):
                    self.state.note_active(self.store.body[p][side], ti.i64(SUNK))

    @ti.func
    def add_impulse(self, p, side: ti.template(), linear, angular):
        """Add an impulse [N s] and its moment [N m s] to the pending ones of a body of a pair."""
        slot = 2 * p + side
        self.store.waiting[p][side] = 1
        self.store.impulse[slot] = self.store.impulse[slot] + stacked(linear, angular)

    @ti.func
    def gather(self, i):
        """Collect the pending impulse and moment of the contacts of body i."""
        linear, angular = vec3(0.0, 0.0, 0.0), vec3(0.0, 0.0, 0.0)
        for a in range(self.store.first_of[i], self.store.first_of[i + 1]):
            p = self.store.near_slot[a]
            if self.store.waiting[p][0] == 1:
                linear, angular = self._gather_side(p, 0, linear, angular)
                self.state.contact_heat[i] = self.state.contact_heat[i] + self.store.heat[p]
                self.store.heat[p] = vec4(0.0)
        for a in range(self.store.second_start[i], self.store.second_start[i + 1]):
            p = self.store.second_slot[a]
            if self.store.waiting[p][1] == 1:
                linear, angular = self._gather_side(p, 1, linear, angular)
        return linear, angular

    @ti.func
    def _gather_side(self, p, side: ti.template(), linear, angular):
        taken = self.store.impulse[2 * p + side]
        self.store.impulse[2 * p + side] = 0.0 * taken
        self.store.waiting[p][side] = 0
        return linear + taken[0:3], angular + taken[3:6]

    @ti.func
    def finest_partner(self, i):
        """Finest level among the bodies in body i's pairs; -1 without any."""
        level = -1
        for a in range(self.store.first_of[i], self.store.first_of[i + 1]):
            level = ti.max(level, self.state.level[self.store.body[self.store.near_slot[a]][1]])
        for a in range(self.store.second_start[i], self.store.second_start[i + 1]):
            level = ti.max(level, self.state.level[self.store.body[self.store.second_slot[a]][0]])
        return level

    @ti.func
    def look(self, k, i, j, turn, offset, margin, stepping: ti.template()):
        """The ``Nearest`` of entry k, bodies i and j, of which a step takes note."""
        near = Nearest(reach=-AWAY)
        if self.geometry.may_meet(k, self.paths(i, j), margin):
            entry = self.store.sphere[k]
            near = self.geometry.nearest(entry[0], entry[1], turn, offset)
            if ti.static(stepping):
                self.geometry.settle(near, k, self.paths(i, j))
        return near

    @ti.func
    def moved(self, i, velocity, spin, elapsed):
        """Add to the displacement of body i; request a search once it may exceed the body skin."""
        # A body that leaps too far in one step for its contacts to be followed is out of bounds.
        if self.free[i] == 1:
            speed = self._speed(i, velocity, spin)
            if elapsed * speed > FARTHEST * self.tables.extent[i]:
                ti.atomic_min(self.state.bad_body[None], i)
            path = self.path[i] + speed * elapsed
            self.path[i] = path
            if path + self.pace[1] * elapsed * speed > self.horizon[i]:
                self.search_requested[None] = 1

    @ti.func
    def set_body_skin(self, i):
        """Set the body skin of body i: half the skin, or more where it is fast."""
        # A few fragments are much faster than the rest and would cause most of the searches.
        speed = self._speed(i, self.state.velocity[i], self.state.spin[i])
        ahead = ti.min(STEPS * self.pace[0] * speed, FARTHEST * self.tables.extent[i])
        self.body_skin[i] = ti.max(0.5 * self.skin[i], ahead)
        self.horizon[i] = self.path[i] + self.body_skin[i]

    @ti.func
    def is_far(self, i, share):
        """Whether body i has used up more than a share of its body skin."""
        return self.path[i] >= self.horizon[i] - (1.0 - share) * self.body_skin[i]

    @ti.func
    def _speed(self, i, velocity, spin):
        """Bound of the speed of any point on the spheres of body i [m/s]."""
        return norm(velocity) + norm(spin) * self.tables.extent[i]

    @ti.func
    def approach(self, i, j):
        """Bound of the speed at which spheres of two bodies approach each other [m/s]."""
        between = self.state.velocity[j] - self.state.velocity[i]
        first = self._speed(i, between, self.state.spin[i])
        return first + norm(self.state.spin[j]) * self.tables.extent[j]

    @ti.func
    def paths(self, i, j):
        """Sum of the paths of two bodies [m]."""
        return self.path[i] + self.path[j]

    @ti.func
    def horizons(self, i, j):
        """Sum of the paths of two bodies up to which their contacts have to be known [m]."""
        return self.horizon[i] + self.horizon[j]

    @ti.func
    def margin(self, i, j):
        """Gap that two bodies can close before they are searched again [m]."""
        return self.horizons(i, j) - self.paths(i, j)


@ti.data_oriented
class Breaks:
    """Spheres and corners that breaks have set free, for the contact search."""

    constant_fields = ("corner",)
    scratch_fields = ("newest", "is_open")

    def __init__(self, contacts: Contacts):
        self.contacts, self.store = contacts, contacts.store
        self.tables, self.state = contacts.tables, contacts.state
        self.fresh = ti.field(ti.i32, shape=())
        self.latest = ti.field(ti.i64, shape=())
        self.newest = ti.field(ti.i64, shape=self.tables.capacity.bodies)
        if not contacts.geometry.by_face:
            self.corner, self.is_open = (
                ti.field(ti.i32, shape=self.tables.capacity.faces) for _ in range(2)
            )

    def upload(self, model: Model) -> None:
        """Upload the corners of a scene."""
        if not self.contacts.geometry.by_face:
            assign(self.corner, model.mesh.tetrahedra.reshape(-1))

    def phases(self, bodies: Some) -> Phases:
        """Phases that note which faces are free now, and when the last of them were set free."""
        waiting = Some(self._bonds_waited_for, self.tables.capacity.bonds, light=True)
        phases: Phases = ((waiting, self._note_break), (bodies, self._note))
        if not self.contacts.geometry.by_face:
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
            if ti.static(not self.contacts.geometry.by_face):
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
    def _end(self, item):
        # A second search at the tick of a break must not book its injection again.
        self.fresh[None] = ti.cast(self.latest[None] > self.state.injected_tick[None], ti.i32)
        if self.contacts.outer_waits[None] == ENDING:
            self.contacts.outer_waits[None] = 0

    @ti.func
    def end_search(self):
        """What these breaks inject has been booked."""
        self.state.injected_tick[None] = self.latest[None]

    @ti.func
    def is_free(self, i):
        """1 for a body that others may touch."""
        free = ti.cast(self.newest[i] >= 0, ti.i32)
        if ti.static(not self.contacts.geometry.by_face):
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
                touch, m = Touch(overlap=overlap, rate=0.0, area=1.0), self.tables.pair(i, j)
                # What a law with memory takes of it at once is injected too.
                energy += self.contacts.law.stored(m, k, touch)
                energy += self.contacts.law.push(m, k, touch).spent
        return energy
