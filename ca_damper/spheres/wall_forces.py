"""Forces of the container's walls on the spheres that are expected to touch them."""

from typing import Any

import taichi as ti

from ca_damper.spheres.bodies import Bodies, vec2
from ca_damper.spheres.contact_law import ContactLaw
from ca_damper.spheres.wall_contacts import WallContacts


@ti.data_oriented
class WallForces:
    """Contacts of spheres and walls; history: of friction; rubs: whether there is any."""

    def __init__(
        self,
        bodies: Bodies,
        search: Any,
        law: ContactLaw,
        rotation: Any,
        contacts: WallContacts,
        history: Any,
        rubs: bool,
    ):
        self.bodies, self.search, self.law, self.rotation = bodies, search, law, rotation
        self.contacts, self.history, self.rubs = contacts, history, rubs

    @ti.func
    def add(self, s, contacts, low, high, speed):
        """Add the forces of the walls; returns their sum along x [N], and the spheres that touch.

        contacts: with the side walls, and with floor and ceiling. low, high: where the largest
        spheres begin to touch [m]; speed: of the walls [m/s].
        """
        total, touching = 0.0, 0
        for k in range(self.search.wall_count(s)):
            i = self.search.wall_sphere(s, k)
            place, short = self.bodies.position[i], self.bodies.short_of_radius(i)
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
                if overlap > 0.0:
                    normal = side * ti.Vector.unit(2, axis, ti.f64)
                    wall = 2 * axis + (1 if ti.static(side > 0.0) else 0)
                    force += self._wall(s, i, wall, contacts[axis], normal, overlap, relative)
                elif ti.static(self.history.remembers):
                    self.history.leave(i, 2 * axis + (1 if ti.static(side > 0.0) else 0))
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
            self.rotation.twist(i, lever * drag)
            force += drag * tangent
        return force

    @ti.func
    def _friction(self, s, i, wall, contact, overlap, push, slip, tangent):
        """Friction of sphere i at a wall [N]."""
        if ti.static(self.history.remembers):
            return self.history.at_wall(s, i, wall, contact, overlap, push, slip, tangent)
        return self.law.friction(contact, push, slip)
