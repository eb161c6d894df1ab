"""Pairs of bodies in contact: packed candidate lists and the impulses they exchange.

A pair holds the sphere pairs that were nearer than the body skin of its bodies at the last search.
Lists are sorted by (first body, second body), so that sums over a body's pairs have one order,
whoever searched when.
"""

import numpy as np
import taichi as ti

from taichi_dem.contact_search.lengths import SPARE_PAIRS, SPARE_SPHERES
from taichi_dem.kit.allocation import assign
from taichi_dem.kit.types import real, vec3

#: Largest steps that a fast body makes before the search looks at it again.
STEPS = 16.0
#: Share of its extent beyond which it is looked at whatever its speed.
FARTHEST = 0.25


@ti.data_oriented
class Contacts:
    """Candidate pairs of bodies with broken faces.

    pair_body: the two bodies, first < second. pair_first[p] .. pair_last[p]: sphere pairs in
    pair_sphere, of which sphere_count are in use and sphere_end lies behind all. pair_slot[2 p +
    side]: impulse [N s] and moment about the body's centre [N m s] gathered for that side.
    pair_heat: energy into dashpots, friction, and injected [J], until the first body takes it.
    pair_full[2 p + side]: 1 while something waits there, else its slot is zero; most pairs do not
    touch, and to ask is cheaper than to add zeros. first_of[i]: first pair whose first body is i;
    second_start, second_pair: pairs whose second body is i. exposed_faces: bit f for a broken face
    f. travel: bound of the way any point of a body went since it was last looked at [m]. body_skin:
    how far that may be before it is looked at again [m]; a pair holds the spheres whose gap is
    below the body skin of both. pace: largest step [s], and steps of a body by which its contacts
    are counted before they touch. pair_limit, sphere_limit: entries that the scene allows to the
    lists of pairs and of their spheres. search_requested: 1 when the list may miss one of them.
    deepest: overlap of a pair as a share of the distance at which its spheres touch.
    """

    def __init__(self, tables, state):
        n, capacity = tables.capacity.bodies, tables.capacity
        self.tables, self.state = tables, state
        self.law, self.friction = tables.contact, tables.friction
        self.capacity, self.sphere_capacity = capacity.pair_entries, capacity.sphere_entries
        self.pair_limit = ti.field(ti.i32, shape=())
        self.sphere_limit = ti.field(ti.i32, shape=())
        self.pace = ti.field(real, shape=2)
        self.pair_count = ti.field(ti.i32, shape=())
        self.pair_body = ti.Vector.field(2, ti.i32, shape=self.capacity)
        self.pair_first = ti.field(ti.i32, shape=self.capacity)
        self.pair_last = ti.field(ti.i32, shape=self.capacity)
        self.pair_sphere = ti.Vector.field(2, ti.i32, shape=self.sphere_capacity)
        self.sphere_count = ti.field(ti.i32, shape=())
        self.sphere_end = ti.field(ti.i32, shape=())
        self.pair_slot = ti.Vector.field(6, real, shape=2 * self.capacity)
        self.pair_full = ti.field(ti.i32, shape=2 * self.capacity)
        self.pair_heat = ti.Vector.field(3, real, shape=self.capacity)
        self.first_of = ti.field(ti.i32, shape=n + 1)
        self.second_start = ti.field(ti.i32, shape=n + 2)
        self.second_pair = ti.field(ti.i32, shape=self.capacity)
        self.exposed_faces = ti.field(ti.i32, shape=n)
        self.travel = ti.field(real, shape=n)
        self.body_skin = ti.field(real, shape=n)
        self.skin = ti.field(real, shape=())
        self.search_requested = ti.field(ti.i32, shape=())
        self.deepest = ti.field(real, shape=self.capacity)

    def load(self, model, method):
        """Take the numbers of a scene and a method; there are no pairs yet."""
        effect, n = model.contact, model.body_count
        assign(self.skin, effect.skin)
        assign(self.pace, np.array([method.dt0, method.steps_ahead]))
        assign(self.pair_limit, n * effect.pairs_per_body + SPARE_PAIRS)
        assign(self.sphere_limit, n * effect.spheres_per_body + SPARE_SPHERES)

    @ti.func
    def gap(self, i, j, a, b):
        """Distance between the surfaces of spheres a of body i and b of body j [m]."""
        on_first = self.state.rotation[i] @ self.tables.sphere[a].xyz
        on_second = self.state.rotation[j] @ self.tables.sphere[b].xyz
        apart = self.state.position[j] + on_second - self.state.position[i] - on_first
        return apart.norm() - self.tables.sphere[a][3] - self.tables.sphere[b][3]

    @ti.func
    def pair_energy(self, p):
        """Elastic energy of a pair's overlaps now [J]."""
        energy = 0.0
        pair = self.pair_body[p]
        for k in range(self.pair_first[p], self.pair_last[p]):
            spheres = self.pair_sphere[k]
            overlap = -self.gap(pair[0], pair[1], spheres[0], spheres[1])
            energy += self.law.stored(ti.max(0.0, overlap))
        return energy

    @ti.func
    def closer(self, p, margin):
        """Number of sphere pairs of a pair of bodies with a gap below a margin [m] now."""
        count = 0
        pair = self.pair_body[p]
        for k in range(self.pair_first[p], self.pair_last[p]):
            spheres = self.pair_sphere[k]
            count += ti.cast(self.gap(pair[0], pair[1], spheres[0], spheres[1]) < margin, ti.i32)
        return count

    @ti.func
    def touching(self, p):
        """Number of sphere pairs of a pair of bodies that overlap now."""
        return self.closer(p, 0.0)

    @ti.func
    def add_impulse(self, slot, linear, angular):
        """Add an impulse [N s] and its moment [N m s] to what waits in a slot."""
        self.pair_full[slot] = 1
        for k in ti.static(range(3)):
            self.pair_slot[slot][k] = self.pair_slot[slot][k] + linear[k]
            self.pair_slot[slot][3 + k] = self.pair_slot[slot][3 + k] + angular[k]

    @ti.func
    def gather(self, i):
        """Impulse and moment that contacts have given to body i; empties its slots.

        The heat of the pairs in which it is first is booked to it.
        """
        linear, angular = vec3(0.0, 0.0, 0.0), vec3(0.0, 0.0, 0.0)
        for p in range(self.first_of[i], self.first_of[i + 1]):
            if self.pair_full[2 * p] == 1:
                linear, angular = self._gather_slot(2 * p, linear, angular)
                self.state.contact_heat[i] = self.state.contact_heat[i] + self.pair_heat[p]
                self.pair_heat[p] = vec3(0.0)
        for k in range(self.second_start[i], self.second_start[i + 1]):
            slot = 2 * self.second_pair[k] + 1
            if self.pair_full[slot] == 1:
                linear, angular = self._gather_slot(slot, linear, angular)
        return linear, angular

    @ti.func
    def _gather_slot(self, slot, linear, angular):
        taken = self.pair_slot[slot]
        self.pair_slot[slot] = 0.0 * taken
        self.pair_full[slot] = 0
        return linear + taken[0:3], angular + taken[3:6]

    @ti.func
    def finest_partner(self, i):
        """Finest level among the bodies in body i's pairs; -1 without any."""
        level = -1
        for p in range(self.first_of[i], self.first_of[i + 1]):
            level = ti.max(level, self.state.level[self.pair_body[p][1]])
        for k in range(self.second_start[i], self.second_start[i + 1]):
            level = ti.max(level, self.state.level[self.pair_body[self.second_pair[k]][0]])
        return level

    @ti.func
    def moved(self, i, velocity, spin, elapsed):
        """Add to the way of body i and ask for a search once it may have used up its body skin."""
        if self.exposed_faces[i] != 0:
            speed = self._speed(i, velocity, spin)
            way = self.travel[i] + speed * elapsed
            self.travel[i] = way
            if way + self.pace[1] * elapsed * speed > self.body_skin[i]:
                self.search_requested[None] = 1

    @ti.func
    def set_body_skin(self, i):
        """Set the body skin of body i: half the skin, or more where it is fast.

        A few fragments fly faster than all others: they would ask for most of the searches.
        """
        speed = self._speed(i, self.state.velocity[i], self.state.spin[i])
        way = ti.min(STEPS * self.pace[0] * speed, FARTHEST * self.tables.extent[i])
        self.body_skin[i] = ti.max(0.5 * self.skin[None], way)

    @ti.func
    def _speed(self, i, velocity, spin):
        """Bound of the speed of any point on the spheres of body i [m/s]."""
        return velocity.norm() + spin.norm() * self.tables.extent[i]

    @ti.func
    def approach(self, i, j):
        """Bound of the speed at which spheres of two bodies approach each other [m/s]."""
        between = self.state.velocity[j] - self.state.velocity[i]
        first = self._speed(i, between, self.state.spin[i])
        return first + self.state.spin[j].norm() * self.tables.extent[j]

    @ti.func
    def margin(self, i, j):
        """Gap below which spheres of two bodies are candidates [m]."""
        return self.body_skin[i] + self.body_skin[j]
