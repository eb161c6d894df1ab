"""Mesh files: read all that meshio can, write Gmsh, VTU and PVD; the only importer of meshio."""

import contextlib
import io
import os
import warnings
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Optional
from xml.sax.saxutils import quoteattr

import meshio
import numpy as np

from taichi_dem.kit.errors import InputError
from taichi_dem.kit.files import renamed_when_done, write_text
from taichi_dem.kit.likely_units import EDGE, in_unit
from taichi_dem.kit.timeout import run_with_timeout
from taichi_dem.kit.validation import FileName, path_name, positive
from taichi_dem.mesh.cell_groups import body_groups_of, volumes_of
from taichi_dem.mesh.content import (
    cells_counted,
    cells_dropped,
    is_quadrangle,
    is_solid,
    is_tetrahedron,
    is_triangle,
    others_dropped,
    parts_dropped,
    reason_of,
    refuse_uncut,
    refuse_without_tetrahedra,
    surfaces_of_abaqus,
    unread_groups,
)
from taichi_dem.mesh.gmsh_check import refuse_bad_gmsh
from taichi_dem.mesh.gmsh_names import keyed_by_dimension, made_name, physical_names, with_own_keys
from taichi_dem.mesh.mesh import Mesh, checked_mesh, welded_numbers
from taichi_dem.mesh.parts_in_files import unbonded_places
from taichi_dem.mesh.split import folded_or_flat, shape_of, tetrahedra_in, triangles_in
from taichi_dem.mesh.tetrahedra import edge_lengths

#: Time that a reader may take [s], and what it reads at the slowest [byte/s]: some of meshio's wait
#: for ever for the rest of a file that was cut off.
_PATIENCE_S = 20.0
_SLOWEST_BYTES_PER_S = 1e5


def read_mesh(
    path: FileName,
    *,
    scale: float = 1.0,
    weld_tolerance: float = 0.0,
    keep_coincident: bool = False,
) -> Mesh:
    """Read solid cells and named face groups from a file (Gmsh 2.2 or 4.1, VTK, VTU, ...).

    Parameters
    ----------
    path : path
        File that meshio reads.
    scale : float, default 1.0
        Length of one unit of the file [m], such as 0.001 for a drawing in mm.
    weld_tolerance : float, default 0.0
        Points not farther apart than this become one [m]; 0 welds nothing.
    keep_coincident : bool, default False
        Accept distinct points at one place, and leave the faces on them unbonded, as at a joint or
        a crack (see ``checked_mesh``).

    Returns
    -------
    Mesh
        The checked mesh; ``notes`` tells what was mended or not read.

    Raises
    ------
    InputError
        The file is missing, cannot be read, or holds no solid cells or cells that cannot be cut; or
        ``checked_mesh`` refuses its mesh.

    Notes
    -----
    Groups come from Gmsh's physical surfaces ("physical_TAG" where they have no name); in other
    formats from integer data on triangles, as "data name_value". Groups of bodies come from Gmsh's
    physical volumes; in other formats from sets of solid cells and integer data on them. Elements
    of higher order are read as linear ones. Hexahedra, prisms and pyramids are cut into tetrahedra
    after welding. Groups of points and lines are not read. A UserWarning tells of what may change
    results: Abaqus sets and surfaces that are not read, cells of types that meshio does not know,
    and cells that meet but share no face.

    Examples
    --------
    >>> read_mesh(PAPER_BLOCK).body_count
    966
    """
    scale, path = positive("scale", scale), path_name("path", path)
    raw, printed = _read_raw(path)
    refuse_uncut(raw, path)
    if not any(is_solid(block.type) and len(block.data) for block in raw.cells):
        refuse_without_tetrahedra(raw, path, printed)
    unread = (*unread_groups(raw), *surfaces_of_abaqus(path))
    try:
        mesh = _mesh(raw, scale, weld_tolerance, keep_coincident)
    except InputError as error:
        cells = _cell_at_fault(raw) if "tetrahedra " in str(error) else ""
        raise InputError(f"mesh file {path}: {error}{cells}") from None
    edge = np.median(edge_lengths(mesh.points, mesh.tetrahedra))
    in_unit(f"median edge of mesh file {path} at scale={scale:g}", float(edge), EDGE)
    told = [cells_dropped(printed), *parts_dropped(raw, unread)]
    told.append(unbonded_places(mesh.points, mesh.tetrahedra))
    told = [sentence for sentence in told if sentence]
    for sentence in told:
        warnings.warn(f"mesh file {path}: {sentence}", stacklevel=2)
    notes = (*others_dropped(raw, unread), *told, *mesh.notes)
    return replace(mesh, notes=notes, source=path, unread=unread)


