"""Contents of the cells of every scene, which of them are visited, and how a scene begins."""

import taichi as ti

from ca_damper.automaton.conflict_resolution import ConflictResolution
from ca_damper.automaton.lattice import EMPTY, WALL, Lattice, geometry_of
from ca_damper.engine.random_numbers import START, uniform
from ca_damper.filling import Fillings


@ti.data_oriented
class Traversal:
    """Cells visited in a step: those on a list of particles, or all from the first to the last."""

    def __init__(self, lattice: Lattice, listed: bool):
        table = lattice.table
        self.table, self.lattice, self.listed = table, lattice, listed
        if listed:
            self.cells, self.number = table.field(ti.i16, "cells"), table.field(ti.i16, "cells")

    @ti.func
    def begin(self, s):
        """First of the numbers k of the cells to visit in a step."""
        return 0 if ti.static(self.listed) else self.lattice.size.first[s]

    @ti.func
    def end(self, s):
        """One past the last of them."""
        return self.table.particles[s] if ti.static(self.listed) else self.lattice.size.end[s]

    @ti.func
    def cell(self, s, k):
        """Cell number k to visit."""
        if ti.static(self.listed):
            return ti.cast(self.cells[s, k], ti.i32)
        return k

    @ti.func
    def placed(self, s, k, cell):
        """Enter particle number k."""
        if ti.static(self.listed):
            self.cells[s, k] = ti.cast(cell, ti.i16)
            self.number[s, cell] = ti.cast(k, ti.i16)

    @ti.func
    def moved(self, s, origin, target):
        """Follow a particle to another cell."""
        if ti.static(self.listed):
            self.placed(s, ti.cast(self.number[s, origin], ti.i32), target)

    @ti.func
    def sort(self, s, cells: ti.template()):
        """Number the particles by their cells again: neighbours then mostly do alike, and fast."""
        if ti.static(self.listed):
            count = 0
            for cell in range(self.lattice.size.first[s], self.lattice.size.end[s]):
                kind = cells.at(s, cell)
                if kind != EMPTY and kind != WALL:
                    self.placed(s, count, cell)
                    count += 1


@ti.data_oriented
class Cells:
    """State of all cells; fields of shape (scenes, cells + 1), a scene's cells together in memory.

    kind: direction of a particle, or EMPTY, WALL, HELD. speed along it in the room, >= 0 [m/s].
    travelled: part of the way to the next cell [m], negative while short of the own cell's centre.
    stair: displacement of the container in whole cells; offset: what is left of it [m].
    """

    def __init__(self, lattice: Lattice, parameters: object, listed: bool, follower: object):
        table = lattice.table
        self.table, self.lattice, self.parameters = table, lattice, parameters
        self.traversal, self.follower = Traversal(lattice, listed), follower
        self.conflicts = ConflictResolution(lattice)
        self.kind = table.field(ti.i8, "cells")
        self.speed, self.travelled = table.field(ti.f64, "cells"), table.field(ti.f64, "cells")
        self.stair, self.offset = table.field(ti.i32), table.field(ti.f64)

    @ti.func
    def clear(self, s):
        """Walls and nothing else."""
        for cell in range(self.lattice.size.cells[s] + 1):
            self.put(s, cell, self.lattice.blank(s, cell), 0.0, 0.0)
        self.follower.clear(s)

    @ti.func
    def at(self, s, cell):
        """Kind of the content of a cell, as i32."""
        return ti.cast(self.kind[s, cell], ti.i32)

    @ti.func
    def put(self, s, cell, kind, speed, travelled):
        """Set the content of a cell."""
        self.kind[s, cell] = ti.cast(kind, ti.i8)
        self.speed[s, cell] = speed
        self.travelled[s, cell] = travelled

    @ti.func
    def relocate(self, s, origin, target, travelled):
        """Move the content of a cell to another, empty one."""
        self.put(s, target, self.at(s, origin), self.speed[s, origin], travelled)
        self.put(s, origin, EMPTY, 0.0, 0.0)
        self.traversal.moved(s, origin, target)
        self.follower.moved(s, origin, target)

    @ti.func
    def vertical_speed(self, s, cell):
        """Velocity along x of a particle under way [m/s]; 0 in every other cell."""
        return self.speed[s, cell] * self.lattice.upward(self.at(s, cell))

    @ti.func
    def step_along(self, s, step, motion, width):
        """Take the lattice along by whole cells [m]; returns 1 for a step up, -1 down, else 0."""
        stair, direction = ti.cast(ti.floor(motion.x / width + 0.5), ti.i32), 0
        if step == 0:
            self.stair[s] = stair
        elif stair > self.stair[s]:
            direction = 1
        elif stair < self.stair[s]:
            direction = -1
        self.stair[s] = self.stair[s] + direction
        self.offset[s] = motion.x - width * self.stair[s]
        return direction


class OnCells:
    """Base of what acts on cells: these, and the numbers and the lattice of their scenes."""

    def __init__(self, cells: Cells):
        self.cells, self.table = cells, cells.table
        self.lattice, self.parameters = cells.lattice, cells.parameters
        self.conflicts = cells.conflicts


def _named_cells(options):
    geometry = geometry_of(options)
    return [geometry.cell_of(*cell) for cell in options.start]


@ti.data_oriented
class Placement(OnCells):
    """First cells of the particles: named by the user, or drawn from the scene's seed."""

    def __init__(self, cells: Cells, direction: int, is_named: bool):
        super().__init__(cells)
        self.way, self.is_named = direction, is_named
        if is_named:
            self.named = self.table.field(ti.i32, "cells")

    def upload(self, fillings: Fillings) -> None:
        """Take over the user's cells."""
        if self.is_named:
            fillings.write(self.named, _named_cells)

    @ti.func
    def fill(self, s):
        """Put the particles of scene s into their cells, at rest."""
        if ti.static(self.is_named):
            for k in range(self.table.particles[s]):
                self._put(s, k, self.named[s, k])
        else:
            self._draw(s)

    @ti.func
    def _draw(self, s):
        placed, count = 0, self.table.particles[s]
        size = self.lattice.size[s]
        left = size.columns * size.rows
        for column in range(size.columns):
            for row in range(size.rows):
                cell = self.lattice.cell_of(s, column, row)
                if left * uniform(self.table.seed[s], 0, cell, START) < count - placed:
                    self._put(s, placed, cell)
                    placed += 1
                left -= 1

    @ti.func
    def _put(self, s, k, cell):
        self.cells.put(s, cell, self.way, 0.0, 0.0)
        self.cells.traversal.placed(s, k, cell)
