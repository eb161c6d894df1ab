"""Groups of faces and of bodies that a file of meshio's names."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from taichi_dem.kit.errors import InputError
from taichi_dem.mesh.cells import Bodies, blocks_of, corners_of, triangles_in
from taichi_dem.mesh.gmsh_files import made_name, physical_names
from taichi_dem.mesh.mesh import Mesh

#: Between the names of groups in that of a physical volume whose cells are in all of them.
_BOTH = "|"


def face_groups_in(raw: Any) -> dict[str, np.ndarray]:
    """Triangles (n, 3) by the names of physical surfaces, or as "data name_value" in other formats.

    A physical surface without a name is "physical_TAG".
    """
    groups = {}
    for name, members in _groups_in(raw, 2).items():
        corners = [corners_of(raw.cells[k], len(raw.points))[on] for k, on in members.items()]
        groups[name] = np.vstack([triangles_in(rows) for rows in corners])
    return groups


def body_groups_in(raw: Any, bodies: Bodies) -> dict[str, np.ndarray]:
    """Numbers of bodies by the names of physical volumes; in other formats, sets of solid cells.

    There, integers on solid cells give groups too, as "data name_value".
    """
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
    """Names of physical volumes, which have numbers from ``first`` on, and that of every body.

    Bodies in no group have the number 0; without any group one volume holds them all. Raises
    InputError for the name of a group that stands for two.
    """
    if not mesh.body_groups:
        return ["bodies"], np.full(mesh.body_count, first)
    for name in mesh.body_groups:
        if _BOTH in name:
            raise InputError(
                f"a body group must have a name without {_BOTH!r} in a file, got {name!r}"
            )
    member = np.zeros((mesh.body_count, len(mesh.body_groups)), dtype=bool)
    for k, bodies in enumerate(mesh.body_groups.values()):
        member[bodies, k] = True
    kinds, kind = np.unique(member, axis=0, return_inverse=True)
    names = [_BOTH.join(np.array(list(mesh.body_groups))[row]) for row in kinds]
    tags = np.cumsum([bool(name) for name in names]) * [bool(name) for name in names]
    return [name for name in names if name], np.where(tags, tags + first - 1, 0)[kind.reshape(-1)]


def unread_groups(raw: Any, mesh: Mesh) -> tuple[str, ...]:
    """Names of the groups of a file that are neither of faces nor of bodies."""
    named = [key.name for key in raw.field_data]
    named += [key for key in raw.cell_sets if key not in raw.field_data]
    known = {*mesh.groups, *mesh.body_groups, "gmsh:bounding_entities"}
    unread = (one for one in (*named, *raw.point_sets) if known.isdisjoint(one.split(_BOTH)))
    return tuple(dict.fromkeys(unread))


def _groups_in(raw, dimension):
    """Groups of faces (2) or solid cells (3): name to number of a block to its members, (n,)."""
    groups: dict[str, dict[int, np.ndarray]] = {}
    # A solid is in each of the groups that ``write_mesh`` has joined.
    several = dimension == 3 and "gmsh:physical" in raw.cell_data
    for name, k, chosen in _marked(raw, dimension):
        for one in name.split(_BOTH) if several else [name]:
            members = groups.setdefault(one, {})
            members[k] = chosen | members.get(k, False)
    return groups


def _marked(raw, dimension) -> Iterator[tuple[str, int, np.ndarray]]:
    """Name of a group, number of a block, and which of its cells are in the group."""
    if "gmsh:physical" in raw.cell_data:
        names = physical_names(raw, dimension)
        for value, k, chosen in _values(raw, "gmsh:physical", dimension):
            if value > 0:  # 0: in no physical group
                name = names.get(value) or made_name("physical", value, names.values())
                yield name, k, chosen
        # What is in two groups: Gmsh 4.1 keeps one number a cell, but the sets know of both.
        for key in raw.field_data:
            for k, chosen in _of_set(raw, key, dimension):
                yield key.name, k, chosen
        return
    sets = raw.cell_sets if dimension == 3 else {}
    for name in sets:
        yield from ((name, k, chosen) for k, chosen in _of_set(raw, name, dimension))
    for name in raw.cell_data:
        # Those of Gmsh are numbers of drawn entities, no choice of the user.
        if not name.startswith("gmsh:") and (dimension == 2 or _tells_parts(raw, name)):
            for value, k, chosen in _values(raw, name, dimension):
                yield made_name(name, value, sets), k, chosen


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
    """Whether solid cells carry different whole numbers of a name, as they do for materials.

    Numbers of which each cell has its own are numbers of the cells, not of materials.
    """
    chosen = list(_values(raw, name, 3))
    cells = sum(int(members.sum()) for _, _, members in chosen)
    return 1 < len({value for value, _, _ in chosen}) < max(cells, 3)
