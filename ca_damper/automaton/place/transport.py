"""Free flight of the grains, and the lattice that steps along with the container."""

from typing import Any

import taichi as ti

from ca_damper.automaton.lattice import EMPTY, UP
from ca_damper.automaton.staircase import Staircase


@ti.data_oriented
class PlaceTransport(Staircase):
    """Grains keep their places in the room when the lattice steps, and fly under full gravity."""

    def __init__(self, components: Any):
        super().__init__(components)
        self.traversal = components.cells.traversal

    @ti.func
    def advance(self, s, way, velocity):
        """Number the cells anew, one cell up (way 1) or down (-1); nothing moves in the room.

        Each grain takes the cell behind it, those nearest to the wall first. Where that is taken,
        by the wall or by the unbroken run of grains on it, a grain keeps its cell and stands
        further off its centre. No grain gets any velocity.
        """
        width = self.parameters.width[None]
        for column in range(self.lattice.column_count()):
            for k in range(self.lattice.row_count()):
                row = k if way > 0 else self.lattice.row_count() - 1 - k
                cell = self.lattice.cell_of(column, row)
                if self.cells.at(s, cell) == UP:
                    if self.cells.at(s, cell - way) == EMPTY:
                        self.cells.relocate(s, cell, cell - way, self.cells.travelled[s, cell])
                    else:
                        self.cells.travelled[s, cell] = self.cells.travelled[s, cell] - width * way
        self.traversal.sort(s, self.cells)
        return ti.cast(0, ti.i64)

    @ti.func
    def fly_all(self, s, dt, pull, motion):
        """One step of all grains under way and of the container, exact for constant gravity."""
        for k in range(self.traversal.begin(), self.traversal.end(s)):
            cell = self.traversal.cell(s, k)
            if self.cells.at(s, cell) == UP:
                speed = self.cells.speed[s, cell] - pull
                self.cells.speed[s, cell] = speed
                self.cells.travelled[s, cell] = (
                    self.cells.travelled[s, cell] + (speed + 0.5 * pull) * dt
                )
        self.cells.offset[s] = self.cells.offset[s] + (motion.v + 0.5 * motion.a * dt) * dt
