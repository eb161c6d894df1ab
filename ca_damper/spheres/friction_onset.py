"""The first step in which friction acts: looked for until it is found, apart from the forces.

Contacts are evaluated without noting which of them rub, as that would cost each of them time.
"""

from typing import Any

import taichi as ti

from ca_damper.spheres.bodies import Bodies
from ca_damper.spheres.contact_law import ContactLaw
from ca_damper.spheres.pair_contacts import PairContacts
from ca_damper.spheres.wall_contacts import WallContacts


@ti.data_oriented
class FrictionOnset:
    """Counts the contacts of the present step that slide and are pressed together."""

    def __init__(
        self,
        bodies: Bodies,
        search: Any,
        law: ContactLaw,
        rotation: Any,
        pair_contacts: PairContacts,
        wall_contacts: WallContacts,
    ):
        self.bodies, self.search, self.law, self.rotation = bodies, search, law, rotation
        self.pair_contacts, self.wall_contacts = pair_contacts, wall_contacts

    @ti.func
    def pairs(self, s, for_step, which, count):
        """Number among so many pairs of a list; for_step: as of ``PairContacts.over_step``."""
        found = 0
        for k in range(count):
            i, j = self.search.pair[s, which, k][0], self.search.pair[s, which, k][1]
            branch = self.bodies.position[j] - self.bodies.position[i]
            distance, contact = branch.norm(), self.pair_contacts.between(i, j, for_step)
            if distance < contact.reach:
                normal = branch * (1.0 / distance)
                relative = self.bodies.velocity[i] - self.bodies.velocity[j]
                slip = self.rotation.slip_of_pair(i, j, distance, _across(relative, normal))
                found += self._rubs(contact, contact.reach - distance, relative.dot(normal), slip)
        return found

    @ti.func
    def walls(self, s, contacts, low, high, speed):
        """Number among the spheres at walls; low, high: where they touch [m]; speed: theirs.

        contacts: with the side walls, and with floor and ceiling.
        """
        found = 0
        for k in range(self.search.wall_count(s)):
            i = self.search.wall_sphere(s, k)
            place, short = self.bodies.position[i], self.bodies.short_of_radius(i)
            of_sphere = self.wall_contacts.of(s, i, contacts)
            relative = self.bodies.velocity[i] - speed
            for axis in ti.static(range(2)):
                for side in ti.static((-1.0, 1.0)):
                    beyond = low[axis] - place[axis] if side < 0.0 else place[axis] - high[axis]
                    beyond -= short
                    if beyond > 0.0:
                        normal = side * ti.Vector.unit(2, axis, ti.f64)
                        lever, slip = of_sphere[axis].reach - beyond, _across(relative, normal)
                        slip = self.rotation.slip_at_wall(i, lever, slip)
                        found += self._rubs(of_sphere[axis], beyond, relative.dot(normal), slip)
        return found

    @ti.func
    def _rubs(self, contact, overlap, approach, slip):
        """1 for a contact with friction, else 0."""
        push = self.law.normal(contact, overlap, approach)
        return ti.cast(self.law.friction(contact, push, slip) != 0.0, ti.i32)


@ti.func
def _across(vector, normal):
    """Component of a vector across a normal."""
    return vector[1] * normal[0] - vector[0] * normal[1]
