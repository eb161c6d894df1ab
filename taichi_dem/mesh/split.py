"""Hexahedra, prisms and pyramids cut into tetrahedra, quadrangles into triangles (NumPy only).

Every quadrangle is cut by the diagonal through its corner of lowest number, whoever it belongs to:
so cells that share one agree, and faces of groups fit the cells they lie on.
Source: Dompierre, Labbe, Vallet, Camarero, How to subdivide pyramids, prisms, and hexahedra into
tetrahedra, 8th International Meshing Roundtable, 1999.

A cell with a corner named twice, such as a prism written as a hexahedron, gives fewer tetrahedra.
Weld points before cells are cut: two numbers of one point would make two sides disagree.
"""

from typing import Optional, cast

import numpy as np
from numpy.typing import ArrayLike

from taichi_dem.kit.errors import InputError
from taichi_dem.mesh.mesh import FLAT
from taichi_dem.mesh.tetrahedra import LOCAL_EDGES, edge_lengths, signed_volumes

#: Faces of a cell by its corners, in the order of meshio and VTK.
_FACES = {
    "hexahedron": (
        *((0, 4, 7, 3), (1, 2, 6, 5), (0, 1, 5, 4)),
        *((3, 7, 6, 2), (0, 3, 2, 1), (4, 5, 6, 7)),
    ),
    "wedge": ((0, 1, 2), (3, 5, 4), (0, 3, 4, 1), (1, 4, 5, 2), (2, 5, 3, 0)),
    "pyramid": ((0, 3, 2, 1), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)),
}
_FOLDED = (
    "folds over itself when it is cut into tetrahedra: it is strongly twisted, or its corners are "
    "not in the order of the file's format"
)
_CORNERS = {"hexahedron": 8, "wedge": 6, "pyramid": 5}


def shape_of(kind: str) -> Optional[str]:
    """Key of ``_FACES`` for a cell type of meshio of any order, or None: it cannot be cut."""
    name = kind.lower().replace("vtk_lagrange_", "")
    return next((shape for shape in _FACES if name.startswith(shape)), None)


def tetrahedra_in(points: ArrayLike, kind: str, cells: np.ndarray) -> np.ndarray:
    """Tetrahedra of positive volume that fill cells, (m, 4).

    points: (n, 3) [m]. kind: cell type, of which ``shape_of`` gives a shape. cells: (k, corners and
    more), corners first.

    A cell is cut into cones from its lowest corner to the faces that this is no part of; those
    that have a corner twice are left out. Raises InputError for a cell of which nothing is left.
    """
    tetrahedra, owner = _cones(kind, cells)
    empty = np.bincount(owner, minlength=len(cells)) == 0
    if empty.any():
        raise InputError(f"{_named(kind, cells, empty)} has no volume")
    return _positive(np.asarray(points, dtype=np.float64), tetrahedra)


def owners_in(kind: str, cells: np.ndarray) -> np.ndarray:
    """Cell of each of the tetrahedra that ``tetrahedra_in`` gives, (m,)."""
    return _cones(kind, cells)[1]


def folded_or_flat(points: np.ndarray, kind: str, cells: np.ndarray) -> str:
    """A sentence on the first cell that folds over itself or is partly flat once cut, or "".

    points, kind, cells: as for ``tetrahedra_in``, finite and in range.
    """
    tetrahedra, owner = _cones(kind, cells)
    volume = signed_volumes(points, tetrahedra)
    flat = np.abs(volume) <= FLAT * edge_lengths(points, tetrahedra).max(axis=1, initial=0.0) ** 3

    def having(chosen):
        """Cells that have one of the chosen tetrahedra, (k,)."""
        return np.bincount(owner[chosen], minlength=len(cells)) > 0

    folded = having((volume > 0.0) & ~flat) & having((volume < 0.0) & ~flat)
    if folded.any():
        return f"{_named(kind, cells, folded)} {_FOLDED}"
    if flat.any():
        return f"{_named(kind, cells, having(flat))} gives tetrahedra without volume"
    return ""


def _named(kind: str, cells: np.ndarray, bad: np.ndarray) -> str:
    """The first of the cells that are bad, (k,), in words."""
    first = int(np.argmax(bad))
    corners = np.asarray(cells)[first, : _CORNERS[cast(str, shape_of(kind))]]
    return f"{kind} {first}, with the points {corners.tolist()},"


def _cones(kind: str, cells: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Tetrahedra of cells and the cell of each, (m, 4) and (m,), turned as the cells are."""
    shape = cast(str, shape_of(kind))
    corners = np.asarray(cells)[:, : _CORNERS[shape]]
    lowest = corners.argmin(axis=1)
    found: list[np.ndarray] = [np.empty((0, 4), dtype=np.int64)]
    owners: list[np.ndarray] = [np.empty(0, dtype=np.int64)]
    for apex in range(_CORNERS[shape]):
        numbers = np.flatnonzero(lowest == apex)
        here = corners[numbers]
        for face in _FACES[shape]:
            if apex not in face and len(here):
                base = triangles_in(here[:, face])
                each = len(base) // len(here)
                found.append(np.column_stack([np.repeat(here[:, apex], each), base]))
                owners.append(np.repeat(numbers, each))
    tetrahedra, owner = np.vstack(found), np.concatenate(owners)
    ends = tetrahedra[:, LOCAL_EDGES]
    whole = (ends[..., 0] != ends[..., 1]).all(axis=1)
    return tetrahedra[whole], owner[whole]


def _positive(points: np.ndarray, tetrahedra: np.ndarray) -> np.ndarray:
    """Turn those of negative volume; numbers or points that make no sense are left as they are."""
    known = (tetrahedra >= 0).all() and tetrahedra.max(initial=-1) < len(points)
    if known and points.ndim == 2 and points.shape[1] == 3:
        with np.errstate(over="ignore", invalid="ignore"):
            turned = signed_volumes(points, tetrahedra) < 0.0
        tetrahedra[turned] = tetrahedra[turned][:, [0, 1, 3, 2]]
    return tetrahedra


def triangles_in(faces: ArrayLike) -> np.ndarray:
    """Triangles of faces with three or four corners, (k, 3) or (2 k, 3); two of a face in turn."""
    faces = np.asarray(faces)
    if faces.shape[1] == 3:
        return faces
    first = faces.argmin(axis=1)[:, None]
    round_it = np.take_along_axis(faces, (first + np.arange(4)) % 4, axis=1)
    return round_it[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)