def write_mesh(path: FileName, mesh: Mesh) -> None:
    """Write a mesh with its named groups as a Gmsh 2.2 text file (exact: 17 digits).

    Body groups become physical volumes. As a tetrahedron has one volume in this format, bodies in
    several groups are in the volume "NAME|NAME", which ``read_mesh`` takes for both.
    """
    names, first = list(mesh.groups), 1 + len(mesh.groups)
    volumes, tags = volumes_of(mesh, first)
    lines = ["$MeshFormat", "2.2 0 8", "$EndMeshFormat", "$PhysicalNames"]
    lines += [str(len(names) + len(volumes))]
    lines += [f'2 {tag} "{name}"' for tag, name in enumerate(names, start=1)]
    lines += [f'3 {tag} "{name}"' for tag, name in enumerate(volumes, start=first)]
    lines += ["$EndPhysicalNames", "$Nodes", str(len(mesh.points))]
    lines += [f"{k} {x:.17g} {y:.17g} {z:.17g}" for k, (x, y, z) in enumerate(mesh.points, 1)]
    elements = [(2, tag, face) for tag, name in enumerate(names, 1) for face in mesh.groups[name]]
    elements += [(4, tag, corners) for tag, corners in zip(tags.tolist(), mesh.tetrahedra)]
    lines += ["$EndNodes", "$Elements", str(len(elements))]
    for number, (kind, tag, corners) in enumerate(elements, start=1):
        lines.append(f"{number} {kind} 2 {tag} {tag} " + " ".join(str(c + 1) for c in corners))
    write_text(path, "\n".join([*lines, "$EndElements", ""]))


def write_vtu(
    path: FileName,
    points: np.ndarray,
    tetrahedra: np.ndarray,
    point_data: Optional[Mapping[str, np.ndarray]] = None,
    cell_data: Optional[Mapping[str, np.ndarray]] = None,
) -> None:
    """Write tetrahedra with data as a compressed VTU file, for ParaView.

    point_data: name -> (point_count, ...).  cell_data: name -> (body_count, ...).
    """
    of_cells = {name: [np.asarray(values)] for name, values in (cell_data or {}).items()}
    content = meshio.Mesh(points, [("tetra", tetrahedra)], point_data or {}, of_cells)
    with renamed_when_done(path) as temporary:
        meshio.write(temporary, content, file_format="vtu", compression="zlib")


def write_pvd(path: FileName, times_s: Sequence[float], file_names: Sequence[str]) -> None:
    """Write the list of VTU files of a time series, which ParaView opens as one.

    times_s: time of each file [s].  file_names: relative to the folder of ``path``.
    """
    if len(times_s) != len(file_names):
        raise InputError(f"{path}: {len(times_s)} times, but {len(file_names)} file names")
    sets = [
        f'    <DataSet timestep="{time!r}" part="0" file={quoteattr(str(name))}/>'
        for time, name in zip(map(float, times_s), file_names)
    ]
    head = '<VTKFile type="Collection" version="0.1" byte_order="LittleEndian">'
    lines = ['<?xml version="1.0"?>', head, "  <Collection>", *sets, "  </Collection>"]
    write_text(path, "\n".join([*lines, "</VTKFile>", ""]))


def _read_raw(path):
    """The mesh as meshio reads it, and the text that meshio printed.

    Whatever goes wrong inside becomes one InputError.
    """
    if not os.path.isfile(path):
        problem = "is no file" if os.path.lexists(path) else "does not exist"
        problem = "is a folder" if os.path.isdir(path) else problem
        raise InputError(f"mesh file {path} {problem}")
    _refuse_if_gmsh(path)
    said = io.StringIO()
    seconds = _PATIENCE_S + os.path.getsize(path) / _SLOWEST_BYTES_PER_S
    sentence = f"its reader found no end in {seconds:.3g} s, as in a file that was cut off"
    try:
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
            return run_with_timeout(seconds, lambda: _meshio_read(path), sentence), said.getvalue()
    except (Exception, SystemExit) as error:  # meshio raises anything, and exits on some files
        reason = reason_of(error, said.getvalue())
        raise InputError(f"mesh file {path} cannot be read: {reason}") from None


def _refuse_if_gmsh(path):
    """Check a Gmsh file before it is read."""
    if path.lower().endswith(".msh"):
        try:
            refuse_bad_gmsh(path)
        except OSError as error:
            reason = error.strerror or error
            raise InputError(f"mesh file {path} cannot be read: {reason}") from None


def _meshio_read(path):
    with np.errstate(over="ignore"):  # an STL's text, tried as if it were binary
        if not path.lower().endswith(".msh"):
            return keyed_by_dimension(meshio.read(path), {})
        with with_own_keys(path) as (copy, names):
            return keyed_by_dimension(meshio.read(copy), names)


