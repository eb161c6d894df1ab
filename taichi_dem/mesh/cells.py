"""Cells of mesh files, as meshio gives them, cut into tetrahedra and triangles; their groups.

Source: Dompierre, Labbe, Vallet, Camarero, 8th International Meshing Roundtable, 1999.
"""

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from taichi_dem.kit.errors import InputError
from taichi_dem.mesh.check import refuse_outside
from taichi_dem.mesh.mesh import Mesh
from taichi_dem.mesh.tetrahedra import LOCAL_EDGES, signed_volumes

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
#: Between the names of groups in that of a physical volume whose cells are in all of them.
_BOTH = "|"


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
    """Tetrahedra of a file, those that other cells are cut into last and of positive volume."""
    solids = blocks_of(raw, 3)
    solids.sort(key=lambda numbered: shape_of(numbered[1].type) != "tetra")
    bodies, owners = zip(*(_cut(block, points) for _, block in solids))
    blocks = np.repeat([k for k, _ in solids], list(map(len, owners)))
    return Bodies(np.vstack(bodies), blocks, np.concatenate(owners))


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


def _cut(block, points):
    """Tetrahedra of a block, of positive volume where it has other solids, and the cell of each."""
    cells = corners_of(block, len(points))
    if shape_of(block.type) == "tetra":
        return cells, np.arange(len(cells))
    tetrahedra, owner = _cones(block, cells)
    empty = np.bincount(owner, minlength=len(cells)) == 0
    if empty.any():
        raise InputError(f"{block.type} {np.argmax(empty)} has no volume")
    negative = signed_volumes(points, tetrahedra) < 0.0
    return np.where(negative[:, None], tetrahedra[:, [0, 1, 3, 2]], tetrahedra), owner


def _cones(block, corners):
    """Cones from the lowest corner of each cell to the faces that it is no part of."""
    shape, lowest = shape_of(block.type), corners.argmin(axis=1)
    cones, owners = [np.empty((0, 4), dtype=np.int64)], [np.empty(0, dtype=np.int64)]
    for apex in range(_CORNERS[shape]):
        numbers = np.flatnonzero(lowest == apex)
        here = corners[numbers]
        for face in _SIDES[shape]:
            if apex not in face and len(here):
                base = triangles_in(here[:, face])
                each = len(base) // len(here)
                cones.append(np.column_stack([np.repeat(here[:, apex], each), base]))
                owners.append(np.repeat(numbers, each))
    tetrahedra, owner = np.vstack(cones), np.concatenate(owners)
    ends = tetrahedra[:, LOCAL_EDGES]
    whole = (ends[..., 0] != ends[..., 1]).all(axis=1)
    return tetrahedra[whole], owner[whole]


def face_groups_in(raw: Any) -> dict[str, np.ndarray]:
    """Triangles (n, 3) by names of physical surfaces, or as "data name_value" in other formats."""
    groups = {}
    for name, members in _groups_in(raw, 2).items():
        corners = [corners_of(raw.cells[k], len(raw.points))[on] for k, on in members.items()]
        groups[name] = np.vstack([triangles_in(rows) for rows in corners])
    return groups


def body_groups_in(raw: Any, bodies: Bodies) -> dict[str, np.ndarray]:
    """Numbers of bodies by the names of physical volumes; in other formats, sets of solid cells."""
    groups = {}
    for name, members in _groups_in(raw, 3).items():
        on = np.zeros(len(bodies.block), dtype=bool)
        for k, chosen in members.items():
            mine = bodies.block == k
            on[mine] = chosen[bodies.cell[mine]]
        if on.any():
            groups[name] = np.flatnonzero(on)
    return groups


