"""Grains under way by the rules of place: cells, with a velocity across the columns."""

from typing import Any

import taichi as ti

from ca_damper.automaton.lattice import HELD, UP
from ca_damper.automaton.state import Cells
from ca_damper.scenes.scene_fields import SceneFields


@ti.data_oriented
class Across:
    """Velocity across the columns, to the right [m/s], shape (scenes, cells + 1).

    Zero in cells without a grain under way.
    """

    def __init__(self, table: SceneFields):
        self.velocity = table.field(ti.f64, "cells")

    @ti.func
    def moved(self, s, origin, target):
        """Follow a grain to another cell."""
        self.velocity[s, target] = self.velocity[s, origin]
        self.velocity[s, origin] = 0.0


@ti.data_oriented
class Grains(Cells):
    """Cells of grains that fly any way.

    A grain under way has the kind UP, whatever its way; speed and travelled are signed and count
    upwards. across: velocity to the right. container: its velocity [m/s], (scenes,); this
    and its offset are those at the end of the step without blows, once all grains have flown.
    closing: acceleration of the container towards grains that fly [m/s^2].
    """

    def __init__(self, table: SceneFields, lattice: Any, traversal: Any, parameters: Any):
        self.across = Across(table)
        super().__init__(table, lattice, traversal, self.across)
        self.parameters = parameters
        self.container, self.closing = table.field(ti.f64), table.field(ti.f64)

    @ti.func
    def is_grain(self, s, cell):
        """Whether a grain is in the cell."""
        kind = self.at(s, cell)
        return kind == UP or kind == HELD

    @ti.func
    def way(self, s, cell):
        """Way of a grain upwards from the centre of its cell [m]."""
        travelled = self.travelled[s, cell]
        if self.at(s, cell) == HELD:
            travelled = self.offset[s]
        return travelled

    @ti.func
    def height(self, s, cell):
        """Height of a grain [m] over the lower cells of the lattice."""
        return self.lattice.height_of(cell) * self.parameters.width[None] + self.way(s, cell)

    @ti.func
    def overlap(self, s, lower):
        """How much less than a diameter a grain is below that in the next cell up [m]."""
        return self.way(s, lower) - self.way(s, lower + 1)

    @ti.func
    def velocity(self, s, cell):
        """Velocity of a grain [m/s], (across, up)."""
        up = self.speed[s, cell]
        if self.at(s, cell) == HELD:
            up = self.container[s]
        return ti.Vector([self.across.velocity[s, cell], up])

    @ti.func
    def accelerate(self, s, cell, change):
        """Change the velocity of a grain under way [m/s], (across, up)."""
        self.across.velocity[s, cell] = self.across.velocity[s, cell] + change[0]
        self.speed[s, cell] = self.speed[s, cell] + change[1]

    @ti.func
    def clear_all(self, s):
        """Walls and nothing else."""
        self.clear(s)
        self.container[s], self.closing[s] = 0.0, 0.0
        for cell in range(self.lattice.cell_count() + 1):
            self.across.velocity[s, cell] = 0.0
