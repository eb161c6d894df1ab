"""Report of contents of a mesh file beside tetrahedra and groups of faces; meshes as meshio's."""

import os
import re
import shlex
from collections.abc import Sequence
from typing import Any, NoReturn

import numpy as np

from taichi_dem.kit.errors import InputError
from taichi_dem.mesh.gmsh_names import physical_names
from taichi_dem.mesh.split import shape_of

#: Name of a group that is not read, and the kind of its members.
Unread = tuple[str, str]

#: Gmsh's groups by their dimension.
_KINDS = {0: "points", 1: "lines"}
_SPLIT = "split them into tetrahedra, for example by ParaView's filter Tetrahedralize"
_UNKNOWN = "holds cells of a type that meshio does not know, such as voxels"
#: What Gmsh's remedy below calls a file whose name a shell or Gmsh would take for more than a name.
_PLAIN = "surface.stl"
#: Kind of an Abaqus surface among the unread groups.
_SURFACE = "element sides"
_NEEDED = (
    "loads and supports need groups of faces (physical surfaces in Gmsh), materials groups of "
    "solid cells"
)
#: Of a script that does not end with a new line Gmsh leaves out the last: echo adds one.
_FILL = (
    "fill this surface, if it is closed, with tetrahedra, for example by Gmsh (pip install gmsh): "
    "{saved}echo 'Merge \"{name}\"; Surface Loop(1) = Surface{{:}}; Volume(1) = {{1}};' > fill.geo "
    "&& gmsh -3 fill.geo -o filled.msh"
)
_IN_A_GROUP = (
    "mesh in three dimensions (gmsh -3), and make a physical group of the volume too, as Gmsh "
    "saves only what is in a group"
)


def refuse_without_tetrahedra(raw: Any, path: str, printed: str = "") -> NoReturn:
    """Raise InputError for a file that has no tetrahedra, with a remedy.

    printed: what the reader wrote to the terminal.
    """
    if cells_dropped(printed):
        raise InputError(f"mesh file {path} {_UNKNOWN}, which cannot be read: {_SPLIT}")
    kinds = ", ".join(_held(raw)) or "no cells"
    remedy = _remedy(raw, path)
    raise InputError(f"mesh file {path} holds no tetrahedra (it holds: {kinds}){remedy}")


def _remedy(raw, path):
    dimension = max((block.dim for block in raw.cells if len(block.data)), default=0)
    name = os.path.basename(path)
    if dimension == 2 and "gmsh:physical" in raw.cell_data:
        return f": {_IN_A_GROUP}"
    if dimension == 2:
        saved, name = _as_stl(name)
        return f": {_FILL.format(saved=saved, name=name)}"
    return ": mesh the volume with tetrahedra"


def _as_stl(name):
    """First step of the remedy, and the name of the STL then: one that needs no quotes anywhere."""
    if not name.lower().endswith(".stl") or not name.isprintable():
        return f"save it as {_PLAIN}, ", _PLAIN
    if re.fullmatch(r"\w[\w.-]*", name):
        return "", name
    return f"cp -- {shlex.quote(name)} {_PLAIN} && ", _PLAIN


def cells_counted(count: int, kind: str) -> str:
    """A number of cells in words: "1 hexahedron", "8 hexahedra", "3 wedge15 cells"."""
    plurals = {"hexahedron": "hexahedra", "wedge": "wedges", "pyramid": "pyramids"}
    if count == 1 or kind not in plurals:
        return f"{count} {kind}{'' if kind in plurals else ' cells'}"
    return f"{count} {plurals[kind]}"


def cells_dropped(printed: str) -> str:
    """A sentence about cells that meshio ignores, or ""; printed: its message."""
    if "cells that meshio cannot handle" not in " ".join(printed.split()):
        return ""
    return f"it {_UNKNOWN}, and these are not read: {_SPLIT}"


def reason_of(error: BaseException, printed: str) -> str:
    """Why a reader failed, in words: an exception may hold a number only.

    printed: what the reader wrote to the terminal, where meshio explains itself before it exits.
    """
    text = " ".join(str(error).split())
    if isinstance(error, SystemExit):
        text = " ".join(printed.replace("Error: ", "").split())
    if cells_dropped(text):
        return f"it {_UNKNOWN}: {_SPLIT}"
    named = text if re.search(r"[^\W\d]", text) else f"{type(error).__name__} {text}"
    return named.strip()


def refuse_uncut(raw: Any, path: str) -> None:
    """Raise InputError for solid cells that cannot be cut: dropped, they would leave holes."""
    others = _held(raw, lambda block: block.dim == 3 and not is_solid(block.type))
    if others:
        raise InputError(
            f"mesh file {path} holds {', '.join(others)} cells, which cannot be read: {_SPLIT}"
        )