def volumes_of(mesh: Mesh, first: int) -> tuple[list[str], np.ndarray]:
    """Names of physical volumes, which have numbers from ``first`` on, and that of every body."""
    if not mesh.body_groups:
        return ["bodies"], np.full(mesh.body_count, first)
    member = np.zeros((mesh.body_count, len(mesh.body_groups)), dtype=bool)
    for k, bodies in enumerate(mesh.body_groups.values()):
        member[bodies, k] = True
    kinds, kind = np.unique(member, axis=0, return_inverse=True)
    names = [_BOTH.join(np.array(list(mesh.body_groups))[row]) for row in kinds]
    # Bodies in no group come first, where there are some.
    alone = int(not names[0])
    tags = np.arange(first - alone, first - alone + len(names)) * [bool(name) for name in names]
    return names[alone:], tags[kind.reshape(-1)]


def unread_groups(raw: Any, mesh: Mesh) -> tuple[str, ...]:
    """Names of the groups of a file that are neither of faces nor of bodies."""
    named = [key.name for key in raw.field_data]
    named += [key for key in raw.cell_sets if key not in raw.field_data]
    known = {*mesh.groups, *mesh.body_groups, "gmsh:bounding_entities"}
    unread = (group for group in (*named, *raw.point_sets) if known.isdisjoint(group.split(_BOTH)))
    return tuple(dict.fromkeys(unread))


def _groups_in(raw, dimension):
    """Groups of faces (2) or solid cells (3): name to number of a block to its members, (n,)."""
    groups: dict[str, dict[int, np.ndarray]] = {}
    # A solid is in each of the groups that ``write_mesh`` has joined.
    several = dimension == 3 and "gmsh:physical" in raw.cell_data
    for name, k, chosen in _marked(raw, dimension):
        for group in name.split(_BOTH) if several else [name]:
            members = groups.setdefault(group, {})
            members[k] = chosen | members.get(k, False)
    return groups


def _marked(raw, dimension) -> Iterator[tuple[str, int, np.ndarray]]:
    """Name of a group, number of a block, and which of its cells are in the group."""
    if "gmsh:physical" in raw.cell_data:
        names = {key.tag: key.name for key in raw.field_data if key.dimension == dimension}
        for value, k, chosen in _values(raw, "gmsh:physical", dimension):
            if value > 0:  # 0: in no physical group
                yield names.get(value) or f"physical_{value}", k, chosen
        # What is in two groups: Gmsh 4.1 keeps one number a cell, but the sets know of both.
        for key in raw.field_data:
            for k, chosen in _of_set(raw, key, dimension):
                yield key.name, k, chosen
        return
    for name in raw.cell_sets if dimension == 3 else ():
        yield from ((name, k, chosen) for k, chosen in _of_set(raw, name, dimension))
    for name in raw.cell_data:
        # Those of Gmsh are numbers of drawn entities, no choice of the user.
        if not name.startswith("gmsh:") and (dimension == 2 or _tells_parts(raw, name)):
            for value, k, chosen in _values(raw, name, dimension):
                yield f"{name}_{value}", k, chosen


def _values(raw, name, dimension):
    """An integer on cells, number of a block, and which of its cells have it."""
    for k, _ in blocks_of(raw, dimension):
        data = np.asarray(raw.cell_data[name][k])
        if data.ndim == 1 and data.dtype.kind in "iu":
            yield from ((value, k, data == value) for value in np.unique(data).tolist())


def _of_set(raw, key, dimension):
    """Number of a block, and which of its cells are in a set; those that hold some."""
    for k, block in blocks_of(raw, dimension) if key in raw.cell_sets else ():
        members = raw.cell_sets[key][k]
        if members is not None and len(members):
            yield k, np.isin(np.arange(len(block)), members)


def _tells_parts(raw, name):
    """Whether solid cells carry different whole numbers of a name, as they do for materials."""
    # If every cell has a number of its own, the numbers count cells and name no materials.
    chosen = list(_values(raw, name, 3))
    cells = sum(int(members.sum()) for _, _, members in chosen)
    return 1 < len({value for value, _, _ in chosen}) < max(cells, 3)
