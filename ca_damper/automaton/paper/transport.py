"""Transport by the rules of the paper: free flight, changes of cell (5.2), the lattice (Fig. 7).

The container's displacement is rounded to whole cells. When that staircase steps, moving particles
stay in place in the room, one cell the other way; the cluster that touches the wall behind it is
pushed along, at least at the wall's velocity. A column always has room for this.
"""

import taichi as ti

from ca_damper.automaton.accounting import Accounting
from ca_damper.automaton.cells import OnCells
from ca_damper.automaton.conflict_resolution import rank
from ca_damper.automaton.device import PUSHES
from ca_damper.automaton.lattice import DIRECTIONS, DOWN, EMPTY, HELD, UP, Lattice
from ca_damper.automaton.static_contact import StaticContact
from ca_damper.engine.random_numbers import MOVE
from ca_damper.engine.recorder import EventCounts

#: Effects of a turn on the distance travelled.
READINGS = ("signed", "signed_through_walls", "reset", "kept")


@ti.data_oriented
class Accumulator:
    """Distance travelled after a turn: one of four readings of a rule that the paper leaves open.

    The paper says that the distance is summed up to a cell's width (eq. 8), but not how a turn
    changes the sum. ``signed`` takes the sum for a position: a turn straight back changes its sign,
    and a wall sets it to the wall's position.
    ``signed_through_walls`` skips walls, ``reset`` starts anew at every turn, ``kept`` keeps it.
    """

    def __init__(self, reading: str, lattice: Lattice):
        self.reading, self.lattice = reading, lattice

    @ti.func
    def turned(self, travelled, old, new):
        """Distance travelled [m] after a turn from direction old to new."""
        result = travelled
        if ti.static(self.reading.startswith("signed")):
            result = travelled * self.lattice.cosine[old, new]
        elif ti.static(self.reading == "reset"):
            if old != new:
                result = 0.0
        return result

    @ti.func
    def after_wall(self, travelled, old, new, place):
        """Distance travelled [m] after meeting a wall that stands ``place`` [m] above its cells."""
        result = self.at_wall(new, place)
        if ti.static(self.reading != "signed"):
            result = self.turned(travelled, old, new)
        return result

    @ti.func
    def at_wall(self, kind, place):
        """Distance travelled [m] of a particle that leaves a wall."""
        result = 0.0
        if ti.static(self.reading == "signed"):
            result = place * self.lattice.upward(kind)
        return result

    @ti.func
    def distance_to_wall(self, travelled, kind, direction, width):
        """Distance travelled [m] of a particle ahead of a wall that pushes its cell along."""
        result = 0.0
        if ti.static(self.reading == "signed"):
            if self.lattice.upward(kind) * direction == 1.0:
                result = max(travelled - width, -width)
        return result


