"""Contacts of two spheres, by their sizes: one for all, or one for each pair of sizes."""

from typing import Any

import taichi as ti

from ca_damper.spheres.bodies import Bodies
from ca_damper.spheres.contact_law import Contact, ContactLaw, pair_numbers

#: Contacts that are evaluated together.
LANES = 8

lanes = ti.types.vector(LANES, ti.f64)


@ti.dataclass
class Contacts:
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


@ti.data_oriented
class PairContacts:
    """Numbers of the contact of two spheres.

    contact: a Contact for each pair of sizes, shape (kinds * kinds,). share: of the effective mass
    that resists a tangential impulse.
    """

    def __init__(self, bodies: Bodies, law: ContactLaw, share: float):
        self.bodies, self.law, self.share, self.kinds = bodies, law, share, bodies.kinds
        self.contact = Contact.field(shape=self.kinds * self.kinds)

    def load(self, options: Any) -> None:
        """Take over the numbers of spheres of the same structure."""
        pairs = [divmod(k, self.kinds) for k in range(self.kinds * self.kinds)]
        numbers = [pair_numbers(options, *pair) for pair in pairs]
        self.law.load(self.contact, numbers, self.share)

    @ti.func
    def over_step(self, dt, since):
        """The contact for a step, as of the law; of several sizes only its reach is the widest."""
        contact = self.law.over_step(self.contact[0], dt, since)
        if ti.static(self.kinds > 1):
            contact.reach = 2.0 * self.bodies.body[None].radius
        return contact

    @ti.func
    def at_rest(self, i, j):
        """The contact of spheres i and j, before a step is known."""
        k = 0
        if ti.static(self.kinds > 1):
            k = self.bodies.kind[i] * self.kinds + self.bodies.kind[j]
        return self.contact[k]

    @ti.func
    def between(self, i, j, contact):
        """The contact of spheres i and j for a step; contact: what ``over_step`` gave for it."""
        found = contact
        if ti.static(self.kinds > 1):
            found = self.law.over_step(self.at_rest(i, j), contact.dt, contact.since)
        return found

    @ti.func
    def of_lanes(self, pairs: ti.template(), contact):
        """The contacts of a vector of pairs; one for all of them where there is one size."""
        if ti.static(self.kinds == 1):
            return contact
        found = [self.between(pairs[k][0], pairs[k][1], contact) for k in ti.static(range(LANES))]
        return Contacts(
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
