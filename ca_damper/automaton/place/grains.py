"""Grains by the rules of place: under way with a velocity across the columns, or at rest."""

import taichi as ti

from ca_damper.automaton.cells import Cells
from ca_damper.automaton.lattice import HELD, UP, Lattice
from ca_damper.automaton.static_contact import StaticContact


@ti.data_oriented
class GrainCells(Cells):
    """Cells of grains that fly any way: kind UP, speed and travelled signed, across to the right.

    container: its velocity [m/s]; this and its offset are those at the end of the step without
    blows. closing: acceleration of the container towards grains that fly [m/s^2].
    """

    def __init__(self, lattice: Lattice, parameters: object, listed: bool):
        super().__init__(lattice, parameters, listed, self)
        table = self.table
        self.across = table.field(ti.f64, "cells")
        self.container, self.closing = table.field(ti.f64), table.field(ti.f64)

    @ti.func
    def clear(self, s):
        """Walls and nothing else."""
        for cell in range(self.lattice.size.cells[s] + 1):
            self.put(s, cell, self.lattice.blank(s, cell), 0.0, 0.0)
            self.across[s, cell] = 0.0
        self.container[s], self.closing[s] = 0.0, 0.0

    @ti.func
    def moved(self, s, origin, target):
        """Follow a grain to another cell."""
        self.across[s, target] = self.across[s, origin]
        self.across[s, origin] = 0.0

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
        return self.lattice.height_of(s, cell) * self.parameters.width[s] + self.way(s, cell)

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
        return ti.Vector([self.across[s, cell], up])

    @ti.func
    def accelerate(self, s, cell, change):
        """Change the velocity of a grain under way [m/s], (across, up)."""
        self.across[s, cell] = self.across[s, cell] + change[0]
        self.speed[s, cell] = self.speed[s, cell] + change[1]


@ti.data_oriented
class Heap(StaticContact):
    """Grains at rest on the floor, or on a grain that rests: those that the container carries."""

    @ti.func
    def takes(self, s, approach, pull, pressed):
        """Whether a grain that meets floor or heap at a speed [m/s] stays; pull: g dt [m/s]."""
        result = False
        if ti.static(self.rests):
            result = pressed and approach < self.parameters.threshold[s] * pull
        return result

    @ti.func
    def join(self, s, cell):
        """Hold a grain from now on."""
        self.cells.across[s, cell] = 0.0
        self.hold(s, cell)

    @ti.func
    def free(self, s, cell, velocity):
        """Let a grain go with a velocity along x [m/s], if it is held."""
        if self.cells.at(s, cell) == HELD:
            self.cells.put(s, cell, UP, velocity, self.cells.offset[s])
            self.held[s] = self.held[s] - 1

    @ti.func
    def release(self, s, velocity):
        """Release the heap where it is, with the velocity of the container [m/s]."""
        if self.held[s] > 0:
            for k in range(self.cells.traversal.begin(s), self.cells.traversal.end(s)):
                self.free(s, self.cells.traversal.cell(s, k), velocity)
