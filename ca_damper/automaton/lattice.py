"""The triangular lattice of the container (Komatsuzaki et al., 5.1, Fig. 4)."""

from typing import Any

import numpy as np
import taichi as ti

from ca_damper.filling import Fillings
from ca_damper.scenes.scene_fields import SceneFields
from taichi_dem.kit.allocation import assign

#: Content of a cell: a particle that moves in one of six directions, clockwise from up ...
UP, UP_RIGHT, DOWN_RIGHT, DOWN, DOWN_LEFT, UP_LEFT = range(6)
#: ... or nothing, a wall, or a particle that moves as one with the container.
EMPTY, WALL, HELD = 6, 7, 8
KINDS = 9
DIRECTIONS = 6

_ANGLE = np.deg2rad(60.0) * np.arange(DIRECTIONS)


def alignments() -> np.ndarray:
    """Cosine of the angle between two directions, shape (6, 6), exact."""
    return np.round(2.0 * np.cos(_ANGLE[:, None] - _ANGLE[None, :])) / 2.0


def unit_vectors() -> np.ndarray:
    """Horizontal and vertical part of the six directions, shape (6, 2)."""
    return np.column_stack([np.sin(_ANGLE), alignments()[:, UP]])


class LatticeGeometry:
    """Which cell lies where, in NumPy; columns and rows are counted inside the walls."""

    def __init__(self, columns: int, rows: int):
        self.columns, self.rows = columns, rows
        self.height = rows + 2
        self.cells = (columns + 2) * self.height

    def cell_of(self, column: Any, row: Any) -> Any:
        """Number of the cell in a column and row, both 0 at the lower left inner corner."""
        return (column + 1) * self.height + row + 1

    def column_and_row(self, cell: Any) -> tuple[Any, Any]:
        """Column and row of a cell, -1 in the lower and left walls; arrays welcome."""
        return cell // self.height - 1, cell % self.height - 1

    def inside(self, column: Any, row: Any) -> Any:
        """Whether a particle may stand there; arrays welcome."""
        return (0 <= column) & (column < self.columns) & (0 <= row) & (row < self.rows)

    @property
    def sizes(self) -> dict[str, int]:
        """Members of a LatticeSize."""
        first, end = self.cell_of(0, 0), self.cell_of(self.columns - 1, self.rows)
        return {**vars(self), "first": first, "end": end}

    def levels(self) -> np.ndarray:
        """Height of the centre of each cell above the floor of lower columns [half cells]."""
        column, row = np.divmod(np.arange(self.cells + 1), self.height)
        return 2 * row - 1 + column % 2

    def bottoms(self) -> np.ndarray:
        """Lowest cell of the column of each cell, a wall."""
        cell = np.arange(self.cells + 1)
        return cell - cell % self.height

    def neighbours(self) -> np.ndarray:
        """Cell ahead of a particle, by its cell and kind, shape (cells + 1, KINDS)."""
        # Cell number ``cells`` is always empty: what does not fly looks there, so that one rule
        # serves all.
        column, row = self.column_and_row(np.arange(self.cells))
        high = (column + 1) % 2
        steps = (
            *((column, row + 1), (column + 1, row + high), (column + 1, row + high - 1)),
            *((column, row - 1), (column - 1, row + high - 1), (column - 1, row + high)),
        )
        table = np.full((self.cells + 1, KINDS), self.cells, dtype=np.int16)
        for direction, (c, r) in enumerate(steps):
            known = (-1 <= c) & (c <= self.columns) & (-1 <= r) & (r <= self.rows)
            table[:-1, direction] = np.where(known, self.cell_of(c, r), self.cells)
        return table

    def centres(self, width: float) -> np.ndarray:
        """Horizontal and vertical centre of every cell [m], shape (cells, 2)."""
        column, row = self.column_and_row(np.arange(self.cells))
        return width * np.column_stack([column + 0.5, row + 0.5 + 0.5 * ((column + 1) % 2)])


def geometry_of(options: object) -> LatticeGeometry:
    """Geometry of the options of an automaton."""
    return LatticeGeometry(options.columns, options.rows)


@ti.dataclass
class LatticeSize:
    """Columns and rows inside the walls, height of a column, and first and last cell to take."""

    columns: ti.i32
    rows: ti.i32
    height: ti.i32
    cells: ti.i32
    first: ti.i32
    end: ti.i32


