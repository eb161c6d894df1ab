"""Static contact: particles at rest on the floor move with it and load it.

The paper names its absence as the reason why the response peak moves the wrong way (6.2). Held
particles are carried until the container's acceleration falls below -g; then the heap lifts off.
"""

import taichi as ti

from ca_damper.automaton.cells import Cells, OnCells
from ca_damper.automaton.lattice import DOWN, HELD, UP, WALL


@ti.data_oriented
class StaticContact(OnCells):
    """Particles held by the container; rests: whether any is ever held."""

    def __init__(self, cells: Cells, accumulator: object, rests: bool):
        super().__init__(cells)
        self.accumulator, self.rests = accumulator, rests
        self.held = self.table.field(ti.i32)

    @ti.func
    def supported(self, s, cell):
        """Whether floor or a held particle is straight below."""
        return self.cells.at(s, cell - 1) >= WALL

    @ti.func
    def noticed(self, s, cell, kind):
        """Whether a rising particle has support below; a falling one has it in the cell ahead."""
        if ti.static(self.rests):
            return kind == UP and self.supported(s, cell)
        return False

    @ti.func
    def joins(self, s, cell, velocity, pull, pressed):
        """Whether a particle is to be held; velocity: of the container, pull: g dt [m/s]."""
        result = False
        if ti.static(self.rests):
            kind = self.cells.at(s, cell)
            if pressed and (kind == UP or kind == DOWN):
                relative = self.cells.vertical_speed(s, cell) - velocity
                if abs(relative) < self.parameters.threshold[s] * pull:
                    result = self.supported(s, cell)
        return result

    @ti.func
    def hold(self, s, cell):
        """Hold a particle from now on."""
        self.cells.put(s, cell, HELD, 0.0, 0.0)
        self.held[s] = self.held[s] + 1

    @ti.func
    def caught(self, s, cell, velocity):
        """Whether the floor, or the heap on it, rises into a particle that rises slower."""
        result = False
        if ti.static(self.rests):
            rising = self.cells.at(s, cell) == UP and self.cells.speed[s, cell] < velocity
            result = rising and self.supported(s, cell)
        return result

    @ti.func
    def release(self, s, velocity):
        """Release the heap where it is, with the velocity of the container [m/s]."""
        if self.held[s] > 0:
            kind = UP if velocity > 0.0 else DOWN
            travelled = self.accumulator.at_wall(kind, self.cells.offset[s])
            for k in range(self.cells.traversal.begin(s), self.cells.traversal.end(s)):
                cell = self.cells.traversal.cell(s, k)
                if self.cells.at(s, cell) == HELD:
                    self.cells.put(s, cell, kind, abs(velocity), travelled)
            self.held[s] = 0
