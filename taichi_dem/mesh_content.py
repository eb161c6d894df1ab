"""What a mesh file holds beside tetrahedra and groups of faces, in words; meshes as meshio's."""

import os

import numpy as np

from taichi_dem.errors import InputError
from taichi_dem.mesh_split import shape_of

#: Gmsh's groups by their dimension.
_KINDS = {0: "points", 1: "lines", 3: "volumes"}
_SPLIT = "split them into tetrahedra, for example by ParaView's filter Tetrahedralize"
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


def refuse_without_tetrahedra(raw, path):
    """Raise InputError for a file that has no tetrahedra, with what to do about it."""
    kinds = ", ".join(_held(raw)) or "no cells"
    remedy = _remedy(raw, path)
    raise InputError(f"mesh file {path} holds no tetrahedra (it holds: {kinds}){remedy}")


def _remedy(raw, path):
    dimension = max((block.dim for block in raw.cells if len(block.data)), default=0)
    name = os.path.basename(path)
    if dimension == 2 and "gmsh:physical" in raw.cell_data:
        return f": {_IN_A_GROUP}"
    if dimension == 2:
        readable = name.lower().endswith(".stl")
        saved = "" if readable else "save it as surface.stl, "
        return f": {_FILL.format(saved=saved, name=name if readable else 'surface.stl')}"
    return ": mesh the volume with tetrahedra"


def refuse_uncut(raw, path):
    """Raise InputError for solid cells that cannot be cut: dropped, they would leave holes."""
    others = _held(raw, lambda block: block.dim == 3 and not is_solid(block.type))
    if others:
        raise InputError(
            f"mesh file {path} holds {', '.join(others)} cells, which cannot be read: {_SPLIT}"
        )


def is_solid(kind):
    """Whether a cell type of meshio is a tetrahedron or can be cut into some."""
    return is_tetrahedron(kind) or shape_of(kind) is not None


def is_tetrahedron(kind):
    """Whether a cell type of meshio is a tetrahedron of any order."""
    return kind.startswith("tetra") or kind == "VTK_LAGRANGE_TETRAHEDRON"


def is_triangle(kind):
    """Whether a cell type of meshio is a triangle of any order."""
    return kind.startswith("triangle") or kind == "VTK_LAGRANGE_TRIANGLE"


def is_quadrangle(kind):
    """Whether a cell type of meshio is a quadrangle of any order."""
    return kind.startswith("quad") or kind == "VTK_LAGRANGE_QUADRILATERAL"


def unread_groups(raw):
    """Groups that are not of faces, as pairs of name and what they are of."""
    names = {(int(tag), int(dimension)): name for name, (tag, dimension) in raw.field_data.items()}
    found = []
    for block, tags in zip(raw.cells, raw.cell_data.get("gmsh:physical", ())):
        if block.dim in _KINDS:
            for tag in np.unique(tags[tags > 0]).tolist():
                found.append((names.get((tag, block.dim), f"physical_{tag}"), _KINDS[block.dim]))
    known = {*raw.field_data, "gmsh:bounding_entities"}
    found += [(name, "elements") for name in raw.cell_sets if name not in known]
    found += [(name, "points") for name in raw.point_sets]
    return tuple(dict.fromkeys(found))


def volumes_dropped(groups):
    """A sentence about several groups of volumes, or None; groups: from ``unread_groups``.

    One group says nothing that the tetrahedra do not say.
    """
    names = [name for name, kind in groups if kind == "volumes"]
    if len(names) < 2:
        return None
    return (
        f"the groups of volumes {', '.join(names)} are not read: one material fills the whole mesh"
    )


def others_dropped(raw, groups):
    """Sentences about groups and numbers that are not read and may have been meant."""
    sentences = []
    others = [f"{name} (of {kind})" for name, kind in groups if kind != "volumes"]
    if others:
        sentences.append(f"only groups of faces are read, not {', '.join(others)}")
    numbers = [name for name in raw.cell_data if _differs(raw, name)]
    if numbers:
        sentences.append(f"numbers on tetrahedra are not read: {', '.join(numbers)}")
    return sentences


def _differs(raw, name):
    """Whether tetrahedra carry different whole numbers of a name, as they do for materials."""
    values = [
        np.unique(data)
        for block, data in zip(raw.cells, raw.cell_data[name])
        if is_solid(block.type) and np.asarray(data).dtype.kind in "iu"
    ]
    return not name.startswith("gmsh:") and len(set(np.concatenate([[], *values]).tolist())) > 1


def _held(raw, wanted=lambda block: True):
    """Types of the cells that a file holds, sorted."""
    return sorted({block.type for block in raw.cells if len(block.data) and wanted(block)})
