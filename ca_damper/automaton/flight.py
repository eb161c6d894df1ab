"""Free flight and the step into the next cell (Komatsuzaki et al., 5.2)."""

import taichi as ti

from ca_damper.automaton.ledger import GRAVITY
from ca_damper.automaton.rivals import rank
from ca_damper.lattice import DIRECTIONS, DOWN, EMPTY
from ca_damper.random_numbers import MOVE


@ti.data_oriented
class Flight:
    """Gravity, way, and which particles have something ahead or a cell to change.

    due: cells of particles that may change their cell, shape (scenes, cells).
    """

    def __init__(self, parts):
        self.cells, self.lattice, self.rivals = parts.cells, parts.lattice, parts.rivals
        self.accumulator, self.resting = parts.accumulator, parts.resting
        self.accounting, self.ledger, self.numbers = parts.accounting, parts.ledger, parts.numbers
        self.due = ti.field(ti.i16, shape=(self.cells.kind.shape[0], self.lattice.cells))

    @ti.func
    def fly_all(self, s, dt, pull, contacts: ti.template()):
        """One step of all particles; returns how many have something ahead, how many are due."""
        contact_count, due_count = 0, 0
        for k in range(self.cells.traversal.size(s)):
            cell = self.cells.traversal.cell(s, k)
            touches, free = self.fly(s, cell, dt, pull)
            if touches:
                contacts[s, contact_count] = cell
                contact_count += 1
            if free:
                self.due[s, due_count] = ti.cast(cell, ti.i16)
                due_count += 1
        return contact_count, due_count

    @ti.func
    def fly(self, s, cell, dt, pull):
        """One step of what stands in a cell; returns whether it touches something, may move on.

        Gravity acts by its projection. A particle that has risen as far as it can turns straight
        down. Empty cells and walls go the same way: their speed and their pull are zero.
        """
        kind = self.cells.at(s, cell)
        speed = self.cells.speed[s, cell] - pull * self.lattice.upward(kind)
        travelled = self.cells.travelled[s, cell]
        self.note_gravity(s, kind, pull)
        if speed < 0.0:
            self.note_turn(s, kind, speed)
            speed = -speed
            travelled = self.accumulator.turned(travelled, kind, DOWN)
            kind = DOWN
            self.cells.kind[s, cell] = ti.cast(DOWN, ti.i8)
        travelled += speed * dt
        due = travelled >= self.numbers.width[None]
        blocked = self.cells.at(s, self.lattice.ahead(cell, kind)) != EMPTY
        if blocked and due:
            # No particle gets deeper into another than where the next step frees it.
            travelled = self.numbers.width[None]
        self.cells.speed[s, cell] = speed
        self.cells.travelled[s, cell] = travelled
        return blocked or self.resting.noticed(s, cell, kind), due and not blocked

    @ti.func
    def note_gravity(self, s, kind, pull):
        """Enter what gravity gives to an oblique flight less than to a straight one."""
        if ti.static(self.ledger.active):
            if kind < DIRECTIONS:
                upward = self.lattice.upward(kind)
                self.ledger.add(s, GRAVITY, pull * (1.0 - upward * upward))

    @ti.func
    def note_turn(self, s, kind, speed):
        """Enter what turning straight down at the top of an oblique flight changes."""
        if ti.static(self.ledger.active):
            self.ledger.add(s, GRAVITY, speed - speed * self.lattice.upward(kind))

    @ti.func
    def move_all(self, s, step, shared, due_count):
        """Let the particles that are due change cells, one of the claimants for each cell."""
        claimants = 0
        for k in range(due_count):
            cell = ti.cast(self.due[s, k], ti.i32)
            # A collision may have turned it since.
            if self.cells.travelled[s, cell] >= self.numbers.width[None]:
                target = self.lattice.ahead(cell, self.cells.at(s, cell))
                if self.cells.at(s, target) == EMPTY:
                    self.rivals.claim(s, target, rank(step, shared, cell, MOVE))
                    self.due[s, claimants] = ti.cast(cell, ti.i16)
                    claimants += 1
        for k in range(claimants):
            cell = ti.cast(self.due[s, k], ti.i32)
            target = self.lattice.ahead(cell, self.cells.at(s, cell))
            if self.rivals.holds(s, target, rank(step, shared, cell, MOVE)):
                left = self.cells.travelled[s, cell] - self.numbers.width[None]
                self.cells.relocate(s, cell, target, left)
                self.accounting.arrive(s, target)
