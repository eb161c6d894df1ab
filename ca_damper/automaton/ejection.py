"""Lattice steps of the container, and particles pushed by its walls (Komatsuzaki et al., Fig. 7).

The lattice moves with the container, whose displacement is rounded to whole cells. When that
staircase steps, moving particles stay in place in the room: one cell the other way. Those that
touch the wall behind them, and the cluster that touches these, are pushed along: they keep their
cell, and those slower than the wall take its velocity. A column always has room for this: a
particle that stays has no pushed one in its way, or it would touch it and be pushed.
"""

from typing import Any

import taichi as ti

from ca_damper.automaton.event_counts import PUSHES
from ca_damper.automaton.lattice import DIRECTIONS, DOWN, HELD, UP
from ca_damper.automaton.staircase import Staircase
from ca_damper.scenes.scene_fields import SceneFields


@ti.data_oriented
class Ejection(Staircase):
    """Follow the container's staircase.

    pushed: 1 for a cell in the cluster. border: cells of the cluster still to look around. Both of
    shape (scenes, cells).
    """

    def __init__(self, table: SceneFields, components: Any):
        super().__init__(components)
        self.accumulator, self.accounting = components.accumulator, components.accounting
        self.event_counts = components.event_counts
        self.pushed = table.field(ti.i8, "cells")
        self.border = table.field(ti.i16, "cells")

    @ti.func
    def advance(self, s, way, velocity):
        """One cell up (way 1) or down (-1); returns counted gain of velocity along x [quanta]."""
        self.mark(s, way)
        impulse = ti.cast(0, ti.i64)
        for k in range(self.cells.traversal.begin(), self.cells.traversal.end(s)):
            cell = self.cells.traversal.cell(s, k)
            if self.pushed[s, cell] == 1 and self.cells.at(s, cell) != HELD:
                impulse += self.push(s, cell, way, velocity)
        self.shift(s, way)
        self.cells.traversal.sort(s, self.cells)
        return impulse

    @ti.func
    def mark(self, s, way):
        """Mark the particles that touch the wall behind and all that hang together with them."""
        size = 0
        for cell in range(self.lattice.cell_count() + 1):
            self.pushed[s, cell] = ti.cast(0, ti.i8)
        for column in range(self.lattice.column_count()):
            row = 0 if way > 0 else self.lattice.row_count() - 1
            size = self.reach(s, self.lattice.cell_of(column, row), way, size)
        while size > 0:
            size -= 1
            cell = ti.cast(self.border[s, size], ti.i32)
            for direction in range(DIRECTIONS):
                size = self.reach(s, self.lattice.cell_ahead(cell, direction), way, size)

    @ti.func
    def reach(self, s, cell, way, size):
        """Mark a particle, unless it is, and put it on the border; returns the border's new size.

        The floor pushes through the heap that it holds; the ceiling pushes against no heap.
        """
        result = size
        kind = self.cells.at(s, cell)
        found = kind < DIRECTIONS or (kind == HELD and way > 0)
        if found and self.pushed[s, cell] == 0:
            self.pushed[s, cell] = ti.cast(1, ti.i8)
            self.border[s, size] = ti.cast(cell, ti.i16)
            result = size + 1
        return result

    @ti.func
    def push(self, s, cell, way, velocity):
        """Push one particle along; returns its counted gain of velocity along x [quanta]."""
        kind = self.cells.at(s, cell)
        gain = velocity - self.cells.vertical_speed(s, cell)
        if gain * way > 0.0:
            self.event_counts.note(s, PUSHES)
            kind = UP if velocity > 0.0 else DOWN
            travelled = self.accumulator.at_wall(kind, self.cells.offset[s])
            self.cells.put(s, cell, kind, abs(velocity), travelled)
        else:
            gain = 0.0
            self.cells.travelled[s, cell] = self.accumulator.distance_to_wall(
                self.cells.travelled[s, cell], kind, way, self.parameters.width[None]
            )
        return self.accounting.push(s, gain)

    @ti.func
    def shift(self, s, way):
        """Keep all others in place in the room: one cell the other way, those in front first."""
        for column in range(self.lattice.column_count()):
            for k in range(self.lattice.row_count()):
                row = k if way > 0 else self.lattice.row_count() - 1 - k
                cell = self.lattice.cell_of(column, row)
                if self.cells.at(s, cell) < DIRECTIONS and self.pushed[s, cell] == 0:
                    self.cells.relocate(s, cell, cell - way, self.cells.travelled[s, cell])
