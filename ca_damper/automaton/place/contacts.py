"""Contacts of the grains: which of them meet in a step, by their positions; laws of impacts.

Places across a column are not kept: a grain is anywhere in its column with equal probability.
Two discs of diameter d in neighbouring columns are then b apart across with the density b / d^2,
for b up to d, and touch once their heights differ by z d with z^2 + (b / d)^2 = 1. Those that have
not touched so far are a share (1 + z^2) / 2 of all pairs, which gives the rate below.
"""

import taichi as ti

from ca_damper.automaton.cells import OnCells
from ca_damper.automaton.conflict_resolution import SLOTS, rank_in_phase
from ca_damper.automaton.lattice import HELD, UP, WALL
from ca_damper.automaton.place.grains import Heap
from ca_damper.engine.random_numbers import GLANCE, SIDE, bits, scrambled, unit

#: Kinds of event: at floor or ceiling, at a side wall, coming to rest, in a column, across columns.
END, BRUSH, JOIN, LINE, OBLIQUE = range(5)
#: First phase of the claims of a step.
_BLOWS = 0
_CELL_BITS, _CELL = 12, (1 << 12) - 1
# Slots of the events of a cell; oblique ones have the last four.
_AT_END, _AT_SIDE, _ABOVE, _BESIDE = range(4)

#: Least free width [diameters] that a row leaves: its grains never stand at quite the same height.
LEAST_WIDTH = 0.125
#: A diameter, and the largest ``contact_rate`` by the approach, with more than rounding added.
_NEAR = 1.0 + 1e-9
_MOST_RATE = _NEAR * 4.0 / LEAST_WIDTH


@ti.func
def contact_rate(approach, rise, free_width):
    """Rate of blows [1/s] of two grains in neighbouring columns."""
    # Rods on a line meet in inverse proportion to the free width (Tonks 1936).
    return 2.0 * approach / (1.0 + rise * rise) * 2.0 / ti.max(free_width, LEAST_WIDTH)


@ti.func
def chord(rise):
    """Width [diameters] that a disc takes at a height of ``rise`` diameters beside it, up to 1."""
    return ti.sqrt(ti.max(0.0, 1.0 - rise * rise))


@ti.func
def line_of_centres(draw):
    """Line between two discs that meet in a column, (across, up), for a draw in [0, 1)."""
    # As in a gas of discs, all impact parameters are equally likely.
    across = 2.0 * draw - 1.0
    return ti.Vector([across, chord(across)])


@ti.func
def dragged(slip, most):
    """Friction against a slip: as large as the slip, but not larger than ``most``; signed."""
    size = ti.min(most, ti.abs(slip))
    return size if slip > 0.0 else -size


@ti.func
def speed_change(relative, line, restitution, friction):
    """Change of velocity [m/s] of the first of two equal grains; the second has the opposite."""
    normal = relative.dot(line)
    change = ti.Vector([0.0, 0.0])
    if normal > 0.0:
        push = 0.5 * (1.0 + restitution) * normal
        slip = relative[1] * line[0] - relative[0] * line[1]
        drag = dragged(0.5 * slip, friction * push)
        change = ti.Vector([drag * line[1] - push * line[0], -drag * line[0] - push * line[1]])
    return change


@ti.func
def common_velocity(velocity, approaches, blows, recoil, restitution):
    """Velocity of the container after all blows of a step on floor and ceiling [m/s]."""
    # V' = (M V + m sum(v + e (v - V))) / (M + n m) in any order of blows; grains leave with V' - e
    # (v - V).
    return velocity + recoil * (1.0 + restitution) * approaches / (1.0 + blows * recoil)


@ti.func
def most_drag(slip, share):
    """Largest friction [m/s] of one of n grains at the side walls: with more they would drag on."""
    # At this limit all sliding grains and the container end with one velocity.
    return ti.abs(slip) / (1.0 + share)


