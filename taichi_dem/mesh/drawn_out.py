"""Solids whose front view is drawn out along z: layers of prisms of three tetrahedra each."""

from collections.abc import Mapping, Sequence
from typing import Callable

import numpy as np

from taichi_dem.mesh import tetrahedra as geometry
from taichi_dem.mesh.mesh import Mesh, checked_mesh
from taichi_dem.mesh.triangles import triangulated

#: Height of a layer over the edge of its triangles.
_LAYER = 0.8
#: Given coordinates of points (..., 2) [m], whether each lies on a part of the outline.
OnOutline = Callable[[np.ndarray], np.ndarray]


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
    faces = geometry.all_faces(tetrahedra)
    outer = faces[geometry.outer_rows(faces)]
    return checked_mesh(points, tetrahedra, _groups(points, outer, depth, sides))


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