def _mesh(raw, scale, weld_tolerance, keep_coincident):
    """The mesh of a file's cells, cut once their points are welded; raw gets the welded numbers."""
    notes: list[str] = []
    welding: list[str] = []
    with np.errstate(over="ignore"):  # checked_mesh refuses numbers that are not finite
        points = scale * np.asarray(raw.points, dtype=np.float64)
    tetrahedra = _tetrahedra(raw, notes)
    label = welded_numbers(points, tetrahedra, weld_tolerance, welding)
    if welding:
        _renumber(raw, label)
        notes.clear()
        tetrahedra = _tetrahedra(raw, notes)
    kept = {"keep_coincident": keep_coincident}
    mesh = checked_mesh(points, tetrahedra, _groups(raw), **kept)
    bodies = body_groups_of(raw)
    if len(bodies) > 1:
        notes.append(f"bodies are in the groups {', '.join(bodies)}, for materials of their own")
    return replace(mesh, body_groups=bodies, notes=(*notes, *welding, *mesh.notes))


def _renumber(raw, label):
    """Renumber the points of solid cells and faces, label (n,) by the old numbers.

    Numbers of no point stay, to be refused later.
    """
    for block in raw.cells:
        if len(block.data) and (is_solid(block.type) or _is_face(block.type)):
            data = np.asarray(block.data)
            known = (data >= 0) & (data < len(label))
            block.data = np.where(known, label[np.where(known, data, 0)], data)


def _cell_at_fault(raw):
    """Meaning of an error for the file's cells, where some have been cut; else ""."""
    cut = [block for block in raw.cells if len(block.data) and shape_of(block.type)]
    finite = np.isfinite(raw.points).all() and np.shape(raw.points)[1:] == (3,)
    for block in cut if finite else ():
        if (block.data >= 0).all() and (block.data < len(raw.points)).all():
            sentence = folded_or_flat(raw.points, block.type, block.data)
            if sentence:
                return f"; these are tetrahedra that cells were cut into: {sentence}"
    return "; tetrahedra are numbered after cells have been cut" if cut else ""


def _tetrahedra(raw, notes):
    """Corner points of all tetrahedra, (n, 4), those that other cells are cut into last."""
    found, cut = [np.empty((0, 4), dtype=np.int64)], []
    for block in (block for block in raw.cells if len(block.data)):
        if is_tetrahedron(block.type):
            found.append(block.data[:, :4])
            if block.data.shape[1] > 4:
                order = "second" if block.data.shape[1] == 10 else "higher"
                notes.append(
                    f"read {len(block.data)} {order}-order elements as linear {block.type}"
                )
        elif shape_of(block.type):
            cut.append(tetrahedra_in(raw.points, block.type, block.data))
            cells = cells_counted(len(block.data), block.type)
            notes.append(f"cut {cells} into {len(cut[-1])} tetrahedra")
    return np.vstack([*found, *cut])


def _groups(raw):
    """Named groups of triangles, name -> (n, 3)."""
    found = defaultdict(list)
    if "gmsh:physical" in raw.cell_data:
        names = physical_names(raw, 2)
        for faces, value in _labelled(raw, raw.cell_data["gmsh:physical"]):
            if value > 0:  # 0: in no physical group
                name = names.get(value) or made_name("physical", value, names.values())
                found[name].append(faces)
        # A surface in two groups: Gmsh 4.1 keeps one number a face, but the sets know of both.
        found.update(_sets(raw))
    else:
        for key in raw.cell_data:
            if not key.startswith("gmsh:"):  # numbers of drawn entities, no choice of the user
                for faces, value in _labelled(raw, raw.cell_data[key]):
                    found[f"{key}_{value}"].append(faces)
    return {name: np.vstack(faces) for name, faces in found.items()}


def _labelled(raw, data):
    """Triangles that carry one integer value, as (faces (n, 3), value), for every value."""
    for block, values in zip(raw.cells, map(np.asarray, data)):
        if _is_face(block.type) and values.ndim == 1 and values.dtype.kind in "iu":
            for value in np.unique(values):
                yield _corners(block, values == value), value


def _sets(raw):
    """Triangles of the sets of physical surfaces, name -> list of (n, 3)."""
    found = defaultdict(list)
    for key in raw.field_data:
        for block, members in zip(raw.cells, raw.cell_sets.get(key, ())):
            if _is_face(block.type) and members is not None and len(members):
                found[key.name].append(_corners(block, members))
    return found


def _is_face(kind):
    return is_triangle(kind) or is_quadrangle(kind)


def _corners(block, members):
    """Triangles of some faces of a block, (n, 3); quadrangles as ``tetrahedra_in`` cuts them."""
    return triangles_in(block.data[members, : 3 if is_triangle(block.type) else 4])
