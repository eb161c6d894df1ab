"""Where the sphere pairs of the contact pairs lie: those of a pair that stays are not moved."""

import taichi as ti

from taichi_dem.kit.types import real

#: Entries that nobody uses any more before all are packed, beside as many as are in use.
SLACK = 4096


@ti.data_oriented
class Candidates:
    """Room for the sphere pairs of a ``Contacts``, and for the impulses a solver keeps of them.

    A search writes what it finds behind all others. Entries that fall out of use are left behind,
    until the rest is packed in the order in which it is visited.
    sphere, impulse: copies on the way.
    """

    scratch_fields = ("sphere", "impulse")

    def __init__(self, contacts, solver=None):
        self.contacts, self.solver, self.solves = contacts, solver, solver is not None
        self.sphere = ti.Vector.field(2, ti.i32, shape=contacts.sphere_capacity)
        if self.solves:
            self.impulse = ti.Vector.field(3, real, shape=contacts.sphere_capacity)

    @ti.func
    def take(self, count):
        """Place behind all others for a number of sphere pairs."""
        place = self.contacts.sphere_end[None]
        self.contacts.sphere_end[None] = place + count
        return place

    @ti.func
    def pack(self, one):
        """Put all side by side in the order of their pairs, where too many are out of use."""
        end, used = self.contacts.sphere_end[None], self.contacts.sphere_count[None]
        if end > 2 * used + SLACK or end > self.contacts.sphere_limit[None] // 2:
            place = 0
            for p in range(self.contacts.pair_count[None]):
                first, last = self.contacts.pair_first[p], self.contacts.pair_last[p]
                self.contacts.pair_first[p] = place
                for k in range(first, last):
                    self._lift(k, place)
                    place += 1
                self.contacts.pair_last[p] = place
            for k in range(place):
                self._lay(k)
            self.contacts.sphere_end[None] = place

    @ti.func
    def _lift(self, k, place):
        self.sphere[place] = self.contacts.pair_sphere[k]
        if ti.static(self.solves):
            self.impulse[place] = self.solver.pairs.impulse[k]

    @ti.func
    def _lay(self, k):
        self.contacts.pair_sphere[k] = self.sphere[k]
        if ti.static(self.solves):
            self.solver.pairs.impulse[k] = self.impulse[k]
