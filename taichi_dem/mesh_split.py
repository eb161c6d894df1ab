"""Hexahedra, prisms and pyramids cut into tetrahedra, quadrangles into triangles (NumPy only).

Every quadrangle is cut by the diagonal through its corner of lowest number, whoever it belongs to:
so cells that share one agree, and faces of groups fit the cells they lie on.
Source: Dompierre, Labbe, Vallet, Camarero, How to subdivide pyramids, prisms, and hexahedra into
tetrahedra, 8th International Meshing Roundtable, 1999.
"""

import numpy as np

from taichi_dem.tetrahedra import signed_volumes

#: Faces of a cell by its corners, in the order of meshio and VTK.
_FACES = {
    "hexahedron": (
        *((0, 4, 7, 3), (1, 2, 6, 5), (0, 1, 5, 4)),
        *((3, 7, 6, 2), (0, 3, 2, 1), (4, 5, 6, 7)),
    ),
    "wedge": ((0, 1, 2), (3, 5, 4), (0, 3, 4, 1), (1, 4, 5, 2), (2, 5, 3, 0)),
    "pyramid": ((0, 3, 2, 1), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)),
}
_CORNERS = {"hexahedron": 8, "wedge": 6, "pyramid": 5}


def shape_of(kind):
    """Key of ``_FACES`` for a cell type of meshio of any order, or None: it cannot be cut."""
    name = kind.lower().replace("vtk_lagrange_", "")
    return next((shape for shape in _FACES if name.startswith(shape)), None)


def tetrahedra_in(points, kind, cells):
    """Tetrahedra of positive volume that fill cells, (m, 4).

    points: (n, 3) [m]. kind: cell type, of which ``shape_of`` gives a shape. cells: (k, corners and
    more), corners first.

    A cell is cut into cones from its lowest corner to the faces that this is no part of.
    """
    shape = shape_of(kind)
    corners = np.asarray(cells)[:, : _CORNERS[shape]]
    lowest = corners.argmin(axis=1)
    found = [np.empty((0, 4), dtype=np.int64)]
    for apex in range(_CORNERS[shape]):
        here = corners[lowest == apex]
        for face in _FACES[shape]:
            if apex not in face and len(here):
                base = triangles_in(here[:, face])
                tip = np.repeat(here[:, apex], len(base) // len(here))
                found.append(np.column_stack([tip, base]))
    return _positive(np.asarray(points, dtype=np.float64), np.vstack(found))


def _positive(points, tetrahedra):
    """Turn those of negative volume; numbers or points that make no sense are left as they are."""
    known = (tetrahedra >= 0).all() and tetrahedra.max(initial=-1) < len(points)
    if known and points.ndim == 2 and points.shape[1] == 3:
        with np.errstate(over="ignore", invalid="ignore"):
            turned = signed_volumes(points, tetrahedra) < 0.0
        tetrahedra[turned] = tetrahedra[turned][:, [0, 1, 3, 2]]
    return tetrahedra


def triangles_in(faces):
    """Triangles of faces with three or four corners, (k, 3) or (2 k, 3); two of a face in turn."""
    faces = np.asarray(faces)
    if faces.shape[1] == 3:
        return faces
    first = faces.argmin(axis=1)[:, None]
    round_it = np.take_along_axis(faces, (first + np.arange(4)) % 4, axis=1)
    return round_it[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)
