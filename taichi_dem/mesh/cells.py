"""Solid cells of mesh files cut into tetrahedra, faces into triangles, by meshio's names of cells.

Every quadrangle is cut by the diagonal through its corner of lowest number, whoever it belongs to:
so cells that share one agree, and faces of groups fit the cells they lie on.
Source: Dompierre, Labbe, Vallet, Camarero, How to subdivide pyramids, prisms, and hexahedra into
tetrahedra, 8th International Meshing Roundtable, 1999.

A cell with a corner named twice, such as a prism written as a hexahedron, gives fewer tetrahedra.
Weld points before cells are cut: two numbers of one point would make two sides disagree.
"""

from typing import Any, NamedTuple

import numpy as np

from taichi_dem.kit.errors import InputError
from taichi_dem.mesh.check import FLAT, refuse_outside
from taichi_dem.mesh.tetrahedra import LOCAL_EDGES, edge_lengths, signed_volumes

#: Corners of a cell by its shape; further nodes, on edges and faces, follow them.
_SOLIDS = {"tetra": 4, "hexahedron": 8, "wedge": 6, "pyramid": 5}
_FACES = {"triangle": 3, "quad": 4}
_CORNERS = {**_SOLIDS, **_FACES}
#: Faces of a solid by its corners, in the order of meshio and VTK.
_SIDES = {
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


class Bodies(NamedTuple):
    """Tetrahedra (n, 4) of a file, and for each the block of cells and the cell in it, (n,)."""

    tetrahedra: np.ndarray
    block: np.ndarray
    cell: np.ndarray


def shape_of(kind: str) -> str:
    """Shape of a cell type of meshio of any order, or "": it is not read."""
    name = kind.lower().replace("vtk_lagrange_", "")
    return next((shape for shape in _CORNERS if name.startswith(shape)), "")


def blocks_of(raw: Any, dimension: int) -> list[tuple[int, Any]]:
    """Number and block of the cells of a file that are faces (2) or solids (3) and are read."""
    shapes = _SOLIDS if dimension == 3 else _FACES
    numbered = enumerate(raw.cells)
    return [(k, block) for k, block in numbered if shape_of(block.type) in shapes and len(block)]


def bodies_in(raw: Any, points: np.ndarray) -> Bodies:
    """Tetrahedra of a file, those that other cells are cut into last and of positive volume.

    points: (n, 3), finite. Raises InputError for numbers that are of no point, and for cells that
    fold over themselves or have no volume.
    """
    solids = blocks_of(raw, 3)
    solids.sort(key=lambda numbered: shape_of(numbered[1].type) != "tetra")
    found, blocks, cells = [], [], []
    for k, block in solids:
        if shape_of(block.type) == "tetra":
            tetrahedra, owner = corners_of(block, len(points)), np.arange(len(block))
        else:
            tetrahedra, owner = _cut(block, points)
        found.append(tetrahedra)
        blocks.append(np.full(len(owner), k))
        cells.append(owner)
    return Bodies(np.vstack(found), np.concatenate(blocks), np.concatenate(cells))


def corners_of(block: Any, point_count: int) -> np.ndarray:
    """Corners of the cells of a block; InputError where they are no points."""
    corners = np.asarray(block.data)[:, : _CORNERS[shape_of(block.type)]]
    refuse_outside(block.type, "point", corners, point_count)
    return corners


def triangles_in(faces: np.ndarray) -> np.ndarray:
    """Triangles of faces with three or four corners, (k, 3) or (2 k, 3); two of a face in turn."""
    if faces.shape[1] == 3:
        return faces
    first = faces.argmin(axis=1)[:, None]
    round_it = np.take_along_axis(faces, (first + np.arange(4)) % 4, axis=1)
    return round_it[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)


def fault_of_cells(raw: Any, points: np.ndarray) -> str:
    """A sentence on the first cell that folds over itself or is partly flat once cut, or ""."""
    cut = [block for _, block in blocks_of(raw, 3) if shape_of(block.type) != "tetra"]
    for block in cut:
        cells = corners_of(block, len(points))
        tetrahedra, owner = _cones(block, cells)
        volume = signed_volumes(points, tetrahedra)
        longest = edge_lengths(points, tetrahedra).max(axis=1, initial=0.0)
        sign = np.where(np.abs(volume) <= FLAT * longest**3, 0.0, np.sign(volume))
        flat, folded, other = (
            np.bincount(owner[sign == one], minlength=len(cells)) > 0 for one in (0.0, 1.0, -1.0)
        )
        if (folded & other).any():
            return f"{_named(block, cells, folded & other)} {_FOLDED}"
        if flat.any():
            return f"{_named(block, cells, flat)} gives tetrahedra without volume"
    return "tetrahedra are numbered after cells have been cut" if cut else ""


def _cut(block, points):
    """Tetrahedra of positive volume in a block of other solids, and the cell of each."""
    cells = corners_of(block, len(points))
    tetrahedra, owner = _cones(block, cells)
    empty = np.bincount(owner, minlength=len(cells)) == 0
    if empty.any():
        raise InputError(f"{_named(block, cells, empty)} has no volume")
    negative = signed_volumes(points, tetrahedra) < 0.0
    return np.where(negative[:, None], tetrahedra[:, [0, 1, 3, 2]], tetrahedra), owner


def _named(block, cells, bad):
    first = int(np.argmax(bad))
    return f"{block.type} {first}, with the points {cells[first].tolist()},"


def _cones(block, corners):
    """Cones from the lowest corner of each cell to the faces that it is no part of.

    Those that have a corner twice are left out.
    """
    shape, lowest = shape_of(block.type), corners.argmin(axis=1)
    found, owners = [np.empty((0, 4), dtype=np.int64)], [np.empty(0, dtype=np.int64)]
    for apex in range(_CORNERS[shape]):
        numbers = np.flatnonzero(lowest == apex)
        here = corners[numbers]
        for face in _SIDES[shape]:
            if apex not in face and len(here):
                base = triangles_in(here[:, face])
                each = len(base) // len(here)
                found.append(np.column_stack([np.repeat(here[:, apex], each), base]))
                owners.append(np.repeat(numbers, each))
    tetrahedra, owner = np.vstack(found), np.concatenate(owners)
    ends = tetrahedra[:, LOCAL_EDGES]
    whole = (ends[..., 0] != ends[..., 1]).all(axis=1)
    return tetrahedra[whole], owner[whole]