@ti.data_oriented
class PaperTransport(OnCells):
    """Flight of the particles, and how they follow the lattice."""

    def __init__(self, resting: StaticContact, accounting: Accounting, event_counts: EventCounts):
        super().__init__(resting.cells)
        self.resting, self.accumulator = resting, resting.accumulator
        self.accounting, self.event_counts = accounting, event_counts
        table = self.table
        self.touching, self.crossing = table.field(ti.i32, "cells"), table.field(ti.i16, "cells")
        self.touching_count, self.crossing_count = table.field(ti.i32), table.field(ti.i32)
        self.pushed, self.border = table.field(ti.i8, "cells"), table.field(ti.i16, "cells")

    @ti.func
    def fly_all(self, s, motion, pull):
        """One step of all particles; returns what the lattice gives the container [quanta]."""
        touching, crossing, oblique = 0, 0, 0
        for k in range(self.cells.traversal.begin(s), self.cells.traversal.end(s)):
            cell = self.cells.traversal.cell(s, k)
            touches, free, upward = self.fly(s, cell, self.table.dt[s], pull)
            if touches:
                self.touching[s, touching] = cell
                touching += 1
            if free:
                self.crossing[s, crossing] = ti.cast(cell, ti.i16)
                crossing += 1
            if ti.static(self.accounting.counts_all):
                if upward * upward == 0.25:
                    oblique += 1
        self.touching_count[s], self.crossing_count[s] = touching, crossing
        # On an oblique flight gravity acts by a quarter: the lattice holds the rest.
        return self.accounting.lattice_impulse(0.75 * pull * oblique)

    @ti.func
    def fly(self, s, cell, dt, pull):
        """Advance the content of a cell by a step."""
        # Empty cells and walls take the same path: their speed and pull are zero.
        kind = self.cells.at(s, cell)
        upward = self.lattice.upward(kind)
        speed = self.cells.speed[s, cell] - pull * upward
        travelled = self.cells.travelled[s, cell]
        if speed < 0.0:
            # Of an oblique flight only the vertical part is left: momentum along x is kept.
            speed = -speed * upward
            travelled = self.accumulator.turned(travelled, kind, DOWN)
            kind = DOWN
            self.cells.kind[s, cell] = ti.cast(DOWN, ti.i8)
        travelled += speed * dt
        due = travelled >= self.parameters.width[s]
        blocked = self.cells.at(s, self.lattice.cell_ahead(s, cell, kind)) != EMPTY
        if blocked and due:
            # No particle gets deeper into another than where the next step frees it.
            travelled = self.parameters.width[s]
        self.cells.speed[s, cell] = speed
        self.cells.travelled[s, cell] = travelled
        touches = blocked or self.resting.noticed(s, cell, kind)
        return touches, due and not blocked, upward

    @ti.func
    def move_all(self, s, step, shared):
        """Move particles to their new cells, one claimant for each cell."""
        claimants = 0
        for k in range(self.crossing_count[s]):
            cell = ti.cast(self.crossing[s, k], ti.i32)
            # A collision may have turned it since.
            if self.cells.travelled[s, cell] >= self.parameters.width[s]:
                target = self.lattice.cell_ahead(s, cell, self.cells.at(s, cell))
                if self.cells.at(s, target) == EMPTY:
                    self.conflicts.claim(s, target, rank(step, shared, cell, MOVE))
                    self.crossing[s, claimants] = ti.cast(cell, ti.i16)
                    claimants += 1
        for k in range(claimants):
            cell = ti.cast(self.crossing[s, k], ti.i32)
            target = self.lattice.cell_ahead(s, cell, self.cells.at(s, cell))
            if self.conflicts.holds(s, target, rank(step, shared, cell, MOVE)):
                left = self.cells.travelled[s, cell] - self.parameters.width[s]
                self.cells.relocate(s, cell, target, left)
                self.accounting.arrive(s, target)

    @ti.func
    def follow(self, s, step, motion):
        """Follow the container's staircase; returns what pushes give it [quanta]."""
        direction = self.cells.step_along(s, step, motion, self.parameters.width[s])
        impulse = ti.cast(0, ti.i64)
        if direction != 0:
            self.mark(s, direction)
            for k in range(self.cells.traversal.begin(s), self.cells.traversal.end(s)):
                cell = self.cells.traversal.cell(s, k)
                if self.pushed[s, cell] == 1 and self.cells.at(s, cell) != HELD:
                    impulse += self.push(s, cell, direction, motion.v)
            self.shift(s, direction)
            self.cells.traversal.sort(s, self.cells)
        return impulse

    @ti.func
    def mark(self, s, course):
        """Mark the particles that touch the wall behind and all that hang together with them."""
        number, size = 0, self.lattice.size[s]
        for cell in range(size.cells + 1):
            self.pushed[s, cell] = ti.cast(0, ti.i8)
        for column in range(size.columns):
            number = self.reach(s, self.lattice.cell_from(s, column, 0, course), course, number)
        while number > 0:
            number -= 1
            cell = ti.cast(self.border[s, number], ti.i32)
            for direction in range(DIRECTIONS):
                number = self.reach(s, self.lattice.cell_ahead(s, cell, direction), course, number)

    @ti.func
    def reach(self, s, cell, direction, number):
        """Mark a particle unless it is, and put it on the border; returns the border's new size."""
        # The floor pushes through the heap that it holds; the ceiling pushes against no heap.
        result = number
        kind = self.cells.at(s, cell)
        is_free = kind < DIRECTIONS or (kind == HELD and direction > 0)
        if is_free and self.pushed[s, cell] == 0:
            self.pushed[s, cell] = ti.cast(1, ti.i8)
            self.border[s, number] = ti.cast(cell, ti.i16)
            result = number + 1
        return result

    @ti.func
    def push(self, s, cell, direction, velocity):
        """Push one particle along; returns its counted gain of velocity along x [quanta]."""
        kind = self.cells.at(s, cell)
        gain = velocity - self.cells.vertical_speed(s, cell)
        if gain * direction > 0.0:
            self.event_counts.note(s, PUSHES)
            kind = UP if velocity > 0.0 else DOWN
            travelled = self.accumulator.at_wall(kind, self.cells.offset[s])
            self.cells.put(s, cell, kind, abs(velocity), travelled)
        else:
            gain = 0.0
            self.cells.travelled[s, cell] = self.accumulator.distance_to_wall(
                self.cells.travelled[s, cell], kind, direction, self.parameters.width[s]
            )
        return self.accounting.push(s, gain)

    @ti.func
    def shift(self, s, direction):
        """Keep all others in place in the room: one cell the other way, those in front first."""
        for column in range(self.lattice.size.columns[s]):
            for k in range(self.lattice.size.rows[s]):
                cell = self.lattice.cell_from(s, column, k, direction)
                if self.cells.at(s, cell) < DIRECTIONS and self.pushed[s, cell] == 0:
                    self.cells.relocate(s, cell, cell - direction, self.cells.travelled[s, cell])
