"""Which pairs of spheres may touch: all of them, or those near each other by a cell grid.

Both name the pairs (i, j), i < j, in the same order, so that the forces on a sphere are summed by
ascending partner and both give the same bits.
"""

import taichi as ti

from ca_damper.spheres.bodies import vec2

# Pairs near each other per sphere. Discs of one size have three, at most five with the skin.
_PAIRS_PER_SPHERE = 8


@ti.data_oriented
class AllPairs:
    """Compare every sphere with every other in every step, as the paper does."""

    tracks_motion = False

    def bind(self, bodies):
        """Nothing to allocate."""
        self.bodies = bodies

    def load(self):
        """Nothing to write."""

    @ti.func
    def forget(self, s):
        """Nothing was remembered."""

    @ti.func
    def refresh(self, s):
        """Nothing to refresh."""

    @ti.func
    def crowded(self, s):
        """Never runs out of room."""
        return False

    @ti.func
    def each_pair(self, s, contact, visit: ti.template()):
        """Call visit(i, j, contact) for every pair of scene s."""
        first, last = self.bodies.first(s), self.bodies.last(s)
        for i in range(first, last):
            for j in range(i + 1, last):
                visit(i, j, contact)


@ti.data_oriented
class CellList:
    """List the pairs within a skin of touching; search anew, by cells, when the skin is used up.

    skin: how far apart spheres are listed [m]; it changes the time taken and no result.
    """

    tracks_motion = True

    def __init__(self, skin):
        self._skin = skin

    def bind(self, bodies):
        """Allocate cells and list for all scenes, as large as the container needs."""
        self.bodies = bodies
        size = bodies.options.diameter + self._skin
        self.columns = max(1, int(bodies.options.width / size))
        self.rows = max(1, int(bodies.options.height / size))
        self.list_capacity = _PAIRS_PER_SPHERE * bodies.stride
        self.skin = ti.field(ti.f64, shape=())
        # Cells of a scene hold chains of spheres: the first of a cell, then each one's next.
        self.cell_first = ti.field(ti.i32, shape=bodies.scenes * self.columns * self.rows)
        self.next = ti.field(ti.i32, shape=bodies.capacity)
        # The list of a scene fills its room from the end: pair_first[s] .. (s + 1) * list_capacity.
        self.pair = ti.Vector.field(2, ti.i32, shape=bodies.scenes * self.list_capacity)
        self.pair_first = ti.field(ti.i32, shape=bodies.scenes)
        self.travel = ti.field(ti.f64, shape=bodies.scenes)
        self.full = ti.field(ti.i32, shape=bodies.scenes)

    def load(self):
        """Write the skin to the device."""
        self.skin[None] = self._skin

    @ti.func
    def forget(self, s):
        """Empty the list of scene s; the next refresh searches anew."""
        self.travel[s] = self.skin[None]
        self.pair_first[s] = (s + 1) * self.list_capacity
        self.full[s] = 0

    @ti.func
    def moved(self, s, distance):
        """Two spheres of scene s may have come nearer to each other by a distance [m]."""
        self.travel[s] = self.travel[s] + distance

    @ti.func
    def crowded(self, s):
        """Whether more spheres lay near each other than spheres that do not interpenetrate can."""
        return self.full[s] > 0

    @ti.func
    def each_pair(self, s, contact, visit: ti.template()):
        """Call visit(i, j, contact) for every pair of scene s that may touch."""
        for k in range(self.pair_first[s], (s + 1) * self.list_capacity):
            near = self.pair[k]
            visit(near[0], near[1], contact)

    @ti.func
    def refresh(self, s):
        """Search anew if spheres may have crossed the skin; "not" lets NaN search too."""
        if not (self.travel[s] < self.skin[None]):
            self._search(s)
            self.travel[s] = 0.0

    @ti.func
    def _search(self, s):
        """Go through the spheres backwards: those already in the cells have a higher index."""
        cells = self.columns * self.rows
        for c in range(s * cells, (s + 1) * cells):
            self.cell_first[c] = -1
        self.full[s] = 0
        start = (s + 1) * self.list_capacity
        first, last = self.bodies.first(s), self.bodies.last(s)
        for back in range(last - first):
            i = last - 1 - back
            column, row = self._cell_of(s, i)
            start = self._list_near(s, i, column, row, start)
            cell = s * cells + row * self.columns + column
            self.next[i] = self.cell_first[cell]
            self.cell_first[cell] = i
        self.pair_first[s] = start

    @ti.func
    def _cell_of(self, s, i):
        """Column and row of a sphere; a runaway belongs to the cell on its side."""
        body = self.bodies.body[None]
        place = self.bodies.position[i] + vec2(0.5 * body.width, -self.bodies.floor[s])
        column = ti.cast(place[0] * (self.columns / body.width), ti.i32)
        row = ti.cast(place[1] * (self.rows / body.height), ti.i32)
        return ti.max(0, ti.min(column, self.columns - 1)), ti.max(0, ti.min(row, self.rows - 1))

    @ti.func
    def _list_near(self, s, i, column, row, start):
        """List the spheres of higher index near i before ``start``; returns the new start."""
        position = self.bodies.position[i]
        reach = 2.0 * self.bodies.body[None].radius + self.skin[None]
        row_end = start
        for r in range(ti.max(row - 1, 0), ti.min(row + 2, self.rows)):
            for c in range(ti.max(column - 1, 0), ti.min(column + 2, self.columns)):
                j = self.cell_first[(s * self.rows + r) * self.columns + c]
                while j >= 0:
                    if (self.bodies.position[j] - position).norm_sqr() < reach * reach:
                        start = self._insert(s, i, j, start, row_end)
                    j = self.next[j]
        return start

    @ti.func
    def _insert(self, s, i, j, start, row_end):
        """Put the pair (i, j) in its place between start and row_end; returns the new start."""
        new = start
        if start == s * self.list_capacity:
            self.full[s] = 1
        else:
            new = start - 1
            k = start
            while k < row_end and self.pair[ti.min(k, row_end - 1)][1] < j:
                self.pair[k - 1] = self.pair[k]
                k += 1
            self.pair[k - 1] = ti.Vector([i, j])
        return new


SEARCHES = ("cells", "all_pairs")


def make_search(name, radius):
    """The search of a name; from 10 to 160 spheres this skin is the fastest, if by little."""
    return AllPairs() if name == "all_pairs" else CellList(skin=radius / 3.0)
