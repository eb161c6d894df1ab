"""Contacts of the spheres with walls that recoil: those of a container that an impulse sets moving.

The container moves along x only. A blow on floor or ceiling accelerates sphere and container, so
that the effective mass is m M / (m + M), with M the container's mass; across, the container is
guided, and a blow on a side wall meets m. Friction there acts along x, again on both. M is a number
of the scene, and infinite for a container whose motion is prescribed.
"""

from typing import Any

import taichi as ti

from ca_damper.scenes.scene_fields import SceneFields
from ca_damper.spheres.bodies import Bodies
from ca_damper.spheres.contact_law import Contact, ContactLaw, wall_numbers

vec3 = ti.types.vector(3, ti.f64)


@ti.data_oriented
class WallContacts:
    """Numbers of the contacts of a sphere with the walls.

    contact: a Contact with a wall that does not recoil for each size of spheres. recoiling: of each
    scene and size, damping and yielding of floor and ceiling, and grip of the side walls. share: of
    the effective mass that resists a tangential impulse.
    """

    def __init__(self, table: SceneFields, bodies: Bodies, law: ContactLaw, share: float):
        self.table, self.bodies, self.law, self.share = table, bodies, law, share
        self.contact = Contact.field(shape=bodies.kinds)
        self.recoiling = table.vector(3, ti.f64, bodies.kinds)

    def load(self, options: Any) -> None:
        """Take over the numbers of spheres of the same structure."""
        numbers = [wall_numbers(options, k) for k in range(self.bodies.kinds)]
        self.law.load(self.contact, numbers, self.share)

    @ti.func
    def reset(self, s):
        """Take over how the container of scene s recoils."""
        for k in range(self.bodies.kinds):
            contact, recoil = self.contact[k], self.table.recoil[s]
            mass = 0.5 / contact.yielding
            self.recoiling[s, k] = vec3(
                contact.damping * self.law.damping_ratio(1.0 / (1.0 + mass * recoil)),
                contact.yielding + 0.5 * recoil,
                contact.grip / (1.0 + self.share * mass * recoil),
            )

    @ti.func
    def over_step(self, s, kind, dt, since):
        """The contacts for a step, as of the law: with side walls, and with floor and ceiling."""
        side, ends, recoiling = self.contact[kind], self.contact[kind], self.recoiling[s, kind]
        ends.damping, ends.yielding = recoiling[0], recoiling[1]
        side.grip = recoiling[2]
        return self.law.over_step(side, dt, since), self.law.over_step(ends, dt, since)

    @ti.func
    def at_rest(self, i):
        """The contact of sphere i with a wall that does not recoil, before a step is known."""
        return self.contact[self.bodies.kind_of(i)]

    @ti.func
    def of(self, s, i, contacts):
        """The contacts of sphere i for a step; contacts: what ``over_step`` gave for the first."""
        side, ends = contacts
        if ti.static(self.bodies.kinds > 1):
            side, ends = self.over_step(s, self.bodies.kind[i], side.dt, side.since)
        return side, ends
