"""Pairs of spheres: all of them, or those near each other by a cell grid."""

from typing import Any

import taichi as ti

from ca_damper.filling import Fillings
from ca_damper.scenes.scene_fields import SceneFields
from ca_damper.spheres.bodies import SphereBodies, vec2

# Pairs near each other per sphere. Discs of one size have three, at most five with the skin.
_PAIRS_PER_SPHERE = 8

#: Lists of pairs in ``pair``: that may touch, and that do in the present step.
EXPECTED, TOUCHING = range(2)


@ti.dataclass
class SearchGrid:
    """Numbers of the search of a scene.

    skin: how far apart spheres are listed [m]; it changes the time taken and no result.
    """

    skin: ti.f64
    columns: ti.i32
    rows: ti.i32
    pairs: ti.i32


@ti.data_oriented
class AllPairs:
    """Test every pair and every sphere in every step, as the paper does."""

    def __init__(self, table: SceneFields, bodies: SphereBodies):
        self.table, self.bodies = table, bodies
        self.places = table.length("pairs")
        self.pair = table.vector(2, ti.i32, 2, "pairs")
        self.sphere, self.sphere_count = table.field(ti.i32, "spheres"), table.field(ti.i32)
        self.full = table.field(ti.i32)

    def upload(self, fillings: Fillings) -> None:
        """Nothing to write."""

    @ti.func
    def clear(self, s):
        """All spheres are tested against the walls; there is room for all pairs."""
        self.sphere_count[s], self.full[s] = self.table.particles[s], 0
        for k in range(self.table.particles[s]):
            self.sphere[s, k] = self.bodies.first(s) + k

    @ti.func
    def forget(self, s):
        """Nothing was remembered."""

    @ti.func
    def note_motion(self, s, least, most):
        """Nothing to note."""

    @ti.func
    def refresh(self, s, low, high):
        """Nothing to refresh."""

    @ti.func
    def find(self, s, reach):
        """Find the pairs that touch: the list that they are in, and their number."""
        count = 0
        self.each_listed_pair(s, reach, self._find, count)
        return TOUCHING, count

    @ti.func
    def _find(self, s, i, j, reach, count: ti.template()):
        branch = self.bodies.position[j] - self.bodies.position[i]
        touching = reach - self.bodies.short_of_reach(s, i, j)
        if branch.norm_sqr() < touching * touching and count < self.places:
            self.pair[s, TOUCHING, count] = ti.Vector([i, j])
            count = count + 1

    @ti.func
    def each_listed_pair(self, s, contact, visit: ti.template(), count: ti.template()):
        """Call visit(s, i, j, contact, count) for every pair of scene s."""
        first, last = self.bodies.first(s), self.bodies.last(s)
        for i in range(first, last):
            for j in range(i + 1, last):
                visit(s, i, j, contact, count)

    @ti.func
    def count_skipped(self, s):
        """Nothing was skipped."""

    def all_skipped(self) -> int:
        """Nothing was skipped."""
        return 0


