"""Named groups of bodies read from the solid cells of a file (NumPy only)."""

from collections import defaultdict
from collections.abc import Iterator
from typing import Any

import numpy as np

from taichi_dem.kit.errors import InputError
from taichi_dem.mesh.content import is_solid, is_tetrahedron, tells_parts
from taichi_dem.mesh.gmsh_names import made_name, physical_names
from taichi_dem.mesh.mesh import Mesh
from taichi_dem.mesh.split import owners_in

#: Between the names of groups in that of a physical volume whose cells are in all of them.
BOTH = "|"


def body_groups_of(raw: Any) -> dict[str, np.ndarray]:
    """Groups of bodies that a file of meshio names, name -> body numbers.

    Gmsh's physical volumes ("physical_TAG" where they have no name, and one called "a|b" for both a
    and b); in other formats sets of solid cells, and integers on solid cells, as "data name_value".
    """
    cells = list(_cells_of_bodies(raw))
    found = defaultdict(list)
    for name, block, members in _marked_cells(raw):
        found[name].append((block, members))
    groups = {}
    for name, marks in found.items():
        chosen = [
            np.any([members[owner] for k, members in marks if k == block], axis=0)
            if any(k == block for k, _ in marks)
            else np.zeros(len(owner), dtype=bool)
            for block, owner in cells
        ]
        bodies = np.flatnonzero(np.concatenate(chosen))
        if len(bodies):
            groups[name] = bodies
    return groups


def volumes_of(mesh: Mesh, first: int) -> tuple[list[str], np.ndarray]:
    """Names of physical volumes, which have numbers from ``first`` on, and that of every body.

    Bodies in no group have the number 0; without any group one volume holds them all. Raises
    InputError for the name of a group that stands for two.
    """
    if not mesh.body_groups:
        return ["bodies"], np.full(mesh.body_count, first)
    for name in mesh.body_groups:
        if BOTH in name:
            raise InputError(
                f"a body group must have a name without {BOTH!r} in a file, got {name!r}"
            )
    member = np.zeros((mesh.body_count, len(mesh.body_groups)), dtype=bool)
    for k, bodies in enumerate(mesh.body_groups.values()):
        member[bodies, k] = True
    kinds, kind = np.unique(member, axis=0, return_inverse=True)
    names = [BOTH.join(np.array(list(mesh.body_groups))[row]) for row in kinds]
    tags = np.cumsum([bool(name) for name in names]) * [bool(name) for name in names]
    return [name for name in names if name], np.where(tags, tags + first - 1, 0)[kind.reshape(-1)]


def _cells_of_bodies(raw) -> Iterator[tuple[int, np.ndarray]]:
    """Blocks of solid cells in the order of their bodies, with the cell of each body."""
    solid = [(k, block) for k, block in enumerate(raw.cells) if len(block.data)]
    for k, block in solid:
        if is_tetrahedron(block.type):
            yield k, np.arange(len(block.data))
    for k, block in solid:
        if is_solid(block.type) and not is_tetrahedron(block.type):
            yield k, owners_in(block.type, block.data)


def _marked_cells(raw) -> Iterator[tuple[str, int, np.ndarray]]:
    """Name of a group, number of a block, and which of its cells are in the group."""
    if "gmsh:physical" in raw.cell_data:
        names = physical_names(raw, 3)
        for k, value, chosen in _values(raw, "gmsh:physical"):
            if value > 0:  # 0: in no physical group
                name = names.get(value) or made_name("physical", value, names.values())
                yield from _of_each(name, k, chosen)
        # A volume in two groups: Gmsh 4.1 keeps one number a cell, but the sets know of both.
        for key in raw.field_data:
            for k, chosen in _of_set(raw, key):
                yield from _of_each(key.name, k, chosen)
        return
    for name in raw.cell_sets:
        yield from ((name, k, chosen) for k, chosen in _of_set(raw, name))
    for name in raw.cell_data:
        if not name.startswith("gmsh:") and tells_parts(raw, name):
            for k, value, chosen in _values(raw, name):
                yield made_name(name, value, raw.cell_sets), k, chosen


def _of_each(names, k, chosen) -> Iterator[tuple[str, int, np.ndarray]]:
    yield from ((name, k, chosen) for name in names.split(BOTH))


def _of_set(raw, key) -> Iterator[tuple[int, np.ndarray]]:
    for k, (block, members) in enumerate(zip(raw.cells, raw.cell_sets.get(key, ()))):
        if is_solid(block.type) and members is not None and len(members):
            chosen = np.zeros(len(block.data), dtype=bool)
            chosen[members] = True
            yield k, chosen


def _values(raw, name) -> Iterator[tuple[int, int, np.ndarray]]:
    """Number of a block of solid cells, a value of integers on them, and which cells have it."""
    for k, (block, data) in enumerate(zip(raw.cells, map(np.asarray, raw.cell_data[name]))):
        if is_solid(block.type) and data.ndim == 1 and data.dtype.kind in "iu":
            for value in np.unique(data).tolist():
                yield k, value, data == value
