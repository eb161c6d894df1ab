"""Traversal of the particles: a scan of all cells, or a list of those that hold one.

The order changes no result: rules read only data that no other cell writes, conflicts are resolved
by random numbers, and impulses are summed as integers.
"""

from typing import Any

import taichi as ti

from ca_damper.automaton.lattice import EMPTY, WALL
from ca_damper.scenes.scene_fields import SceneFields


@ti.data_oriented
class Scan:
    """Every cell from the first to the last, walls between the columns included."""

    def __init__(self, lattice: Any, table: SceneFields):
        self.lattice = lattice

    @ti.func
    def begin(self):
        """First of the numbers k of the cells to visit in a step."""
        return self.lattice.first()

    @ti.func
    def end(self, s):
        """One past the last of them."""
        return self.lattice.end()

    @ti.func
    def cell(self, s, k):
        """Cell number k to visit."""
        return k

    @ti.func
    def placed(self, s, k, cell):
        """A scan finds particle number k by itself."""

    @ti.func
    def moved(self, s, origin, target):
        """A scan finds it by itself."""

    @ti.func
    def sort(self, s, cells: ti.template()):
        """A scan is always in order."""


@ti.data_oriented
class ParticleList:
    """Only the cells that hold a particle.

    cells: of particle number k. number: of the particle in a cell, meaningless in the other cells.
    Both of shape (scenes, cells).
    """

    def __init__(self, lattice: Any, table: SceneFields):
        self.lattice, self.table = lattice, table
        self.cells = table.field(ti.i16, "cells")
        self.number = table.field(ti.i16, "cells")

    @ti.func
    def begin(self):
        """First of the numbers k of the cells to visit in a step."""
        return 0

    @ti.func
    def end(self, s):
        """One past the last of them."""
        return self.table.particles[s]

    @ti.func
    def cell(self, s, k):
        """Cell number k to visit."""
        return ti.cast(self.cells[s, k], ti.i32)

    @ti.func
    def placed(self, s, k, cell):
        """Enter particle number k."""
        self.cells[s, k] = ti.cast(cell, ti.i16)
        self.number[s, cell] = ti.cast(k, ti.i16)

    @ti.func
    def moved(self, s, origin, target):
        """Follow a particle to another cell."""
        self.placed(s, ti.cast(self.number[s, origin], ti.i32), target)

    @ti.func
    def sort(self, s, cells: ti.template()):
        """Number the particles by their cells again: neighbours then mostly do alike, and fast."""
        count = 0
        for cell in range(self.lattice.first(), self.lattice.end()):
            kind = cells.at(s, cell)
            if kind != EMPTY and kind != WALL:
                self.placed(s, count, cell)
                count += 1


def traversal_of(options: Any, lattice: Any, table: SceneFields) -> Any:
    """The traversal that the options name."""
    return (Scan if options.traversal == "scan" else ParticleList)(lattice, table)
