"""Audit of what is skipped: a few of the skipped evaluations are made, compared, and forgotten.

One in 1024 of the bonds is looked at in every substep, by a hash of the number of the substep: no
result decides what is looked at, and nothing that the audit does remains.
"""

import taichi as ti

from taichi_dem.kit.types import vec2
from taichi_dem.physics.bond import unit_arm, unit_opening
from taichi_dem.state.activity import SLIP, SOFTENING
from taichi_dem.state.state import State
from taichi_dem.state.tables import Tables
from taichi_dem.step.advance import Advance
from taichi_dem.step.schedule import Schedule

#: One bond in so many is looked at; a power of two.
RATE = 1024
#: What is audited: units at which a law was not evaluated, and bonds asleep.
KINDS = ("softening", "slip", "asleep")
_ASLEEP = 2


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
class Audit:
    """List of the bonds that are looked at in a substep, and what was found.

    audited, misses: by kind, see KINDS. A law is missed where it would have given other bits, or a
    unit would have failed. A bond asleep is missed where it is opened by more than the share at
    which a body wakes others, or its springs hold more than the energy at the speed that wakes
    them. aside: memory of a law before it was evaluated.
    """

    scratch_fields = ("first",)

    def __init__(self, tables: Tables, state: State, schedule: Schedule, advance: Advance):
        self.tables, self.state, self.schedule, self.advance = tables, state, schedule, advance
        self.activity, self.sleeping = state.activity, schedule.sleeping
        self.first = ti.field(ti.i32, shape=())
        self.audited, self.misses = (ti.field(ti.i64, shape=len(KINDS)) for _ in range(2))
        self.memory = [_memory(law, tables) for law in (tables.tension, tables.shear)]
        self.has_memory = any(self.memory)

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
    def pick(self, a):
        """Place of one of them."""
        return a

    @ti.func
    def visit(self, a):
        """Look at one bond."""
        b = self.first[None] + RATE * a
        if self.state.broken_tick[b] < 0:
            slots = self.tables.bond_slots[b]
            if self.schedule.bonds.key[b] >= self.schedule.low[None]:
                self._laws(a, b)
            elif not self.sleeping.both_awake(slots[0] >> 2, slots[1] >> 2):
                self._book(
                    _ASLEEP, self.sleeping.leaves_out(b, slots[0] >> 2, slots[1] >> 2, self.advance)
                )

    @ti.func
    def _laws(self, a, b):
        """Compare the laws of a bond that are not active with the linear ones."""
        stiffness, motion = self.tables.bond_stiffness[b], self.advance.motion_of(b)
        m = self.tables.bond_pair[b]
        for q in range(3):
            u = 3 * b + q
            arm = unit_arm(motion, self.tables.vertex_slave[u])
            opening = unit_opening(motion, arm, self.tables.vertex_master[u])
            pull, sliding = stiffness[0] * opening[0], vec2(opening[1], opening[2])
            self._remember(3 * a + q, u, True)
            if ti.static(self.activity.laws[SOFTENING]):
                if not self.activity.has_begun(b, SOFTENING):
                    law = self.tables.tension.traction(m, stiffness[0], u, opening[0])
                    other = law != pull or self.tables.tension.failed(m, u) != 0
                    self._book(SOFTENING, other)
            if ti.static(self.activity.laws[SLIP]):
                if self.activity.has_begun(b, SOFTENING):
                    pull = self.tables.tension.traction(m, stiffness[0], u, opening[0])
                if not self.activity.has_begun(b, SLIP):
                    law, spent = self.tables.shear.traction(m, stiffness[1], u, sliding, -pull)
                    straight = stiffness[1] * sliding
                    other = law[0] != straight[0] or law[1] != straight[1] or spent != 0.0
                    self._book(SLIP, other)
            self._remember(3 * a + q, u, False)

    @ti.func
    def _book(self, kind: ti.template(), is_miss):
        ti.atomic_add(self.audited[kind], 1)
        if is_miss:
            ti.atomic_add(self.misses[kind], 1)

    @ti.func
    def _remember(self, place, u, aside: ti.template()):
        """Put the memory of the laws of a unit, and of its bond, aside, or bring it back."""
        for law in ti.static(range(2)):
            for field, other, units in ti.static(self.memory[law]):
                if ti.static(aside):
                    other[place // units] = field[u // units]
                else:
                    field[u // units] = other[place // units]


def _memory(law, tables):
    """Fields of a law with an entry for each unit or bond, each as a tuple of three.

    The field, a field to put entries aside, and how many units share an entry.
    """
    found, room = [], tables.capacity
    for field in law.state().values():
        units = {(room.units,): 1, (room.bonds,): 3}.get(field.shape)
        if units:
            size = 3 * (room.bonds // RATE + 1) // units
            rows, columns = getattr(field, "n", 1), getattr(field, "m", 1)
            if isinstance(field, ti.lang.matrix.MatrixField):
                aside = ti.Matrix.field(rows, columns, field.dtype, shape=size)
                aside = aside if columns > 1 else ti.Vector.field(rows, field.dtype, shape=size)
            else:
                aside = ti.field(field.dtype, shape=size)
            found.append((field, aside, units))
    return tuple(found)
