"""Forces of two spheres on each other, and of the container's walls on those that touch them."""

from typing import Any

import taichi as ti

from ca_damper.spheres.bodies import vec2
from ca_damper.spheres.contacts import LANES, OfSizes
from ca_damper.spheres.effect_activity import FRICTION, EffectActivity
from ca_damper.spheres.friction_history import FrictionHistory


class SphereForces:
    """Base of the forces in contacts; rubs: whether there is friction."""

    def __init__(
        self,
        contacts: OfSizes,
        search: Any,
        history: FrictionHistory,
        activity: EffectActivity,
        rubs: bool,
    ):
        self.contacts, self.search, self.history = contacts, search, history
        self.bodies, self.law, self.rotation = contacts.bodies, contacts.law, contacts.rotation
        self.effect_activity, self.rubs = activity, rubs


@ti.data_oriented
class SpherePairForces(SphereForces):
    """Contacts of two spheres in the present step, by scene."""

    scratch_fields = ("force_x", "force_y", "torque", "spring", "root")

    def __init__(self, *parts: Any):
        super().__init__(*parts)
        self.turns = self.rubs and self.rotation.turns
        for name in self.scratch_fields:
            setattr(self, name, ti.Vector.field(LANES, ti.f64, shape=self.bodies.table.capacity))

    @ti.func
    def add(self, s, contact, which, count):
        """Add the forces of so many pairs of a list; those that do not touch add nothing."""
        if ti.static(self.history.remembers):
            self.history.recall(s, self.search.pair, which, count)
        for vector in range((count + LANES - 1) // LANES):
            first = LANES * vector
            pairs = [
                self.search.pair[s, which, ti.min(first + k, count - 1)]
                for k in ti.static(range(LANES))
            ]
            if ti.static(self.history.remembers):
                self._recall(s, first, count)
            self._evaluate(s, self.contacts.of_lanes(s, pairs, contact), pairs)
            for lane in ti.static(range(LANES)):
                if first + lane < count:
                    self._push(s, pairs[lane], lane)

    @ti.func
    def _push(self, s, pair, lane: ti.template()):
        if ti.static(self.history.remembers):
            self.history.store_pair(s, pair, vec2(self.spring[s][lane], self.root[s][lane]))
        force = vec2(self.force_x[s][lane], self.force_y[s][lane])
        self.bodies.push(pair[0], force)
        self.bodies.push(pair[1], -force)
        if ti.static(self.turns):
            share, torque = self.rotation.share(s, pair[0], pair[1]), self.torque[s][lane]
            self.rotation.twist(pair[0], share * torque)
            self.rotation.twist(pair[1], (1.0 - share) * torque)

    @ti.func
    def _recall(self, s, first, count):
        """Take the springs of a vector of contacts from the history."""
        kept = [
            self.history.recalled[s, ti.min(first + k, count - 1)] for k in ti.static(range(LANES))
        ]
        self.spring[s] = ti.Vector([kept[k][0] for k in ti.static(range(LANES))])
        self.root[s] = ti.Vector([kept[k][1] for k in ti.static(range(LANES))])

    @ti.func
    def _friction(self, s, contact, overlap, push, slip):
        if ti.static(self.history.remembers):
            way, kept, last_root = contact.since * slip, self.spring[s], self.root[s]
            drag, spring, root = self.history.force(
                *(contact, overlap, push, slip, way, kept, last_root)
            )
            touch = overlap > 0.0
            self.spring[s] = ti.select(touch, spring, 0.0)
            self.root[s] = ti.select(touch, root, 0.0)
            return drag
        return self.law.friction(contact, push, slip)

    @ti.func
    def _evaluate(self, s, contact, pairs: ti.template()):
        """Forces of a vector of contacts; lanes beyond the last one repeat it."""
        bx, by = self._differences(self.bodies.position, pairs, 1, 0)
        rx, ry = self._differences(self.bodies.velocity, pairs, 0, 1)
        square = bx * bx + by * by
        touch, distance = square < contact.reach * contact.reach, ti.sqrt(square)
        share = 1.0 / distance
        nx, ny = bx * share, by * share
        push = self.law.normal(contact, contact.reach - distance, rx * nx + ry * ny)
        fx, fy = -push * nx, -push * ny
        if ti.static(self.rubs):
            slip = ry * nx - rx * ny
            if ti.static(self.turns):
                slip += distance * self._turning(s, pairs)
            drag = self._friction(s, contact, contact.reach - distance, push, slip)
            if self.effect_activity.is_new(s, FRICTION):
                if (ti.select(touch, drag, 0.0) != 0.0).any():
                    self.effect_activity.note(s, FRICTION)
            fx, fy = fx - drag * ny, fy + drag * nx
            if ti.static(self.turns):
                self.torque[s] = ti.select(touch, distance * drag, 0.0)
        self.force_x[s], self.force_y[s] = ti.select(touch, fx, 0.0), ti.select(touch, fy, 0.0)

    @ti.func
    def _differences(
        self, field: ti.template(), pairs: ti.template(), a: ti.template(), b: ti.template()
    ):
        """Components of field[pair[a]] - field[pair[b]], a vector each."""
        found = [field[pairs[k][a]] - field[pairs[k][b]] for k in ti.static(range(LANES))]
        x = ti.Vector([found[k][0] for k in ti.static(range(LANES))])
        y = ti.Vector([found[k][1] for k in ti.static(range(LANES))])
        return x, y

    @ti.func
    def _turning(self, s, pairs: ti.template()):
        """Slip by the spins of both spheres over their distance [1/s]."""
        return ti.Vector(
            [self.rotation.turning(s, pairs[k][0], pairs[k][1]) for k in ti.static(range(LANES))]
        )


@ti.data_oriented
class WallForces(SphereForces):
    """Contacts of walls and of the spheres that are expected to touch them."""

    @ti.func
    def add(self, s, contacts, low, high, speed):
        """Add the forces of the walls; returns their sum along x [N] and how many spheres touch."""
        total, touching = 0.0, 0
        for k in range(self.search.sphere_count[s]):
            i = self.search.sphere[s, k]
            place, short = self.bodies.position[i], self.bodies.short_of_radius(s, i)
            if (place < low - short).any() or (place > high + short).any():
                if ti.static(self.history.remembers):
                    self.history.at_walls(s, i)
                of_sphere = self.contacts.of(s, i, contacts)
                above, below = place - low + short, high - place + short
                force = self._walls(s, i, of_sphere, above, below, speed)
                self.bodies.push(i, force)
                total += force[1]
                touching += 1
        return total, touching

    @ti.func
    def _walls(self, s, i, contacts, above, below, speed):
        """Force of the four walls on sphere i [N]; way left to each wall [m]: negative overlap."""
        relative = self.bodies.velocity[i] - speed
        force = vec2(0.0)
        for axis in ti.static(range(2)):
            for side in ti.static((-1.0, 1.0)):
                overlap = -(above[axis] if ti.static(side < 0.0) else below[axis])
                wall = 2 * axis + (1 if ti.static(side > 0.0) else 0)
                if overlap > 0.0:
                    normal = side * ti.Vector.unit(2, axis, ti.f64)
                    force += self._wall(s, i, wall, contacts[axis], normal, overlap, relative)
                elif ti.static(self.history.remembers):
                    self.history.leave(i, wall)
        return force

    @ti.func
    def _wall(self, s, i, wall, contact, normal, overlap, relative):
        """Force of the wall that lies along ``normal`` on sphere i [N]."""
        push = self.law.normal(contact, overlap, relative.dot(normal))
        force = -push * normal
        if ti.static(self.rubs):
            tangent, lever = vec2(-normal[1], normal[0]), contact.reach - overlap
            slip = self.rotation.slip_at_wall(i, lever, relative.dot(tangent))
            drag = self._friction(s, i, wall, contact, overlap, push, slip, tangent)
            if drag != 0.0 and self.effect_activity.is_new(s, FRICTION):
                self.effect_activity.note(s, FRICTION)
            self.rotation.twist(i, lever * drag)
            force += drag * tangent
        return force

    @ti.func
    def _friction(self, s, i, wall, contact, overlap, push, slip, tangent):
        if ti.static(self.history.remembers):
            return self.history.at_wall(s, i, wall, contact, overlap, push, slip, tangent)
        return self.law.friction(contact, push, slip)
