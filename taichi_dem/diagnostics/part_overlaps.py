"""Parts of a mesh that run into each other where no contact is listed, found at recording times.

Without contact no body has spheres, so the tetrahedra themselves are compared.
"""

from typing import TYPE_CHECKING

import numpy as np
import taichi as ti

from taichi_dem.diagnostics.outer_faces import LEAST_OVERLAP
from taichi_dem.kit.types import vec3
from taichi_dem.mesh.parts import any_overlap, part_boxes

if TYPE_CHECKING:
    from taichi_dem.engine.model import Model
    from taichi_dem.engine.state import State

#: Square of the sine between two edges below which their cross product is no direction.
_PARALLEL = 1e-12


class PartOverlaps:
    """Finds pairs of bodies of different parts that overlap; inner bodies are left out.

    Bodies are compared only where the boxes around the parts overlap. part: number of each body's
    part, ``parts.parts_of``.
    """

    def __init__(self, model: "Model", state: "State", part: np.ndarray):
        self.model, self.state = model, state
        self.part = part.astype(np.int32)
        self.arms = model.mesh.points[model.mesh.tetrahedra] - model.centre[:, None]
        self.outer = np.unique(model.topology.outer_body)

    def overlaps(self) -> np.ndarray:
        """How many later bodies each body overlaps now, (body_count,)."""
        found = np.zeros(self.model.body_count, dtype=np.int32)
        corners = np.einsum("nij,ncj->nci", self.state.rotation.to_numpy(), self.arms)
        corners += self.state.position.to_numpy()[:, None]
        if any_overlap(*part_boxes(corners, self.part)):
            body, last, ordered = self._candidates(corners)
            points = np.ascontiguousarray(self.model.mesh.tetrahedra[body], dtype=np.int32)
            count = np.zeros(len(body), dtype=np.int32)
            _count(last, ordered, self.part[body], points, count)
            found[body] = count
        return found

    def _candidates(self, corners):
        """Outer bodies along the longest axis, up to which each may overlap, and their corners."""
        corners = corners[self.outer]
        axis = np.ptp(corners, axis=(0, 1)).argmax()
        begin, end = corners[..., axis].min(axis=1), corners[..., axis].max(axis=1)
        order = np.argsort(begin, kind="stable")
        last = np.searchsorted(begin[order], end[order]).astype(np.int32)
        return self.outer[order], last, np.ascontiguousarray(corners[order])


@ti.kernel
def _count(
    last: ti.types.ndarray(dtype=ti.i32, ndim=1),
    corners: ti.types.ndarray(dtype=ti.f64, ndim=3),
    part: ti.types.ndarray(dtype=ti.i32, ndim=1),
    points: ti.types.ndarray(dtype=ti.i32, ndim=2),
    found: ti.types.ndarray(dtype=ti.i32, ndim=1),
):
    for i in range(last.shape[0]):
        for j in range(i + 1, last[i]):
            if part[i] != part[j]:
                strangers = 1
                for p, q in ti.ndrange(4, 4):
                    strangers *= ti.cast(points[i, p] != points[j, q], ti.i32)
                if strangers == 1 and _overlap(corners, i, j) == 1:
                    found[i] = found[i] + 1


@ti.func
def _overlap(corners: ti.template(), i, j):
    """1 where no plane parts two tetrahedra: along a face of one, or along an edge of each."""
    found = 1
    for axis in range(3):
        found *= _meet_along(corners, i, j, ti.Vector.unit(3, axis, ti.f64))
    for f in range(4):
        if found == 1:
            found *= _meet_along(corners, i, j, _normal(corners, i, f))
            found *= _meet_along(corners, i, j, _normal(corners, j, f))
    for e, g in ti.ndrange(6, 6):
        if found == 1:
            one, other = _edge(corners, i, e), _edge(corners, j, g)
            across = one.cross(other)
            if across.norm_sqr() > _PARALLEL * one.norm_sqr() * other.norm_sqr():
                found *= _meet_along(corners, i, j, across)
    return found


@ti.func
def _meet_along(corners: ti.template(), i, j, axis):
    """1 where the shadows of two bodies on an axis overlap."""
    low, high = ti.math.vec2(ti.math.inf), ti.math.vec2(-ti.math.inf)
    for c in range(4):
        one, other = axis.dot(_corner(corners, i, c)), axis.dot(_corner(corners, j, c))
        low, high = ti.min(low, [one, other]), ti.max(high, [one, other])
    common = ti.min(high[0], high[1]) - ti.max(low[0], low[1])
    return ti.cast(common > 0.5 * LEAST_OVERLAP * (high - low).sum(), ti.i32)


@ti.func
def _corner(corners: ti.template(), i, c):
    return vec3(corners[i, c, 0], corners[i, c, 1], corners[i, c, 2])


@ti.func
def _normal(corners: ti.template(), i, f):
    """Across the face opposite corner f."""
    first = _corner(corners, i, (f + 1) % 4)
    second, third = _corner(corners, i, (f + 2) % 4), _corner(corners, i, (f + 3) % 4)
    return (second - first).cross(third - first)


@ti.func
def _edge(corners: ti.template(), i, e):
    """Edge e of six: from the first corner to the others, then around the face opposite."""
    start, end = 0, e + 1
    if e >= 3:
        start, end = e - 2, (e - 2) % 3 + 1
    return _corner(corners, i, end) - _corner(corners, i, start)
