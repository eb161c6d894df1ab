"""Tangential springs between contact spheres, for friction laws with memory."""

import taichi as ti

from taichi_dem.kit.products import matvec, transposed_matvec
from taichi_dem.step.multirate.schedule import Schedule


@ti.data_oriented
class TangentialSprings:
    """Calls a friction law with memory: vectors here are in world axes, there in the first body's.

    evaluated: of a pair, one more than the tick at which it was last evaluated, 0 for never.
    """

    def __init__(self, schedule: Schedule):
        self.friction, self.schedule = schedule.tables.friction, schedule
        self.present = schedule.has_contact and schedule.contacts.remembers
        if self.present:
            self.evaluated = schedule.store.column("evaluated", ti.i64)

    @ti.func
    def elapsed(self, p):
        """Seconds since pair p was last evaluated, 0 for never; it is evaluated now."""
        elapsed, present = 0.0, self.schedule.state.tick[None] + 1
        if self.evaluated[p] > 0:
            elapsed = self.schedule.seconds(present - self.evaluated[p])
        self.evaluated[p] = present
        return elapsed

    @ti.func
    def follow(self, k, rotation, normal, way):
        """Stretch the spring of sphere pair k by ``way`` [m]."""
        across = transposed_matvec(rotation, normal)
        self.friction.follow(k, across, transposed_matvec(rotation, way))

    @ti.func
    def slip(self, m, k, rotation, bound, way):
        """Shorten the spring of sphere pair k to a bound [N] after ``way`` [m]; energy [J]."""
        return self.friction.slip(m, k, bound, transposed_matvec(rotation, way))

    @ti.func
    def force(self, m, k, rotation):
        """Force of the spring of sphere pair k on the second sphere [N]."""
        return matvec(rotation, self.friction.spring(m, k))

    @ti.func
    def part(self, m, k):
        """Energy [J] that is lost as the spheres of a pair no longer touch; 0 without springs."""
        energy = 0.0
        if ti.static(self.present):
            energy = self.friction.part(m, k)
        return energy

    @ti.func
    def stored(self, m, k):
        """Energy of the spring of sphere pair k [J]; 0 without springs."""
        energy = 0.0
        if ti.static(self.present):
            energy = self.friction.stored(m, k)
        return energy
