"""Unstructured tetrahedra: the points of a solid moved at random and joined by Delaunay's rule.

Points keep to the bounds of the solid. Other builds of SciPy's Qhull may join other points.
"""

from collections.abc import Callable

import numpy as np

from taichi_dem.kit.errors import InputError
from taichi_dem.mesh import tetrahedra as geometry

#: Given points (n, 3) [m], whether each lies in the solid, or on one of its sides.
Within = Callable[[np.ndarray], np.ndarray]
#: Largest move of a point along each axis, at the start and where a body is bad; least distance of
#: a moved point from the planes around it: all in elements. Of moves of 0.45 rows are left.
_MOVE, _MEND, _FROM_SIDE = 1.0, 0.3, 0.2
#: Draws of the moves until the points can be joined.
_DRAWS = 5
#: Rounds of evening out, and most rounds of mending.
_EVEN, _ROUNDS = 8, 100
#: Quality of a body below which it is mended, see ``_quality``: in meshes that were tried angles
#: between faces were then 15 degrees and more.
_QUALITY = 0.125
#: Points that move in one round are so far apart, and around each all bodies whose middle is so
#: near are judged, in elements.
_APART, _AROUND = 3.5, 1.5
#: Volume of a body that is flat, in elements cubed; share of the volume that may be missing.
_FLAT, _MISSING = 1e-9, 1e-11


class _Solid:
    """What stays while points move: the region, and the axes along which each may move."""

    def __init__(self, points, tetrahedra, within, on_side, element):
        self.within, self.on_side, self.element = within, on_side, element
        self.volume = np.abs(geometry.signed_volumes(points, tetrahedra)).sum()
        self.free = _free_axes(points, tetrahedra)
        margin = _FROM_SIDE * element * self.free
        # Points of one side, as between the corners of a slit and the ends of the solid.
        self.sliding = self.free[:, :2].sum(axis=1) == 1
        self.low, self.high = points.min(axis=0) + margin, points.max(axis=0) - margin

    def moved(self, points, shift):
        """Points shifted along their free axes, where that leaves them in the solid."""
        moved = np.clip(points + self.free * shift, self.low, self.high)
        out = ~self.within(moved) & self.free[:, :2].all(axis=1)
        out[self.sliding] = ~self.on_side(moved[self.sliding])
        moved[out] = points[out]
        return moved

    def filled(self, points):
        """Tetrahedra of Delaunay's rule inside the solid, without flat ones, of positive volume."""
        # Imported here, so that SciPy loads only where a mesh is scattered.
        from scipy.spatial import Delaunay

        tetrahedra = Delaunay(points).simplices
        volume = geometry.signed_volumes(points, tetrahedra)
        tetrahedra = np.where((volume < 0.0)[:, None], tetrahedra[:, [0, 1, 3, 2]], tetrahedra)
        solid = np.abs(volume) > _FLAT * self.element**3
        return tetrahedra[solid & self.within(points[tetrahedra].mean(axis=1))]

    def is_filled(self, points, tetrahedra):
        """Whether the volume of bodies is that of the solid: no gap, and none outside."""
        filled = geometry.signed_volumes(points, tetrahedra).sum()
        return abs(filled - self.volume) <= _MISSING * self.volume


def scattered(
    points: np.ndarray,
    tetrahedra: np.ndarray,
    within: Within,
    on_side: Within,
    element: float,
    seed: int,
) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 3) [m] and tetrahedra (m, 4) of the same solid and element size, without rows."""
    solid = _Solid(points, tetrahedra, within, on_side, element)
    if not solid.free.any():
        return points, tetrahedra
    draw = np.random.default_rng(seed)
    for number in range(_DRAWS):
        if number == _DRAWS - 1:
            # Around a narrow hole only points at equal heights keep the others out of it.
            solid.free &= solid.free.sum(axis=1, keepdims=True) > 1
        shift = _MOVE * element * draw.uniform(-1.0, 1.0, points.shape)
        moved = _evened(solid, solid.moved(points, shift))
        if solid.is_filled(moved, solid.filled(moved)):
            return _mended(solid, moved, draw)
    raise InputError(
        f"element must be smaller for scatter to fit bodies into this shape, got {element:g} m"
    )


def _free_axes(points, tetrahedra):
    """Whether each point may move along each axis and stay in all its outer planes, (n, 3)."""
    outer = geometry.outer_faces(tetrahedra)
    along = np.abs(geometry.unit_normals(points, outer)) < _FLAT
    free = np.ones(points.shape, dtype=bool)
    for corner in outer.T:
        np.logical_and.at(free, corner, along)
    return free


def _evened(solid, points):
    """Points moved to the middle of the bodies around them, a few times over."""
    for _ in range(_EVEN):
        bodies = solid.filled(points)
        volume = geometry.signed_volumes(points, bodies)
        middle = points[bodies].mean(axis=1) * volume[:, None]
        corner = bodies.ravel()
        sums = [np.bincount(corner, np.repeat(part, 4), len(points)) for part in middle.T]
        around = np.bincount(corner, np.repeat(volume, 4), len(points))
        points = solid.moved(points, np.stack(sums, axis=1) / around[:, None] - points)
    return points


def _mended(solid, points, draw):
    """Points and bodies after random moves of points of the worst bodies, where these gain."""
    bodies = solid.filled(points)
    for _ in range(_ROUNDS):
        quality = _quality(points, bodies)
        bad = np.argsort(quality, kind="stable")[: (quality < _QUALITY).sum()]
        corner = bodies[bad, draw.integers(0, 4, len(bad))]
        movers = _apart(points, corner[solid.free[corner].any(axis=1)], _APART * solid.element)
        if not len(bad):
            break
        shift = np.zeros(points.shape)
        shift[movers] = _MEND * solid.element * draw.uniform(-1.0, 1.0, (len(movers), 3))
        tried = solid.moved(points, shift)
        cells = solid.filled(tried)
        before = _worst_near(points[movers], points, bodies, solid.element)
        after = _worst_near(points[movers], tried, cells, solid.element)
        back = movers[after <= before]
        if len(back):
            tried[back] = points[back]
            cells = solid.filled(tried)
        if solid.is_filled(tried, cells):
            points, bodies = tried, cells
    return points, bodies


def _quality(points, tetrahedra):
    """Cube of 12 (3 V)^(2/3) / (sum of squared edges): 1 for a regular body, 0 for a flat one."""
    squares = (geometry.edge_lengths(points, tetrahedra) ** 2).sum(axis=1)
    return 15552.0 * geometry.signed_volumes(points, tetrahedra) ** 2 / squares**3


def _apart(points, candidates, distance):
    """Those of some numbers of points, the first first, that are a distance apart [m]."""
    chosen: list[int] = []
    for candidate in candidates.tolist():
        away = geometry.length(points[chosen] - points[candidate])
        if away.min(initial=np.inf) > distance:
            chosen.append(candidate)
    return np.array(chosen, dtype=int)


def _worst_near(places, points, tetrahedra, element):
    """Least quality of the bodies around each of some places, (n,)."""
    from scipy.spatial import KDTree

    quality = _quality(points, tetrahedra)
    near = KDTree(points[tetrahedra].mean(axis=1)).query_ball_point(places, _AROUND * element)
    return np.array([quality[bodies].min(initial=1.0) for bodies in near])