@ti.data_oriented
class GrainContacts(OnCells):
    """Find the events of a step and the grains that each of them needs.

    shared: hash of seed and step, read late, so that not all ranks are computed ahead.
    """

    def __init__(self, resting: Heap):
        super().__init__(resting.cells)
        self.resting = resting
        self.events = self.table.field(ti.i32, "cells", SLOTS)
        self.ranks = self.table.field(ti.i64, "cells", SLOTS)
        self.shared = self.table.field(ti.u32)

    @ti.func
    def find_all(self, s, step, shared, pull, pressed):
        """Note and claim all events; returns their number."""
        count, traversal = 0, self.cells.traversal
        self.shared[s] = shared
        # A bound of the probability to meet, by the relative speed.
        steep = _MOST_RATE * self.table.dt[s] / self.parameters.width[s]
        for k in range(traversal.begin(s), traversal.end(s)):
            cell = traversal.cell(s, k)
            kind = self.cells.at(s, cell)
            if kind == UP:
                count = self.at_ends(s, step, count, cell, pull, pressed)
                count = self.at_side(s, step, shared, count, cell)
            if kind == UP or kind == HELD:
                count = self.above(s, step, count, cell, pull, pressed)
                count = self.beside(s, step, shared, count, cell, steep)
        return count

    @ti.func
    def note(self, s, step, count, owner, slot, cell, other, kind: ti.template()):
        """Note an event and claim its grains; other: second grain, 0 for none."""
        ranked = rank_in_phase(step, self.shared[s], _BLOWS, owner, slot)
        self.conflicts.claim(s, cell, ranked)
        if other != 0:
            self.conflicts.claim(s, other, ranked)
        self.write(s, count, cell, other, kind)
        self.ranks[s, count // SLOTS, count % SLOTS] = ranked
        return count + 1

    @ti.func
    def write(self, s, k, cell, other, kind):
        """Write event number k."""
        self.events[s, k // SLOTS, k % SLOTS] = (
            ((kind << _CELL_BITS) | other) << _CELL_BITS
        ) | cell

    @ti.func
    def read(self, s, k):
        """Cell, second cell and kind of event number k."""
        entry = self.events[s, k // SLOTS, k % SLOTS]
        return entry & _CELL, (entry >> _CELL_BITS) & _CELL, entry >> (2 * _CELL_BITS)

    @ti.func
    def wins(self, s, k):
        """Whether event number k has all the grains that it needs."""
        ranked = self.ranks[s, k // SLOTS, k % SLOTS]
        cell, other, _ = self.read(s, k)
        result = self.conflicts.holds(s, cell, ranked)
        return result and (other == 0 or self.conflicts.holds(s, other, ranked))

    @ti.func
    def at_ends(self, s, step, count, cell, pull, pressed):
        """Floor and ceiling, where the container has them at the end of the step."""
        result = count
        over = self.cells.travelled[s, cell] - self.cells.offset[s]
        approach = self.cells.container[s] - self.cells.speed[s, cell]
        if over <= 0.0 and approach > 0.0 and self.cells.at(s, cell - 1) == WALL:
            if self.resting.takes(s, approach, pull, pressed):
                result = self.note(s, step, count, cell, _AT_END, cell, 0, JOIN)
            else:
                result = self.note(s, step, count, cell, _AT_END, cell, 0, END)
        elif over >= 0.0 and approach < 0.0 and self.cells.at(s, cell + 1) == WALL:
            result = self.note(s, step, count, cell, _AT_END, cell, 0, END)
        return result

    @ti.func
    def at_side(self, s, step, shared, count, cell):
        """Side walls, met as columns are left: by chance, at the rate |u| / d."""
        result = count
        velocity = self.cells.across[s, cell]
        if velocity != 0.0:
            side = 1 if velocity > 0.0 else -1
            if self.lattice.in_side_wall(s, cell + side * self.lattice.size.height[s]):
                share = ti.abs(velocity) * self.table.dt[s] / self.parameters.width[s]
                if unit(bits(shared, cell, SIDE)) < share:
                    result = self.note(s, step, count, cell, _AT_SIDE, cell, 0, BRUSH)
        return result

    @ti.func
    def above(self, s, step, count, cell, pull, pressed):
        """The grain above in the column, once its place is less than a diameter away."""
        result, upper = count, cell + 1
        held = self.cells.at(s, cell) == HELD
        if self.cells.is_grain(s, upper) and not (held and self.cells.at(s, upper) == HELD):
            approach = self.cells.velocity(s, cell)[1] - self.cells.velocity(s, upper)[1]
            if approach > 0.0 and self.cells.overlap(s, cell) >= 0.0:
                if held and self.resting.takes(s, approach, pull, pressed):
                    result = self.note(s, step, count, cell, _ABOVE, upper, 0, JOIN)
                elif held:
                    result = self.note(s, step, count, cell, _ABOVE, upper, 0, END)
                else:
                    result = self.note(s, step, count, cell, _ABOVE, cell, upper, LINE)
        return result

    @ti.func
    def beside(self, s, step, shared, count, cell, steep):
        """Grains of the column to the right less than a diameter higher or lower."""
        result, height = count, self.lattice.size.height[s]
        if not self.lattice.in_side_wall(s, self.lattice.column_beside(s, cell, 1)):
            # The columns stand half a cell apart, so that one of five rows is too far; beyond floor
            # and ceiling of that column there are walls alone.
            lowest = cell + height - 2 + self.lattice.raised(s, cell)
            left = self.partners(s, lowest, self.cells.at(s, cell))
            while left != 0:
                # Number of the lowest bit, and the others.
                bit = left & -left
                k, left = (bit >> 1) - (bit >> 3), left ^ bit
                # Rows and columns together: the lowest is one cell and a half below.
                if self.meets(s, shared, cell, lowest + k, k - 1.5, steep):
                    result = self.note(
                        *(s, step, result, cell, _BESIDE + k, cell, lowest + k, OBLIQUE)
                    )
        return result

    @ti.func
    def partners(self, s, lowest, kind):
        """Which of four cells hold a grain that one of a kind may meet, a bit each."""
        # Without a branch, which would go either way by chance.
        result = 0
        for k in ti.static(range(4)):
            other = self.cells.at(s, lowest + k)
            there = ti.select(other == UP, 1, ti.select((other == HELD) & (kind == UP), 1, 0))
            result |= there << k
        return result

    @ti.func
    def meets(self, s, shared, cell, other, rows, steep):
        """Whether two grains of neighbouring columns touch in this step, by chance."""
        width, result = self.parameters.width[s], False
        distance = self.cells.way(s, other) - self.cells.way(s, cell)
        # Most pairs are told apart without a division or a root.
        if ti.abs(rows * width + distance) < _NEAR * width:
            relative = self.cells.velocity(s, cell) - self.cells.velocity(s, other)
            draw = unit(scrambled(bits(shared, cell, GLANCE) + ti.cast(other, ti.u32)))
            if draw < steep * (ti.abs(relative[0]) + ti.abs(relative[1])):
                rise = rows + distance / width
                result = self.touches(s, draw / self.table.dt[s], cell, other, relative, rise)
        return result

    @ti.func
    def touches(self, s, chance, cell, other, relative, rise):
        """The same of two that are less than a diameter apart, from a draw by the step [1/s]."""
        width, result = self.parameters.width[s], False
        approach = relative.dot(ti.Vector([chord(rise), rise]))
        # Most draws say no whatever stands beside the two, which takes long to find.
        if (
            rise * rise < 1.0
            and approach > 0.0
            and chance < contact_rate(approach / width, rise, 0.0)
        ):
            free = 2.0 - self.taken(s, cell, -1) - self.taken(s, other, 1)
            result = chance < contact_rate(approach / width, rise, free)
        return result

    @ti.func
    def taken(self, s, cell, direction):
        """Width [diameters] that the grain beside this one takes, on the left (way -1) or right."""
        result, base = 1.0, self.lattice.column_beside(s, cell, direction)
        if not self.lattice.in_side_wall(s, base):
            result, width = 0.0, self.parameters.width[s]
            own = self.cells.height(s, cell) / width
            nearest = base + 1 + self.lattice.nearest_row(s, base, own)
            for near in range(nearest - 1, nearest + 2):
                if self.cells.is_grain(s, near):
                    result = ti.max(result, chord(self.cells.height(s, near) / width - own))
        return result
