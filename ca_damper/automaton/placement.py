"""Where the particles of a scene stand at its start; ``way``: direction in which they head."""

from typing import Any

import taichi as ti

from ca_damper.engine.random_numbers import START, uniform
from ca_damper.scenes.scene_fields import SceneFields
from taichi_dem.kit.allocation import assign


@ti.data_oriented
class DrawnCells:
    """Cells drawn from the scene's seed, every choice of them equally likely.

    A full row would fall as one lump. Each cell is taken with the probability needed / left
    (selection sampling, Knuth, The Art of Computer Programming 2, 3.4.2).
    """

    def __init__(self, table: SceneFields, cells: Any, way: int):
        self.cells, self.lattice, self.table = cells, cells.lattice, table
        self.way = way

    def load(self, named: Any) -> None:
        """Nothing to load."""

    @ti.func
    def fill(self, s):
        """Put the particles of scene s into its cells, at rest."""
        placed, count = 0, self.table.particles[s]
        left = self.lattice.column_count() * self.lattice.row_count()
        for column in range(self.lattice.column_count()):
            for row in range(self.lattice.row_count()):
                cell = self.lattice.cell_of(column, row)
                if left * uniform(self.table.seed[s], 0, cell, START) < count - placed:
                    self.cells.put(s, cell, self.way, 0.0, 0.0)
                    self.cells.traversal.placed(s, placed, cell)
                    placed += 1
                left -= 1


@ti.data_oriented
class NamedCells:
    """Cells named by the user, the same in every scene."""

    constant_fields = ("named", "count")

    def __init__(self, table: SceneFields, cells: Any, way: int):
        self.cells, self.way = cells, way
        self.count = ti.field(ti.i32, shape=())
        self.named = ti.field(ti.i32, shape=table.length("cells"))

    def load(self, named: Any) -> None:
        """Take over the user's cells: (column, row) of each."""
        geometry = self.cells.lattice.geometry
        assign(self.count, len(named))
        assign(self.named, [geometry.cell_of(*cell) for cell in named])

    @ti.func
    def fill(self, s):
        """Put the particles of scene s into the cells, at rest."""
        for k in range(self.count[None]):
            self.cells.put(s, self.named[k], self.way, 0.0, 0.0)
            self.cells.traversal.placed(s, k, self.named[k])
