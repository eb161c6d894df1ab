"""Expected contacts: pairs and spheres at walls that may touch before a lower bound of the time."""

import taichi as ti

from ca_damper.filling import Fillings
from ca_damper.scenes.scene_fields import SceneFields
from ca_damper.spheres.bodies import SphereBodies, vec2
from ca_damper.spheres.search import EXPECTED, TOUCHING, AllPairs, CellList

vec2i = ti.types.vector(2, ti.i32)

#: Steps that the lists are to serve at the present velocities.
_STEPS = 32.0
#: Narrowest margin as a share of the widest, the skin of the search.
_NARROWEST = 1e-3
#: What rounding may add up to, as a share of the radius: that of 1e8 steps and more.
_ROUNDING = 1e-6
# Pairs are not tested where more than two thirds of those listed touch.
_NEARLY_ALL = 3


@ti.data_oriented
class ExpectedContacts:
    """Lists of the pairs and of the spheres at walls that are tested in every step."""

    def __init__(self, table: SceneFields, bodies: SphereBodies):
        self.table, self.bodies, self.cells = table, bodies, CellList(table, bodies)
        self.full = self.cells.full
        self.pair = table.vector(2, ti.i32, 2, "pairs")
        self.sphere = table.field(ti.i32, "spheres")
        for name in ("pair_count", "sphere_count", "most_touch"):
            setattr(self, name, table.field(ti.i32))
        self.floor = table.field(ti.f64)
        for name in ("margin", "nearer", "least", "most"):
            setattr(self, name, table.vector(2, ti.f64))
        for name in ("unlisted", "skipped"):
            setattr(self, name, table.field(ti.i64))

    def upload(self, fillings: Fillings) -> None:
        """Write the numbers of the search to the device."""
        self.cells.upload(fillings)

    @ti.func
    def clear(self, s):
        """Nothing has been skipped yet."""
        self.skipped[s] = ti.cast(0, ti.i64)
        self.pair_count[s], self.sphere_count[s] = 0, 0

    @ti.func
    def forget(self, s):
        """Empty the lists of scene s; the next refresh renews them."""
        self.cells.forget(s)
        self.nearer[s], self.margin[s] = vec2(0.0), vec2(0.0)
        self.least[s], self.most[s] = vec2(0.0), vec2(0.0)

    @ti.func
    def note_motion(self, s, least, most):
        """Note between which bounds the spheres have moved in a step [m]."""
        self.least[s], self.most[s] = least, most

    @ti.func
    def refresh(self, s, low, high):
        """Renew the lists if they may lack a contact; low, high: where spheres touch walls [m]."""
        drift = vec2(0.0, low[1] - self.floor[s])
        least, most = self.least[s], self.most[s]
        way = vec2((most - least).norm(), ti.max(drift - least, most - drift).max())
        nearer, margin = self.nearer[s] + way, self.margin[s]
        self.cells.moved(s, way[0])
        if self.cells.refresh(s) or not (nearer[0] < margin[0]):
            margin[0], nearer[0] = self._margin(s, way[0]), 0.0
            self._list_pairs(s, margin[0])
            self._count_unlisted(s)
        if not (nearer[1] < margin[1]):
            margin[1], nearer[1] = self._margin(s, way[1]), 0.0
            self._list_spheres(s, low + self._reach(s, margin[1]), high - self._reach(s, margin[1]))
            self._count_unlisted(s)
        self.margin[s] = margin
        self.nearer[s], self.floor[s] = nearer, low[1]

    @ti.func
    def _count_unlisted(self, s):
        count = ti.cast(self.table.particles[s], ti.i64)
        tests = count * (count - 1) // 2 + count
        self.unlisted[s] = tests - self.pair_count[s] - self.sphere_count[s]

    @ti.func
    def _margin(self, s, way):
        """How far apart to list [m], for a way in a step [m]."""
        skin = self.cells.grid[s].skin
        return ti.max(_NARROWEST * skin, ti.min(_STEPS * way, skin))

    @ti.func
    def _reach(self, s, margin):
        """A margin with what rounding may add up to."""
        return margin + _ROUNDING * self.bodies.body[s].radius

    @ti.func
    def _list_pairs(self, s, margin):
        """List pairs that may touch before they come nearer by a margin [m]."""
        reach, count = 2.0 * self.bodies.body[s].radius, vec2i(0)
        self.cells.each_pair(s, vec2(reach, reach + self._reach(s, margin)), self._list_pair, count)
        self.pair_count[s] = count[0]
        self.most_touch[s] = ti.cast(_NEARLY_ALL * count[1] > (_NEARLY_ALL - 1) * count[0], ti.i32)

    @ti.func
    def _list_spheres(self, s, low, high):
        """List spheres beyond places near a wall [m]."""
        count = 0
        for i in range(self.bodies.first(s), self.bodies.last(s)):
            place = self.bodies.position[i]
            if (place < low).any() or (place > high).any():
                self.sphere[s, count] = i
                count += 1
        self.sphere_count[s] = count

    @ti.func
    def _list_pair(self, s, i, j, reach, count: ti.template()):
        """List a pair nearer than reach[1]; count those, and those nearer than reach[0]."""
        square = (self.bodies.position[j] - self.bodies.position[i]).norm_sqr()
        short = self.bodies.short_of_reach(s, i, j)
        touching, near = reach[0] - short, reach[1] - short
        if square < near * near:
            self.pair[s, EXPECTED, count[0]] = ti.Vector([i, j])
            count = count + vec2i(1, ti.cast(square < touching * touching, ti.i32))

    @ti.func
    def find(self, s, reach):
        """Find the pairs that are to be evaluated: the list that they are in, and their number."""
        which, count = EXPECTED, self.pair_count[s]
        if self.most_touch[s] == 0:
            which, count = TOUCHING, 0
            for k in range(self.pair_count[s]):
                pair = self.pair[s, EXPECTED, k]
                branch = self.bodies.position[pair[1]] - self.bodies.position[pair[0]]
                touching = reach - self.bodies.short_of_reach(s, pair[0], pair[1])
                if branch.norm_sqr() < touching * touching:
                    self.pair[s, TOUCHING, count] = pair
                    count += 1
        return which, count

    @ti.func
    def each_listed_pair(self, s, contact, visit: ti.template(), count: ti.template()):
        """Call visit(s, i, j, contact, count) for every pair that was near at the last search."""
        self.cells.each_pair(s, contact, visit, count)

    @ti.func
    def count_skipped(self, s):
        """Count the tests that a step skips."""
        self.skipped[s] = self.skipped[s] + self.unlisted[s]

    def all_skipped(self) -> int:
        """Tests that all scenes have skipped since their start."""
        return int(self.table.in_use(self.skipped).sum())


#: What is tested for contact, by the name of the search.
SEARCHES = {"cells": ExpectedContacts, "all_pairs": AllPairs}
