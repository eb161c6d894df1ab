"""Numbers of the contacts of two spheres, and of spheres and walls, by the sizes of the spheres."""

import taichi as ti

from ca_damper.filling import Fillings
from ca_damper.spheres.contact_law import (
    Contact,
    SphereContactLaw,
    contact_members,
    pair_numbers,
    wall_numbers,
)
from ca_damper.spheres.rotation import Rotation

#: Contacts that are evaluated together.
LANES = 8

lanes = ti.types.vector(LANES, ti.f64)
vec3 = ti.types.vector(3, ti.f64)


@ti.dataclass
class ContactLanes:
    """Numbers of so many contacts, those of ``Contact`` as a vector each."""

    stiffness: lanes
    damping: lanes
    friction: lanes
    reach: lanes
    yielding: lanes
    grip: lanes
    shear: lanes
    shear_damping: lanes
    shear_yielding: lanes
    since: ti.f64


class OfSizes:
    """Base of contacts that differ by the sizes of the spheres; count: of contacts of a scene."""

    constant_fields = ("contact",)

    def __init__(self, law: SphereContactLaw, rotation: Rotation, count: int):
        self.law, self.rotation, self.bodies = law, rotation, rotation.bodies
        self.table, self.kinds = self.bodies.table, self.bodies.kinds
        self.contact = self.table.structs(Contact, count)

    def upload(self, fillings: Fillings) -> None:
        """Take over the numbers of the spheres of each scene."""
        fillings.write(self.contact, self._contacts)


@ti.data_oriented
class PairContacts(OfSizes):
    """Contacts of two spheres; contact: one for each pair of sizes, (scenes, kinds * kinds)."""

    def __init__(self, law: SphereContactLaw, rotation: Rotation):
        super().__init__(law, rotation, rotation.bodies.kinds**2)

    def _contacts(self, options):
        pairs = [divmod(k, self.kinds) for k in range(self.kinds * self.kinds)]
        numbers = [pair_numbers(options, *pair) for pair in pairs]
        return contact_members(numbers, self.rotation.tangential_share)

    @ti.func
    def over_step(self, s, dt, since):
        """The contact for a step, as of the law; of several sizes only its reach is the widest."""
        contact = self.law.over_step(self.contact[s, 0], dt, since)
        if ti.static(self.kinds > 1):
            contact.reach = 2.0 * self.bodies.body[s].radius
        return contact

    @ti.func
    def at_rest(self, s, i, j):
        """The contact of spheres i and j, before a step is known."""
        k = 0
        if ti.static(self.kinds > 1):
            k = self.bodies.kind[i] * self.kinds + self.bodies.kind[j]
        return self.contact[s, k]

    @ti.func
    def between(self, s, i, j, contact):
        """The contact of spheres i and j for a step; contact: what ``over_step`` gave for it."""
        found = contact
        if ti.static(self.kinds > 1):
            found = self.law.over_step(self.at_rest(s, i, j), contact.dt, contact.since)
        return found

    @ti.func
    def of_lanes(self, s, pairs: ti.template(), contact):
        """The contacts of a vector of pairs; one for all of them where there is one size."""
        if ti.static(self.kinds == 1):
            return contact
        found = [self.between(s, *pairs[k], contact) for k in ti.static(range(LANES))]
        return ContactLanes(
            stiffness=ti.Vector([found[k].stiffness for k in ti.static(range(LANES))]),
            damping=ti.Vector([found[k].damping for k in ti.static(range(LANES))]),
            friction=ti.Vector([found[k].friction for k in ti.static(range(LANES))]),
            reach=ti.Vector([found[k].reach for k in ti.static(range(LANES))]),
            yielding=ti.Vector([found[k].yielding for k in ti.static(range(LANES))]),
            grip=ti.Vector([found[k].grip for k in ti.static(range(LANES))]),
            shear=ti.Vector([found[k].shear for k in ti.static(range(LANES))]),
            shear_damping=ti.Vector([found[k].shear_damping for k in ti.static(range(LANES))]),
            shear_yielding=ti.Vector([found[k].shear_yielding for k in ti.static(range(LANES))]),
            since=contact.since,
        )


@ti.data_oriented
class WallContacts(OfSizes):
    """Contacts of a sphere with the walls, by scene and size of spheres."""

    def __init__(self, law: SphereContactLaw, rotation: Rotation):
        super().__init__(law, rotation, rotation.bodies.kinds)
        self.recoiling = self.table.vector(3, ti.f64, self.kinds)

    def _contacts(self, options):
        numbers = [wall_numbers(options, k) for k in range(self.bodies.kinds)]
        return contact_members(numbers, self.rotation.tangential_share)

    @ti.func
    def reset(self, s):
        """Take over how the container of scene s recoils."""
        for k in range(self.bodies.kinds):
            contact, recoil = self.contact[s, k], self.table.recoil[s]
            mass = 0.5 / contact.yielding
            self.recoiling[s, k] = vec3(
                contact.damping * self.law.damping_ratio(1.0 / (1.0 + mass * recoil)),
                contact.yielding + 0.5 * recoil,
                contact.grip / (1.0 + self.rotation.tangential_share * mass * recoil),
            )

    @ti.func
    def over_step(self, s, kind, dt, since):
        """The contacts for a step, as of the law: with side walls, and with floor and ceiling."""
        side, ends = self.contact[s, kind], self.contact[s, kind]
        recoiling = self.recoiling[s, kind]
        ends.damping, ends.yielding = recoiling[0], recoiling[1]
        side.grip = recoiling[2]
        return self.law.over_step(side, dt, since), self.law.over_step(ends, dt, since)

    @ti.func
    def at_rest(self, s, i):
        """The contact of sphere i with a wall that does not recoil, before a step is known."""
        return self.contact[s, self.bodies.kind_of(i)]

    @ti.func
    def of(self, s, i, contacts):
        """The contacts of sphere i for a step; contacts: what ``over_step`` gave for the first."""
        side, ends = contacts
        if ti.static(self.bodies.kinds > 1):
            side, ends = self.over_step(s, self.bodies.kind[i], side.dt, side.since)
        return side, ends
