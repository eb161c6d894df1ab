"""Forces of the container's walls on the spheres that are expected to touch them."""

from typing import Any

import taichi as ti

from ca_damper.spheres.bodies import Bodies, vec2
from ca_damper.spheres.contact_law import ContactLaw


@ti.data_oriented
class WallForces:
    """Contacts of spheres and walls; rubs: whether there is friction."""

    def __init__(self, bodies: Bodies, search: Any, law: ContactLaw, rotation: Any, rubs: bool):
        self.bodies, self.search, self.law, self.rotation = bodies, search, law, rotation
        self.rubs = rubs

    @ti.func
    def add(self, s, contact, low, high, speed):
        """Add the forces of the walls; returns their sum along x [N], and the spheres that touch.

        low, high: where spheres begin to touch [m]; speed: of the walls along x [m/s].
        """
        total, touching = 0.0, 0
        for k in range(self.search.wall_count(s)):
            i = self.search.wall_sphere(s, k)
            place = self.bodies.position[i]
            if (place < low).any() or (place > high).any():
                force = self._walls(i, contact, place - low, high - place, speed)
                self.bodies.push(i, force)
                total += force[1]
                touching += 1
        return total, touching

    @ti.func
    def _walls(self, i, contact, above, below, speed):
        """Force of the four walls on sphere i [N]; way left to each wall [m]: negative overlap."""
        relative = self.bodies.velocity[i] - vec2(0.0, speed)
        force = vec2(0.0)
        for axis in ti.static(range(2)):
            for side in ti.static((-1.0, 1.0)):
                overlap = -(above[axis] if ti.static(side < 0.0) else below[axis])
                if overlap > 0.0:
                    normal = side * ti.Vector.unit(2, axis, ti.f64)
                    force += self._wall(i, contact, normal, overlap, relative)
        return force

    @ti.func
    def _wall(self, i, contact, normal, overlap, relative):
        """Force of the wall that lies along ``normal`` on sphere i [N]."""
        push = self.law.normal(contact, overlap, relative.dot(normal))
        force = -push * normal
        if ti.static(self.rubs):
            tangent, lever = vec2(-normal[1], normal[0]), contact.reach - overlap
            slip = self.rotation.slip_at_wall(i, lever, relative.dot(tangent))
            drag = self.law.friction(contact, push, slip)
            self.rotation.twist(i, lever * drag)
            force += drag * tangent
        return force
