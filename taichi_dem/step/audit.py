"""Audit of sleep: a few of the bonds that sleep are looked at.

One in 1024 of the bonds is looked at in every substep, by a hash of the number of the substep: no
result decides what is looked at, and nothing that the audit does remains.
"""

import taichi as ti

from taichi_dem.step.multirate.lists import Places
from taichi_dem.step.multirate.schedule import Schedule

#: One bond in so many is looked at; a power of two.
RATE = 1024


@ti.func
def mixed(number):
    """Bits of a counter, mixed, as an unsigned number of 32 bits (Wang's hash)."""
    x = ti.cast(number, ti.u32)
    x = (x ^ ti.u32(61)) ^ (x >> ti.u32(16))
    x *= ti.u32(9)
    x = x ^ (x >> ti.u32(4))
    x *= ti.u32(0x27D4EB2D)
    return x ^ (x >> ti.u32(15))


@ti.data_oriented
class Audit(Places):
    """List of the bonds that are looked at in a substep, and what was found.

    audited, misses: bonds asleep. One is missed where it is opened by more than the share at which
    a body wakes others, or its springs hold more than the energy at the speed that wakes them.
    """

    scratch_fields = ("first",)

    def __init__(self, schedule: Schedule):
        self.tables, self.state = schedule.tables, schedule.state
        self.schedule, self.sleeping = schedule, schedule.sleeping
        self.first = ti.field(ti.i32, shape=())
        self.audited, self.misses = (ti.field(ti.i64, shape=()) for _ in range(2))

    @ti.func
    def choose(self, one):
        """Choose the bonds of this substep."""
        number = mixed(self.schedule.evaluations[0])
        self.first[None] = ti.cast(number & ti.u32(RATE - 1), ti.i32)

    @ti.func
    def count(self, low):
        """Number of bonds to look at."""
        return (self.tables.bond_count[None] - self.first[None] + (RATE - 1)) // RATE

    @ti.func
    def visit(self, a):
        """Look at one bond."""
        b = self.first[None] + RATE * a
        slots = self.tables.bond_slots[b]
        i, j = slots[0] >> 2, slots[1] >> 2
        if self.state.broken_tick[b] < 0:
            if not self.sleeping.both_awake(i, j):
                ti.atomic_add(self.audited[None], 1)
                if self.sleeping.leaves_out(b, i, j):
                    ti.atomic_add(self.misses[None], 1)