@ti.data_oriented
class Lattice:
    """The lattice of each scene on the device; cosine: between directions."""

    constant_fields = ("size", "neighbour", "cosine", "level", "bottom")

    def __init__(self, table: SceneFields, looks_ahead: bool):
        self.table, self.size, self.looks_ahead = table, table.structs(LatticeSize), looks_ahead
        of_cells = table.capacity, table.length("cells")
        self.level, self.bottom = (ti.field(ti.i16, shape=of_cells) for _ in range(2))
        if looks_ahead:
            self.neighbour = ti.field(ti.i16, shape=(*of_cells, KINDS))
        self.cosine = ti.field(ti.f64, shape=(KINDS, DIRECTIONS))

    def upload(self, fillings: Fillings) -> None:
        """Take over the geometry of each scene."""
        cosines = np.zeros((KINDS, DIRECTIONS))
        cosines[:DIRECTIONS] = alignments()
        assign(self.cosine, cosines)
        fillings.write(self.size, lambda filling: geometry_of(filling).sizes)
        fillings.write(self.level, lambda filling: geometry_of(filling).levels())
        fillings.write(self.bottom, lambda filling: geometry_of(filling).bottoms())
        if self.looks_ahead:
            fillings.write(self.neighbour, lambda filling: geometry_of(filling).neighbours())

    def geometry(self, s: int) -> LatticeGeometry:
        """The geometry of a scene."""
        return LatticeGeometry(int(self.size.columns[s]), int(self.size.rows[s]))

    @ti.func
    def blank(self, s, cell):
        """What is in a cell without particles: WALL, or EMPTY inside and beyond the lattice."""
        row = cell % self.size.height[s]
        outer = self.in_side_wall(s, cell) or row == 0 or row == self.size.rows[s] + 1
        return WALL if outer and cell < self.size.cells[s] else EMPTY

    @ti.func
    def nearest_row(self, s, base, height):
        """Row nearest to a height [cells] in the column whose lowest cell, a wall, is ``base``."""
        row = ti.cast(ti.floor(height - self.height_of(s, base + 1) + 0.5), ti.i32)
        return ti.math.clamp(row, 0, self.size.rows[s] - 1)

    @ti.func
    def cell_ahead(self, s, cell, kind):
        """Cell ahead of a particle of this kind."""
        return ti.cast(self.neighbour[s, cell, kind], ti.i32)

    @ti.func
    def upward(self, kind):
        """Vertical part of a direction: 1, 1/2, -1/2 or -1; 0 for particles at rest."""
        return self.cosine[kind, UP]

    @ti.func
    def cell_of(self, s, column, row):
        """Number of the cell in a column and row, both counted inside the walls."""
        return (column + 1) * self.size.height[s] + row + 1

    @ti.func
    def cell_from(self, s, column, k, direction):
        """The k-th cell of a column, counted upwards (direction 1) or downwards (-1)."""
        return self.cell_of(s, column, k if direction > 0 else self.size.rows[s] - 1 - k)

    @ti.func
    def height_of(self, s, cell):
        """Height of a cell's centre above the floor of the lower columns, in cells."""
        return 0.5 * self.level[s, cell]

    @ti.func
    def raised(self, s, cell):
        """1 for a cell whose column stands half a cell higher, else 0."""
        return (ti.cast(self.level[s, cell], ti.i32) + 1) & 1

    @ti.func
    def column_of(self, s, cell):
        """Column of a cell, -1 for the left wall."""
        return ti.cast(self.bottom[s, cell], ti.i32) // self.size.height[s] - 1

    @ti.func
    def column_beside(self, s, cell, direction):
        """Lowest cell of the column to the right (direction 1) or left (-1) of a cell, a wall."""
        return ti.cast(self.bottom[s, cell], ti.i32) + direction * self.size.height[s]

    @ti.func
    def in_side_wall(self, s, cell):
        """Whether a wall cell belongs to a side wall; the corners do."""
        height = self.size.height[s]
        return cell < height or cell >= self.size.cells[s] - height


@ti.func
def turned_back(direction):
    """Straight back."""
    return (direction + 3) % DIRECTIONS


@ti.func
def mirrored(direction):
    """Left and right exchanged."""
    return (DIRECTIONS - direction) % DIRECTIONS