@ti.data_oriented
class CellList:
    """List of pairs within a skin of touching, found by cells; renewed when the skin is used up."""

    constant_fields = ("grid",)

    def __init__(self, table: SceneFields, bodies: SphereBodies):
        self.bodies = bodies
        # A cell is larger than a sphere: there are no more of them.
        self.cell_stride, self.list_stride = table.length("spheres"), table.length("pairs")
        self.grid = table.structs(SearchGrid)
        self.cell_first = table.field(ti.i32, "spheres", flat=True)
        self.next = table.field(ti.i32, "spheres", flat=True)
        self.pair = table.vector(2, ti.i32, "pairs", flat=True)
        self.pair_first = table.field(ti.i32)
        self.travel = table.field(ti.f64)
        self.full = table.field(ti.i32)

    def upload(self, fillings: Fillings) -> None:
        """Write the skin and the grid of each scene to the device."""
        fillings.write(self.grid, grid_of)

    @ti.func
    def _list_end(self, s):
        return s * self.list_stride + self.grid[s].pairs

    @ti.func
    def forget(self, s):
        """Empty the list of scene s; the next refresh renews it."""
        self.travel[s] = self.grid[s].skin
        self.pair_first[s] = self._list_end(s)
        self.full[s] = 0

    @ti.func
    def moved(self, s, distance):
        """Note that two spheres of scene s may have come nearer to each other by a distance [m]."""
        self.travel[s] = self.travel[s] + distance

    @ti.func
    def each_pair(self, s, contact, visit: ti.template(), count: ti.template()):
        """Call visit(s, i, j, contact, count) for every pair of scene s that may touch."""
        for k in range(self.pair_first[s], self._list_end(s)):
            near = self.pair[k]
            visit(s, near[0], near[1], contact, count)

    @ti.func
    def refresh(self, s):
        """Renew the list if spheres may have crossed the skin; returns whether it did."""
        # "not" so that NaN searches too.
        used_up = not (self.travel[s] < self.grid[s].skin)
        if used_up:
            self._search(s)
            self.travel[s] = 0.0
        return used_up

    @ti.func
    def _search(self, s):
        """Go through the spheres backwards: those already in the cells have a higher index."""
        grid, cells = self.grid[s], s * self.cell_stride
        for c in range(cells, cells + grid.columns * grid.rows):
            self.cell_first[c] = -1
        self.full[s] = 0
        start = self._list_end(s)
        first, last = self.bodies.first(s), self.bodies.last(s)
        for back in range(last - first):
            i = last - 1 - back
            column, row = self._cell_of(s, i)
            start = self._list_near(s, i, column, row, start)
            cell = cells + row * grid.columns + column
            self.next[i] = self.cell_first[cell]
            self.cell_first[cell] = i
        self.pair_first[s] = start

    @ti.func
    def _cell_of(self, s, i):
        """Column and row of a sphere; a runaway belongs to the cell on its side."""
        body, grid = self.bodies.body[s], self.grid[s]
        place = self.bodies.position[i] + vec2(0.5 * body.width, -self.bodies.floor[s])
        column = ti.cast(place[0] * (grid.columns / body.width), ti.i32)
        row = ti.cast(place[1] * (grid.rows / body.height), ti.i32)
        return ti.max(0, ti.min(column, grid.columns - 1)), ti.max(0, ti.min(row, grid.rows - 1))

    @ti.func
    def _list_near(self, s, i, column, row, start):
        """List the spheres of higher index near i before ``start``; returns the new start."""
        position, grid = self.bodies.position[i], self.grid[s]
        reach = 2.0 * self.bodies.body[s].radius + grid.skin
        row_end = start
        for r in range(ti.max(row - 1, 0), ti.min(row + 2, grid.rows)):
            for c in range(ti.max(column - 1, 0), ti.min(column + 2, grid.columns)):
                j = self.cell_first[s * self.cell_stride + r * grid.columns + c]
                while j >= 0:
                    near = reach - self.bodies.short_of_reach(s, i, j)
                    if (self.bodies.position[j] - position).norm_sqr() < near * near:
                        start = self._insert(s, i, j, start, row_end)
                    j = self.next[j]
        return start

    @ti.func
    def _insert(self, s, i, j, start, row_end):
        """Put the pair (i, j) in its place between start and row_end; returns the new start."""
        new = start
        if start == s * self.list_stride:
            self.full[s] = 1
        else:
            new = start - 1
            k = start
            while k < row_end and self.pair[ti.min(k, row_end - 1)][1] < j:
                self.pair[k - 1] = self.pair[k]
                k += 1
            self.pair[k - 1] = ti.Vector([i, j])
        return new


def skin_of(options: Any) -> float:
    """Skin [m]; from 10 to 160 spheres this one is the fastest, if by little."""
    return min(options.radii) / 3.0


def grid_of(options: Any) -> dict[str, Any]:
    """Members of a Grid."""
    size = options.diameter + skin_of(options)
    columns, rows = (max(1, int(length / size)) for length in (options.width, options.height))
    pairs = listed_pairs(options.capacity)
    return {"skin": skin_of(options), "columns": columns, "rows": rows, "pairs": pairs}


def listed_pairs(capacity: int) -> int:
    """Places for pairs in the list of a scene that has places for so many spheres."""
    return _PAIRS_PER_SPHERE * capacity
