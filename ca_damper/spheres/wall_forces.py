"""Impulses of the container's walls on the spheres that touch them."""

from typing import Any

import taichi as ti

from ca_damper.spheres.bodies import vec2
from ca_damper.spheres.effect_activity import FRICTION
from ca_damper.spheres.forces import SphereForces
from ca_damper.spheres.friction_history import WALLS


@ti.data_oriented
class WallForces(SphereForces):
    """Contacts of walls and of the spheres that are expected to touch them."""

    def __init__(self, *parts: Any):
        super().__init__(*parts)
        table = self.bodies.table
        self.touching, self.blow = table.vector(2, ti.i32, "spheres", WALLS), table.field(ti.f64)

    @ti.func
    def find(self, s, dt, low, high, speed):
        """Note the contacts with walls that there may be in a step; returns how many.

        low, high: where a sphere that touches has its centre at mid-step [m]; speed: mean one of
        the walls [m/s], seen from spheres that fall freely.
        """
        count = 0
        for k in range(self.search.sphere_count[s]):
            i = self.search.sphere[s, k]
            place, short = self.bodies.position[i], self.bodies.short_of_radius(s, i)
            way = 0.5 * dt * ti.abs(self.bodies.velocity[i] - speed) - short
            least, most = place < low + way, place > high - way
            for wall in ti.static(range(WALLS)):
                if (most if ti.static(wall % 2) else least)[wall // 2]:
                    self.touching[s, count // WALLS, count % WALLS] = ti.Vector([i, wall])
                    self.bodies.note_near(i)
                    count += 1
        return count

    @ti.func
    def act(self, s, contacts, count, low, high, speed):
        """Let walls push in those contacts; returns their impulse along x [N s], how many do."""
        total, touching, self.blow[s] = 0.0, 0, 0.0
        for k in range(count):
            found, now = self.touching[s, k // WALLS, k % WALLS], speed
            alone = self.bodies.may_meet(s, found[0])
            if alone:
                # The container recoils from impacts before; a field, as others need not wait.
                now[1] = speed[1] - self.blow[s] * self.bodies.table.recoil[s]
            force = self._wall(s, found[0], found[1], contacts, low, high, now)
            self.bodies.push(found[0], force)
            impulse = contacts[0].dt * force[1]
            if alone:
                self.blow[s] = self.blow[s] + impulse
            total += impulse
            touching += ti.cast((force != 0.0).any(), ti.i32)
        return total, touching

    @ti.func
    def _wall(self, s, i, wall, contacts, low, high, speed):
        """Force of a wall on sphere i [N]."""
        contact, ends = self.contacts.of(s, i, contacts)
        place, short = self.bodies.position[i], self.bodies.short_of_radius(s, i)
        normal, room = vec2(1.0, 0.0), vec2(place[0] - low[0], high[0] - place[0])
        if wall >= 2:
            contact, normal = ends, vec2(0.0, 1.0)
            room = vec2(place[1] - low[1], high[1] - place[1])
        overlap = -(room[1] + short)
        if wall % 2 == 0:
            normal, overlap = -normal, -(room[0] + short)
        relative = self.bodies.velocity[i] - speed
        push, force = self._push(s, i, contact, overlap, normal, relative.dot(normal)), vec2(0.0)
        if push > 0.0:
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
    def _push(self, s, i, contact, overlap, normal, approach):
        """Mean push [N] over the step of the wall that lies along ``normal``."""
        push = 0.0
        if self.bodies.may_meet(s, i) and self.law.is_impact(contact, overlap, approach):
            impulse, deeper = self.law.meet(contact, overlap, approach)
            push = impulse / contact.dt
            self.bodies.shift(i, deeper * normal)
            self.bodies.impacts[s] = self.bodies.impacts[s] + 1
        elif overlap > 0.0:
            push = self.law.normal(contact, overlap, approach)
        return push

    @ti.func
    def _friction(self, s, i, wall, contact, overlap, push, slip, tangent):
        if ti.static(self.history.remembers):
            return self.history.at_wall(s, i, wall, contact, overlap, push, slip, tangent)
        return self.law.friction(contact, push, slip)
