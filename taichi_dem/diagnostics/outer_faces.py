"""Outer faces without contact spheres: detection of bodies that can, and do, overlap there.

Faces carry spheres once they break, outer faces only with the option of ``SphereContact``. Bodies
that meet elsewhere pass through each other.
"""

from typing import TYPE_CHECKING

import numpy as np
import taichi as ti

from taichi_dem.kit.types import vec3
from taichi_dem.mesh.tetrahedra import components
from taichi_dem.timeline import NEVER

if TYPE_CHECKING:
    from taichi_dem.engine.model import Model
    from taichi_dem.engine.state import State
    from taichi_dem.engine.tables import Tables

#: Overlap of two spheres, as a share of the distance at which they touch, below which they count
#: as apart: coordinates of a mesh file may be rounded to seven digits.
LEAST_OVERLAP = 1e-4


class OuterFaces:
    """Finds pairs of bodies that overlap where one of them has an outer face without spheres.

    A pair counts if its bodies belong to different fragments and share no point of the mesh, if
    spheres on outer faces would overlap, and if no spheres of broken faces do. This excludes bonded
    bodies, regular contacts, and former neighbours, which meet at broken faces. A solid that bends
    until it meets itself is not detected.
    outer_overlaps: the ``OuterOverlaps`` of the engine.
    """

    def __init__(self, model: "Model", state: "State", outer_overlaps: "OuterOverlaps"):
        self.model, self.state, self.outer_overlaps = model, state, outer_overlaps
        self.extent = model.spheres.extent
        self.points = np.ascontiguousarray(model.mesh.tetrahedra, dtype=np.int32)
        self.broken_count, self.part = -1, np.zeros(0, dtype=np.int32)

    def overlaps(self) -> np.ndarray:
        """How many later bodies each body overlaps in this way now, (body_count,)."""
        found = np.zeros(self.model.body_count, dtype=np.int32)
        broken = self.state.broken_tick.to_numpy()[: self.model.bond_count] != NEVER
        self._find_parts(broken)
        loose = self.part != np.bincount(self.part).argmax()
        if loose.any():
            # Bond -1 stands for an outer face, which is as free as a broken one.
            surface = np.append(broken, True)[self.model.topology.body_bond].any(axis=1)
            marks = loose.astype(np.int32)
            candidates = self._candidates(surface, loose)
            self.outer_overlaps.count(*candidates, self.part, marks, self.points, found)
        return found

    def _find_parts(self, broken):
        """Name every fragment after its first body; they change only where a bond breaks."""
        if broken.sum() != self.broken_count:
            self.broken_count = broken.sum()
            top = self.model.topology
            intact = np.column_stack([top.master, top.slave])[~broken]
            self.part = components(self.model.body_count, intact).astype(np.int32)

    def _candidates(self, surface, loose):
        """Sweep and prune along the longest axis.

        Returns the loose bodies on a surface, the places in the order of all bodies on a surface
        from which and up to which others may be near them, that order, and in it the balls around
        the spheres of a body: centre and radius [m], (n, 4).
        """
        ball = np.column_stack([self.state.position.to_numpy(), self.extent])
        bodies, own = np.flatnonzero(surface), np.flatnonzero(surface & loose)
        along = ball[:, np.ptp(ball[bodies, :3], axis=0).argmax()]
        order = bodies[np.argsort(along[bodies], kind="stable")]
        reach = self.extent[own] + self.extent[bodies].max()
        first = np.searchsorted(along[order], along[own] - reach)
        last = np.searchsorted(along[order], along[own] + reach, side="right")
        whole = (array.astype(np.int32) for array in (own, first, last, order))
        return (*whole, ball[order])


@ti.data_oriented
class OuterOverlaps:
    """Compares the spheres behind outer faces of bodies that may be near each other."""

    def __init__(self, tables: "Tables", state: "State"):
        self.tables, self.state = tables, state

    @ti.kernel
    def count(
        self,
        own: ti.types.ndarray(dtype=ti.i32, ndim=1),
        first: ti.types.ndarray(dtype=ti.i32, ndim=1),
        last: ti.types.ndarray(dtype=ti.i32, ndim=1),
        order: ti.types.ndarray(dtype=ti.i32, ndim=1),
        ball: ti.types.ndarray(dtype=ti.f64, ndim=2),
        part: ti.types.ndarray(dtype=ti.i32, ndim=1),
        loose: ti.types.ndarray(dtype=ti.i32, ndim=1),
        points: ti.types.ndarray(dtype=ti.i32, ndim=2),
        found: ti.types.ndarray(dtype=ti.i32, ndim=1),
    ):
        """Add to found how many later bodies each loose body overlaps at bare outer faces."""
        for a in range(own.shape[0]):
            i = own[a]
            centre, radius = self.state.position[i], self.tables.extent[i]
            for k in range(first[a], last[a]):
                away = vec3(ball[k, 0], ball[k, 1], ball[k, 2]) - centre
                reach = radius + ball[k, 3]
                j = order[k]
                # A pair of loose bodies would be found twice.
                if away.norm_sqr() < reach * reach and (loose[j] == 0 or i < j):
                    apart = ti.cast(part[i] != part[j], ti.i32)
                    for p, q in ti.ndrange(4, 4):
                        apart *= ti.cast(points[i, p] != points[j, q], ti.i32)
                    if apart == 1:
                        found[i] = found[i] + self._overlap(i, j)

    @ti.func
    def _overlap(self, i, j):
        """1 where spheres on outer faces would overlap and no others do, else 0."""
        back = self.state.rotation[i].transpose()
        turn = back @ self.state.rotation[j]
        offset = back @ (self.state.position[j] - self.state.position[i])
        missed = self._bodies_overlap(i, j, turn, offset, 1)
        if missed == 1:
            missed -= self._bodies_overlap(i, j, turn, offset, 0)
        return missed

    @ti.func
    def _bodies_overlap(self, i, j, turn, offset, bare):
        """1 where spheres behind free faces overlap, with (1) or without (0) bare ones, else 0."""
        found = 0
        for f, g in ti.ndrange(4, 4):
            first, second = 4 * i + f, 4 * j + g
            if self._free(first) == 1 and self._free(second) == 1:
                if ti.max(self._bare(first), self._bare(second)) == bare:
                    found |= self._faces_overlap(first, second, turn, offset)
        return found

    @ti.func
    def _free(self, face):
        """1 for a broken or an outer face."""
        return ti.max(self._bare(face), ti.cast(self.state.exposed_tick[face] >= 0, ti.i32))

    @ti.func
    def _bare(self, face):
        """1 for an outer face without spheres."""
        outer = self.tables.neighbour[face] < 0
        return ti.cast(outer and self.state.exposed_tick[face] < 0, ti.i32)

    @ti.func
    def _faces_overlap(self, first, second, turn, offset):
        """1 where spheres behind two faces overlap; turn, offset: second body in the first's."""
        found = 0
        ball, other = self.tables.cluster[first], self.tables.cluster[second]
        if (turn @ other.xyz + offset - ball.xyz).norm() < ball[3] + other[3]:
            count = self.tables.face_spheres[None]
            for a, b in ti.ndrange(count, count):
                mine = self.tables.sphere[first * count + a]
                theirs = self.tables.sphere[second * count + b]
                reach = (1.0 - LEAST_OVERLAP) * (mine[3] + theirs[3])
                if (turn @ theirs.xyz + offset - mine.xyz).norm_sqr() < reach * reach:
                    found = 1
        return found
