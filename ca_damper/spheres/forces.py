"""Impulses of two spheres on each other; ``wall_forces`` has those of the walls.

An impact of a sphere that has no other contact takes both bodies over the step as if they were
alone, by its closed form. Contacts at rest, and those of spheres that have several, act by their
force at mid-step. Every second step goes through all of them in reverse: two are of second order.
"""

from typing import Any

import taichi as ti

from ca_damper.spheres.bodies import vec2
from ca_damper.spheres.contacts import LANES, OfSizes
from ca_damper.spheres.effect_activity import FRICTION, EffectActivity
from ca_damper.spheres.friction_history import FrictionHistory

#: How a pair acts in a step.
APART, RESTS, IMPACT = range(3)


class SphereForces:
    """Base of what acts in contacts; rubs: whether there is friction."""

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
        table = self.bodies.table
        self.impact, self.resting = (table.field(ti.i32, "pairs") for _ in range(2))
        self.rest = table.field(ti.i32)
        for name in self.scratch_fields:
            setattr(self, name, ti.Vector.field(LANES, ti.f64, shape=table.capacity))

    @ti.func
    def collide(self, s, contact, which, count, forwards):
        """Let impacts of so many pairs of a list act; returns how many there are."""
        impacts, touching = 0, 0
        if ti.static(self.history.remembers):
            self.history.recall(s, self.search.pair, which, count)
        if self.bodies.calm[s] != 0:
            self.rest[s] = count
            for k in range(count):
                self.resting[s, k] = k
        else:
            impacts = self._sort(s, contact, which, count)
        for n in range(impacts):
            k = self.impact[s, n if forwards else impacts - 1 - n]
            pair = self.search.pair[s, which, k]
            touching += self._meet(s, k, pair[0], pair[1], contact)
        self.bodies.impacts[s] = impacts
        return touching

    @ti.func
    def _sort(self, s, contact, which, count):
        """Note which pairs are impacts, returns how many, and which press as at rest."""
        impacts, rest = 0, 0
        for k in range(count):
            kind = self._kind(s, self.search.pair[s, which, k], contact)
            if kind == IMPACT:
                self.impact[s, impacts] = k
                impacts += 1
            elif kind == RESTS:
                self.resting[s, rest] = k
                rest += 1
            elif ti.static(self.history.remembers):
                self.history.recalled[s, k] = vec2(0.0)
        self.rest[s] = rest
        return impacts

    @ti.func
    def press(self, s, contact, which, count):
        """Add the forces of the other pairs; returns how many of them touch."""
        touching, rest = 0, self.rest[s]
        for vector in range((rest + LANES - 1) // LANES):
            first = LANES * vector
            which_of = [
                self.resting[s, ti.min(first + lane, rest - 1)] for lane in ti.static(range(LANES))
            ]
            pairs = [self.search.pair[s, which, which_of[lane]] for lane in ti.static(range(LANES))]
            if ti.static(self.history.remembers):
                self._recall(s, which_of)
            self._evaluate(s, self.contacts.of_lanes(s, pairs, contact), pairs)
            for lane in ti.static(range(LANES)):
                if first + lane < rest:
                    touching += self._give(s, which_of[lane], pairs[lane], lane)
        if ti.static(self.history.remembers):
            self.history.keep(s, self.search.pair, which, count)
        return touching

    @ti.func
    def _kind(self, s, pair, for_step):
        """How a pair acts: an impact is fast, and at least one of them has no other contact."""
        kind, i, j = RESTS, pair[0], pair[1]
        if self.bodies.may_meet(s, i) or self.bodies.may_meet(s, j):
            contact = self.contacts.between(s, i, j, for_step)
            branch = self.bodies.position[j] - self.bodies.position[i]
            distance = branch.norm()
            approach = (self.bodies.velocity[i] - self.bodies.velocity[j]).dot(branch) / distance
            overlap = contact.reach - distance
            if self.law.is_impact(contact, overlap, approach):
                kind = IMPACT
            elif overlap <= 0.0:
                kind = APART
        return kind

    @ti.func
    def _give(self, s, k, pair, lane: ti.template()):
        """Add the force of a lane on both spheres; returns whether there is one."""
        if ti.static(self.history.remembers):
            self.history.recalled[s, k] = vec2(self.spring[s][lane], self.root[s][lane])
        force = vec2(self.force_x[s][lane], self.force_y[s][lane])
        self.bodies.push(pair[0], force)
        self.bodies.push(pair[1], -force)
        if ti.static(self.turns):
            share, torque = self.rotation.share(s, pair[0], pair[1]), self.torque[s][lane]
            self.rotation.twist(pair[0], share * torque)
            self.rotation.twist(pair[1], (1.0 - share) * torque)
        return ti.cast((force != 0.0).any(), ti.i32)

    @ti.func
    def _recall(self, s, which_of: ti.template()):
        """Take the springs of a vector of contacts from the history."""
        kept = [self.history.recalled[s, which_of[k]] for k in ti.static(range(LANES))]
        self.spring[s] = ti.Vector([kept[k][0] for k in ti.static(range(LANES))])
        self.root[s] = ti.Vector([kept[k][1] for k in ti.static(range(LANES))])

    @ti.func
    def _friction(self, s, contact, overlap, push, slip, way):
        if ti.static(self.history.remembers):
            drag, spring, root = self.history.force(
                *(contact, overlap, push, slip, way, self.spring[s], self.root[s])
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
            slip, way = ry * nx - rx * ny, 0.0 * push
            if ti.static(self.turns):
                slip += distance * self._turning(s, self.rotation.spin, pairs)
            if ti.static(self.history.remembers):
                wx, wy = self._differences(self.history.velocity, pairs, 0, 1)
                way = wy * nx - wx * ny
                if ti.static(self.turns):
                    way += distance * self._turning(s, self.history.spin, pairs)
                way *= contact.since
            drag = self._friction(s, contact, contact.reach - distance, push, slip, way)
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
        differences = [field[pairs[k][a]] - field[pairs[k][b]] for k in ti.static(range(LANES))]
        x = ti.Vector([differences[k][0] for k in ti.static(range(LANES))])
        y = ti.Vector([differences[k][1] for k in ti.static(range(LANES))])
        return x, y

    @ti.func
    def _turning(self, s, spin: ti.template(), pairs: ti.template()):
        """Slip by the spins of both spheres over their distance [1/s]."""
        return ti.Vector(
            [
                self.rotation.turning(s, spin, pairs[k][0], pairs[k][1])
                for k in ti.static(range(LANES))
            ]
        )

    @ti.func
    def _meet(self, s, k, i, j, for_step):
        """Let spheres i and j, the k-th pair of the list, push each other if they touch."""
        contact = self.contacts.between(s, i, j, for_step)
        branch = self.bodies.position[j] - self.bodies.position[i]
        relative = self.bodies.velocity[i] - self.bodies.velocity[j]
        distance = branch.norm()
        normal = branch / distance
        overlap = contact.reach - distance
        impulse, deeper = self.law.meet(contact, overlap, relative.dot(normal))
        if impulse > 0.0:
            blow = -impulse * normal
            if ti.static(self.rubs):
                blow += self._rub(s, k, i, j, contact, overlap, impulse, normal, relative)
            # Whoever comes nearer turns faster about the other: the angular momentum is kept.
            tangent, across = vec2(-normal[1], normal[0]), contact.mass * relative + blow
            blow += across.dot(tangent) * deeper / (distance - deeper) * tangent
            self.bodies.kick(s, i, blow)
            self.bodies.kick(s, j, -blow)
            way = contact.mass * deeper * normal
            self.bodies.shift(i, way / self.bodies.mass(s, i))
            self.bodies.shift(j, -way / self.bodies.mass(s, j))
        elif ti.static(self.history.remembers):
            self.history.recalled[s, k] = vec2(0.0)
        return ti.cast(impulse > 0.0, ti.i32)

    @ti.func
    def _rub(self, s, k, i, j, contact, overlap, impulse, normal, relative):
        """Impulse of friction on sphere i [N s]."""
        tangent, distance = vec2(-normal[1], normal[0]), contact.reach - overlap
        slip = self.rotation.slip_of_pair(s, i, j, distance, relative.dot(tangent))
        push, drag = impulse / contact.dt, 0.0
        if ti.static(self.history.remembers):
            drag = self.history.of_pair(s, k, i, j, contact, overlap, push, slip, normal)
        else:
            drag = self.law.friction(contact, push, slip)
        if drag != 0.0 and self.effect_activity.is_new(s, FRICTION):
            self.effect_activity.note(s, FRICTION)
        if ti.static(self.rotation.turns):
            share, torque = self.rotation.share(s, i, j), contact.dt * distance * drag
            self.rotation.kick(s, i, share * torque)
            self.rotation.kick(s, j, (1.0 - share) * torque)
        return contact.dt * drag * tangent