def is_solid(kind: str) -> bool:
    """Whether a cell type of meshio is a tetrahedron or can be cut into some."""
    return is_tetrahedron(kind) or shape_of(kind) is not None


def is_tetrahedron(kind: str) -> bool:
    """Whether a cell type of meshio is a tetrahedron of any order."""
    return kind.startswith("tetra") or kind == "VTK_LAGRANGE_TETRAHEDRON"


def is_triangle(kind: str) -> bool:
    """Whether a cell type of meshio is a triangle of any order."""
    return kind.startswith("triangle") or kind == "VTK_LAGRANGE_TRIANGLE"


def is_quadrangle(kind: str) -> bool:
    """Whether a cell type of meshio is a quadrangle of any order."""
    return kind.startswith("quad") or kind == "VTK_LAGRANGE_QUADRILATERAL"


def unread_groups(raw: Any) -> tuple[Unread, ...]:
    """Groups that are not of faces, as pairs of name and kind of member."""
    names = {dimension: physical_names(raw, dimension) for dimension in _KINDS}
    found = []
    for block, tags in zip(raw.cells, raw.cell_data.get("gmsh:physical", ())):
        if block.dim in _KINDS:
            for tag in np.unique(tags[tags > 0]).tolist():
                name = names[block.dim].get(tag, f"physical_{tag}")
                found.append((name, _KINDS[block.dim]))
    known = {*raw.field_data, "gmsh:bounding_entities"}
    sets = (name for name in raw.cell_sets if name not in known)
    found += [(name, "elements") for name in sets if not _has_solid_members(raw, name)]
    found += [(name, "points") for name in raw.point_sets]
    return tuple(dict.fromkeys(found))


def surfaces_of_abaqus(path: str) -> tuple[Unread, ...]:
    """Surfaces of an Abaqus file, which meshio passes over, pairs as in ``unread_groups``."""
    if not path.lower().endswith(".inp"):
        return ()
    with open(path, encoding="utf-8", errors="replace") as file:
        heads = [line for line in file if re.match(r"\*surface\s*(,|$)", line, re.IGNORECASE)]
    names = (re.search(r",\s*name\s*=\s*\"?([^,\"\n]+)", line, re.IGNORECASE) for line in heads)
    return tuple(dict.fromkeys((name[1].strip(), _SURFACE) for name in names if name))


def parts_dropped(raw: Any, groups: Sequence[Unread]) -> list[str]:
    """Sentences about unread contents that may change a result; groups: from ``unread_groups``."""
    sets = [f"{name} (of {kind})" for name, kind in groups if _is_partial_set(raw, name, kind)]
    return [f"the sets {', '.join(sets)} are not read: {_NEEDED}"] if sets else []


def others_dropped(raw: Any, groups: Sequence[Unread]) -> list[str]:
    """Sentences about groups that are not read and seldom matter; groups: ``unread_groups``."""
    others = [
        f"{name} (of {kind})" for name, kind in groups if not _is_partial_set(raw, name, kind)
    ]
    words = "only groups of faces and of solid cells are read, not"
    return [f"{words} {', '.join(others)}"] if others else []


def _is_partial_set(raw, name, kind):
    """Whether a group is a set of a part of the elements or points, or a surface; not Gmsh's."""
    if "gmsh:physical" in raw.cell_data or kind == _SURFACE:
        return kind == _SURFACE
    if name in raw.point_sets and kind == "points":
        return len(raw.point_sets[name]) < len(raw.points)
    return False


def _has_solid_members(raw, name):
    """Whether a set of cells holds solid ones, which become a group of bodies."""
    members = zip(raw.cells, raw.cell_sets[name])
    return any(held is not None and len(held) and is_solid(block.type) for block, held in members)


def tells_parts(raw: Any, name: str) -> bool:
    """Whether solid cells carry different whole numbers of a name, as they do for materials.

    Numbers of which each cell has its own are numbers of the cells, not of materials.
    """
    values = [
        data
        for block, data in zip(raw.cells, map(np.asarray, raw.cell_data[name]))
        if is_solid(block.type) and data.dtype.kind in "iu" and data.ndim == 1
    ]
    all_values = np.concatenate([[], *values])
    return 1 < len(np.unique(all_values)) < max(len(all_values), 3)


def _held(raw, wanted=lambda block: True):
    """Types of the cells that a file holds, sorted."""
    return sorted({block.type for block in raw.cells if len(block.data) and wanted(block)})
