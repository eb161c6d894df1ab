"""Small specimens for tests of strength, of elements of a given size: a prism and a disc."""

import numpy as np

from taichi_dem.kit.fixed_order import length
from taichi_dem.mesh.mesh import Mesh, checked_mesh
from taichi_dem.mesh.shapes import bar, with_moved_nodes
from taichi_dem.mesh.tetrahedra import all_faces, area_vectors, shared_faces

#: Boxes across and along a prism, across the diameter of a disc, and through it.
_ACROSS, _ALONG, _DIAMETER, _THROUGH = 4, 8, 12, 2
#: Largest shift of a point, as a share of a box.
_SHIFT = 0.15
#: Half of the angle of the arcs on which a disc is loaded by default [degrees].
ARC = 10.0


def prism(element: float, seed: int) -> Mesh:
    """Square prism along x, twice as long as wide; groups left and right are its ends.

    element: edge of the regular tetrahedron as large as its bodies [m]. seed: of the shifts of its
    points.
    """
    box = _box(element)
    straight = bar(_ALONG * box, _ACROSS * box, (_ALONG, _ACROSS, _ACROSS))
    return with_moved_nodes(straight, _SHIFT * box, seed)


def disc(element: float, seed: int, arc: float = ARC) -> Mesh:
    """Disc about z, cut from boxes; groups bottom and top are arcs of its rim.

    element, seed: as for ``prism``. arc: half of their angle [degrees].
    """
    box = _box(element)
    width = _DIAMETER * box
    square = bar(width, width, (_DIAMETER, _DIAMETER, _THROUGH))
    points = square.points * [1.0, 1.0, _THROUGH / _DIAMETER] - [0.5 * width, 0.5 * width, 0.0]
    block = with_moved_nodes(checked_mesh(points, square.tetrahedra, {}), _SHIFT * box, seed)
    middle = block.points[block.tetrahedra].mean(axis=1)
    bodies = block.tetrahedra[np.hypot(middle[:, 0], middle[:, 1]) < 0.5 * width]
    return checked_mesh(block.points, bodies, _arcs(block.points, bodies, 0.5 * width, arc))


def _box(element):
    """Edge of a box cut into six bodies [m]: edge^3 / (6 sqrt 2) = box^3 / 6."""
    return element / 2.0 ** (1.0 / 6.0)


def _arcs(points, bodies, radius, arc):
    """Outer faces of the rim around its lowest and its highest line."""
    faces = all_faces(bodies)
    free = np.ones(len(faces), dtype=bool)
    free[shared_faces(bodies).ravel()] = False
    faces = faces[free]
    x, y, _ = points[faces].mean(axis=1).T
    normal = area_vectors(points, faces)
    rim = np.abs(normal[:, 2]) < 0.9 * length(normal)
    rim &= (np.degrees(np.arctan2(np.abs(x), np.abs(y))) < arc) & (np.hypot(x, y) > 0.7 * radius)
    return {"bottom": faces[rim & (y < 0.0)], "top": faces[rim & (y > 0.0)]}
