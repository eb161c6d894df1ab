"""Solids whose front view is drawn out along z: layers of prisms of three tetrahedra each.

The front view is a plane region with holes in triangles of even size. Points lie on the outline
and, in a regular triangular lattice, inside; they are joined by Delaunay's rule and moved to the
middle of their neighbours, a few times over.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from taichi_dem.kit.errors import InputError
from taichi_dem.kit.fixed_order import dot
from taichi_dem.mesh import tetrahedra as geometry
from taichi_dem.mesh.mesh import Mesh, checked_mesh

#: Height of a layer over the edge of its triangles.
_LAYER = 0.8
#: Given coordinates of points (..., 2) [m], whether each lies on a part of the outline.
OnOutline = Callable[[np.ndarray], np.ndarray]
#: Least distance of an inner point from the outline, and shift that decides between triangulations
#: of points on one circle, in elements.
_FROM_OUTLINE, _SHIFT = 0.55, 1e-4
#: Largest circumscribed radius of an inner triangle, in elements, and where that fails.
_RADII = 0.95, 1.6
#: Rounds of smoothing, and moves of a round.
_ROUNDS, _MOVES = 3, 4
#: Share of the area that may be missing.
_AREA = 1e-9


def drawn_out(
    loops: Sequence[np.ndarray], depth: float, element: float, sides: Mapping[str, OnOutline]
) -> Mesh:
    """A solid from z = 0 to a depth; groups back (z = 0), front, and the sides by name.

    Parameters
    ----------
    loops : arrays (k, 2) [m]
        Outline of the front view, and holes, see ``triangulated``.
    depth, element : float [m]
    sides : dict
        Name of a group to a function that says which points of the outline are on it.
    """
    flat, triangles = triangulated(loops, element)
    layers = max(1, round(depth / (_LAYER * element)))
    heights = np.linspace(0.0, depth, layers + 1)
    points = np.hstack([np.tile(flat, (layers + 1, 1)), np.repeat(heights, len(flat))[:, None]])
    # Which way prisms are cut follows from numbers: in their order all would be cut alike.
    rank = np.random.default_rng(len(flat)).permutation(len(flat))
    layered = [_prisms(triangles, rank, k, len(flat)) for k in range(layers)]
    tetrahedra = np.vstack(layered)
    groups = _groups(points, geometry.outer_faces(tetrahedra), depth, sides)
    return checked_mesh(points, tetrahedra, groups)


def _prisms(triangles, rank, layer, count):
    """Three tetrahedra for each prism: neighbours match, as low ranks go first in each of them."""
    order = np.argsort(rank[triangles], axis=1)
    low = np.take_along_axis(triangles, order, axis=1)
    # Every second layer is the mirror image, so that no direction is preferred.
    near, far = (layer, layer + 1) if layer % 2 == 0 else (layer + 1, layer)
    (a, b, c), (d, e, f) = (low + near * count).T, (low + far * count).T
    parts = [np.stack(rows, axis=1) for rows in ((a, b, c, f), (a, b, e, f), (a, d, e, f))]
    return np.vstack(parts)


def _groups(points, outer, depth, sides):
    """Faces of the two ends, and of the sides: those with all corners there."""
    z = points[outer, 2]
    ends = {"back": (z == 0.0).all(axis=1), "front": (z == depth).all(axis=1)}
    between = ~(ends["back"] | ends["front"])
    for name, on in sides.items():
        ends[name] = between & on(points[outer, :2]).all(axis=1)
    return {name: outer[chosen] for name, chosen in ends.items()}


def triangulated(loops: Sequence[np.ndarray], element: float) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 2) and triangles (m, 3), anticlockwise; the points of the loops come first.

    Parameters
    ----------
    loops : arrays (k, 2) [m]
        Corners of the outline, anticlockwise, and of holes in it, clockwise, about an element
        apart.
    element : float [m]
        Length of an edge.

    Raises
    ------
    InputError
        Where the outline is too narrow, or too finely divided, for elements of this size.
    """
    starts = np.vstack(loops)
    ends = np.vstack([np.roll(loop, -1, axis=0) for loop in loops])
    draw = np.random.default_rng(1)
    points = np.vstack([starts, _inner_points(starts, ends, element)])
    for _ in range(_ROUNDS):
        found = _inner_triangles(points, starts, ends, element, draw)
        _smooth(points, found, len(starts))
    return points, found


def _inner_triangles(points, starts, ends, element, draw):
    """Triangles that fill the region; InputError where they do not."""
    wanted = 0.5 * float((starts[:, 0] * ends[:, 1] - ends[:, 0] * starts[:, 1]).sum())
    for radius in _RADII:
        found = _delaunay(points, radius * element, _SHIFT * element, draw)
        found = found[_is_inside(points[found].mean(axis=1), starts, ends)]
        if abs(float(_areas(points, found).sum()) - wanted) <= _AREA * wanted:
            return found
    raise InputError(
        "element must be smaller for this shape, whose narrowest place it has to fit into, got "
        f"{element:g} m"
    )


def _inner_points(starts, ends, element):
    """Lattice of triangles inside the outline, away from it."""
    low, high = starts.min(axis=0), starts.max(axis=0)
    count = np.ceil((high - low) / (element * np.array([1.0, np.sqrt(0.75)]))).astype(int) + 1
    column, row = np.meshgrid(np.arange(count[0]), np.arange(count[1]), indexing="ij")
    x = (column + 0.5 * (row % 2)).ravel() * element
    lattice = np.stack([x, row.ravel() * element * np.sqrt(0.75)], axis=1)
    lattice += 0.5 * (low + high - lattice.min(axis=0) - lattice.max(axis=0))
    lattice = lattice[_is_inside(lattice, starts, ends)]
    return lattice[_distance(lattice, starts, ends) > _FROM_OUTLINE * element]


def _distance(points, starts, ends):
    """Distance of points from the nearest of some sides [m], (n,)."""
    nearest = np.full(len(points), np.inf)
    for start, side in zip(starts, ends - starts):
        arm = points - start
        share = np.clip(dot(arm, side) / dot(side, side), 0.0, 1.0)
        away = arm - share[:, None] * side
        nearest = np.minimum(nearest, np.sqrt(dot(away, away)))
    return nearest


def _is_inside(points, starts, ends):
    """Whether points lie inside the outline and outside its holes, (n,): rays to the right."""
    (x, y), inside = points.T, np.zeros(len(points), dtype=bool)
    for (x0, y0), (x1, y1) in zip(starts, ends):
        between = (y0 > y) != (y1 > y)
        inside[between] ^= x0 + (y[between] - y0) * (x1 - x0) / (y1 - y0) > x[between]
    return inside


def _delaunay(points, radius, shift, draw):
    """Triangles of points whose circles hold no other point, each once, anticlockwise."""
    # Imported here, so that matplotlib loads only where a solid is made.
    from matplotlib.tri import Triangulation

    # Of points on one circle any triangulation is right, and all triangles must choose the same.
    moved = points + shift * draw.uniform(-1.0, 1.0, points.shape)
    found = np.sort(Triangulation(*moved.T).triangles, axis=1)
    a, b, c = (moved[found[:, k]] for k in range(3))
    sides = dot(a - b, a - b) * dot(b - c, b - c) * dot(c - a, c - a)
    # The product of the sides is four times the radius times the area.
    small = sides < (4.0 * radius * _areas(moved, found)) ** 2
    triangles = np.unique(found[small], axis=0)
    return np.where((_areas(points, triangles) < 0.0)[:, None], triangles[:, ::-1], triangles)


def _areas(points, triangles):
    """Areas of triangles [m2], negative where they are clockwise, (m,)."""
    corner = points[triangles]
    a, b = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
    return 0.5 * (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])


def _smooth(points, triangles, fixed):
    """Move the points behind the fixed ones to the middle of the triangles around them."""
    for _ in range(_MOVES):
        area = np.abs(_areas(points, triangles))
        middle = points[triangles].mean(axis=1) * area[:, None]
        corner, weight = triangles.ravel(), np.repeat(area, 3)
        sums = [np.bincount(corner, np.repeat(part, 3), len(points)) for part in middle.T]
        around = np.bincount(corner, weight, len(points))
        mean = np.stack(sums, axis=1) / np.where(around > 0.0, around, 1.0)[:, None]
        points[fixed:] = mean[fixed:]


def circle(centre: Any, diameter: float, element: float) -> np.ndarray:
    """Corners of a regular polygon on a circle, about an element apart, (k, 2), anticlockwise."""
    count = max(8, round(np.pi * diameter / element))
    angle = 2.0 * np.pi * np.arange(count) / count
    return np.asarray(centre) + 0.5 * diameter * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def divided(corners: Any, element: float) -> np.ndarray:
    """Corners of a polygon with points between them, about an element apart, (k, 2)."""
    corners, parts = np.asarray(corners, dtype=float), []
    for start, end in zip(corners, np.roll(corners, -1, axis=0)):
        count = max(1, round(float(np.sqrt(((end - start) ** 2).sum())) / element))
        parts.append(start + (end - start) * (np.arange(count) / count)[:, None])
    return np.vstack(parts)
