"""Mesh files: read all formats of meshio, write Gmsh, VTU and PVD."""

import contextlib
import io
import os
import re
import tempfile
import warnings
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple
from xml.sax.saxutils import quoteattr

import numpy as np

from taichi_dem.kit.errors import InputError
from taichi_dem.kit.files import renamed_when_done, write_text
from taichi_dem.kit.likely_units import EDGE, in_unit
from taichi_dem.kit.validation import FileName, path_name, positive
from taichi_dem.mesh import cells
from taichi_dem.mesh.check import checked_points, unbonded_places, weld_labels
from taichi_dem.mesh.mesh import Mesh
from taichi_dem.mesh.tetrahedra import edge_lengths

_SPLIT = "split them into tetrahedra, for example by ParaView's filter Tetrahedralize"
_REMEDY = (
    "mesh in three dimensions (gmsh -3) with a physical group of the volume, or Gmsh does not "
    "save it; or fill a closed surface by taichi_dem.shapes.from_surface"
)

_ENDS = re.compile(rb"^\$((?:End)?(?:Nodes|Elements))[ \t\r]*$", re.MULTILINE)
_WHOLE = [b"Nodes", b"EndNodes", b"Elements", b"EndElements"]
_NAMES = re.compile(rb"^\$PhysicalNames\s*\n(.*?)^\$EndPhysicalNames", re.MULTILINE | re.DOTALL)
_NAME = re.compile(rb'^([ \t]*\d+[ \t]+\d+[ \t]+)("?)(.*?)\2[ \t\r]*$', re.MULTILINE)

#: Begin of a VTU file, an attribute where its arrays are compressed, what precedes their bytes, and
#: the type of its cells.
_VTU = (
    '<?xml version="1.0"?>\n<VTKFile type="UnstructuredGrid" version="1.0" '
    'byte_order="LittleEndian" header_type="UInt64"{}>\n<UnstructuredGrid>'
)
_PACKED = ' compressor="vtkZLibDataCompressor"'
_APPENDED = '</Piece>\n</UnstructuredGrid>\n<AppendedData encoding="raw">_'
_TETRAHEDRON = 10


class PhysicalName(NamedTuple):
    """A name in a file, the dimension of the cells that it names, and the number they carry."""

    dimension: int
    tag: int
    name: str


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
        Length of one unit of the file [m], such as 0.001 for mm.
    weld_tolerance : float, default 0.0
        Points not farther apart than this become one [m]; 0 welds nothing.
    keep_coincident : bool, default False
        Keep distinct points at one place apart, as at a joint or a crack.

    Notes
    -----
    Groups come from Gmsh's physical surfaces ("physical_TAG" where they have no name); in other
    formats from integer data on triangles, as "data name_value". Groups of bodies come from Gmsh's
    physical volumes; in other formats from sets of solid cells and integer data on them. Elements
    of higher order are read as linear ones. Hexahedra, prisms and pyramids are cut into tetrahedra
    after welding. Groups of points and lines are not read. A UserWarning names what may change
    results: unread points and cells, and cells that meet but share no face.
    """
    scale, path = positive("scale", scale), path_name("path", path)
    raw, printed = _read_raw(path)
    _refuse_unreadable(raw, path, printed)
    try:
        mesh = _mesh(raw, scale, weld_tolerance, keep_coincident)
    except InputError as error:
        raise InputError(f"mesh file {path}: {error}") from None
    edge = np.median(edge_lengths(mesh.points, mesh.tetrahedra))
    in_unit(f"median edge of mesh file {path} at scale={scale:g}", float(edge), EDGE)
    unread = cells.unread_groups(raw, mesh)
    words = "are not read, as they hold no triangles or solid cells"
    notes = [f"the groups {', '.join(unread)} {words}"] if unread else []
    sentences = [_of_dropped_cells(printed), unbonded_places(mesh.tetrahedra)]
    # A set of all points is a program's own, one of some was meant for something.
    sentences += (
        notes if any(len(some) < len(raw.points) for some in raw.point_sets.values()) else []
    )
    sentences = [sentence for sentence in sentences if sentence]
    for sentence in sentences:
        warnings.warn(f"mesh file {path}: {sentence}", stacklevel=2)
    notes = [*dict.fromkeys((*notes, *sentences)), *mesh.notes]
    return replace(mesh, notes=tuple(notes), source=path)


def write_mesh(path: FileName, mesh: Mesh) -> None:
    """Write a mesh with its named groups as a Gmsh 2.2 text file (exact: 17 digits)."""
    # A tetrahedron has one volume in this format: bodies in several groups get "NAME|NAME", which
    # ``read_mesh`` splits.
    names, first = list(mesh.groups), 1 + len(mesh.groups)
    volumes, tags = cells.volumes_of(mesh, first)
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
    cell_data: Mapping[str, np.ndarray],
    single: bool = False,
) -> None:
    """Write tetrahedra with data as a VTU file, for ParaView; single: see ``write_paraview``."""
    # Raw bytes behind the XML: meshio would write them as text, which takes four thirds.
    count = len(tetrahedra)
    ends = 4 * np.arange(1, count + 1, dtype=np.int32)
    types = np.full(count, _TETRAHEDRON, np.uint8)
    cells = {"connectivity": tetrahedra, "offsets": ends, "types": types}
    parts = {"Points": {"Points": points}, "Cells": cells, "CellData": cell_data}
    lines, blocks = _laid_out(parts, single)
    packing = _PACKED if single else ""
    piece = f'<Piece NumberOfPoints="{len(points)}" NumberOfCells="{count}">'
    with renamed_when_done(path) as temporary, open(temporary, "wb") as file:
        file.write("\n".join([_VTU.format(packing), piece, *lines, _APPENDED]).encode())
        file.writelines([*blocks, b"\n</AppendedData></VTKFile>\n"])


def _laid_out(parts, single):
    """Lines of XML of the arrays of a VTU file by part and name, and their bytes."""
    # The last array comes first: where offsets lie by chance as in base64, meshio reads wrong ones.
    lines: list[str] = []
    blocks: list[bytes] = []
    for part, arrays in reversed(parts.items()):
        lines.insert(0, f"</{part}>")
        for name, given in reversed(arrays.items()):
            array = np.asarray(given)
            array = array.astype(np.float32) if single and array.dtype == float else array
            lines.insert(0, _data_array(name, array, sum(map(len, blocks))))
            packed = zlib.compress(array.tobytes(), 1) if single else array.tobytes()
            # Compressed: one block of so many bytes, none that is shorter, and its length.
            sizes = [1, array.nbytes, 0, len(packed)] if single else [len(packed)]
            blocks += [np.array(sizes, np.uint64).tobytes(), packed]
        lines.insert(0, f"<{part}>")
    return lines, blocks


def _data_array(name, array, offset):
    """The element of a VTU file for an array whose bytes lie at an offset."""
    kind = {"f": "Float", "i": "Int", "u": "UInt"}[array.dtype.kind]
    columns = f' NumberOfComponents="{array.shape[1]}"' if array.ndim > 1 else ""
    return (
        f'<DataArray type="{kind}{8 * array.itemsize}" Name={quoteattr(name)}{columns} '
        f'format="appended" offset="{offset}"/>'
    )


def write_pvd(path: FileName, times_s: Sequence[float], file_names: Sequence[str]) -> None:
    """Write the list of VTU files of a time series, which ParaView opens as one."""
    sets = [
        f'    <DataSet timestep="{time!r}" part="0" file={quoteattr(str(name))}/>'
        for time, name in zip(map(float, times_s), file_names)
    ]
    head = '<VTKFile type="Collection" version="0.1" byte_order="LittleEndian">'
    lines = ['<?xml version="1.0"?>', head, "  <Collection>", *sets, "  </Collection>"]
    write_text(path, "\n".join([*lines, "</VTKFile>", ""]))


def _read_raw(path):
    """The mesh as meshio reads it, and the text that meshio printed."""
    if not os.path.isfile(path):
        raise InputError(f"mesh file {path} does not exist, or is not a file")
    said = io.StringIO()
    with tempfile.TemporaryDirectory() as folder:
        copy = os.path.join(folder, "keyed.msh")
        try:
            with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
                return _meshio_read(path, copy), said.getvalue()
        except (Exception, SystemExit) as error:  # meshio raises anything, and exits on some files
            reason = f"{type(error).__name__} {error} {said.getvalue()}".replace(copy, path)
            words = " ".join(reason.split())
            raise InputError(f"mesh file {path} cannot be read: {words}") from None


def _meshio_read(path, copy):
    import meshio

    with np.errstate(over="ignore"):  # an STL's text, tried as if it were binary
        if path.lower().endswith(".msh"):
            return _read_gmsh(path, copy)
        return _keyed_by_dimension(meshio.read(path), [])


def _read_gmsh(path, place):
    """A Gmsh file of meshio's with groups by PhysicalName; InputError for a bad one."""
    # Of faces and bodies with one group name meshio loses the faces, and it reads some letters as
    # escapes: it gets a copy with unique names.
    import meshio

    with open(path, "rb") as file:
        content = file.read()
    _refuse_bad_gmsh(content)
    names: list[str] = []

    def keyed(row):
        names.append(row[3].decode("utf-8"))
        return row[1] + str(len(names) - 1).encode()

    copy = _NAMES.sub(lambda section: _NAME.sub(keyed, section[0]), content, count=1)
    with open(place, "wb") as other:
        other.write(copy)
    return _keyed_by_dimension(meshio.read(place), names)


def _refuse_bad_gmsh(content):
    """Refuse a Gmsh file of which meshio would make another mesh: damaged, or cut off."""
    # Meshio would read a truncated file as a smaller mesh, and count points below 1 from the end.
    if not content.startswith(b"$MeshFormat"):
        return
    marks = list(_ENDS.finditer(content))
    if [mark[1] for mark in marks] != _WHOLE:
        raise InputError("it must have one whole section $Nodes, then $Elements; it may be cut off")
    version, kind = content[:200].split()[1:3]
    if kind == b"1" or version not in (b"2", b"2.2", b"4", b"4.1"):
        return
    nodes, elements = (
        [line.split() for line in content[start.end() : end.start()].splitlines()[1:]]
        for start, end in zip(marks[::2], marks[1::2])
    )
    try:
        numbers = _numbers_2 if version.startswith(b"2") else _numbers_4
        points, corners = (np.array(found, dtype=np.int64) for found in numbers(nodes, elements))
    except (ValueError, IndexError, OverflowError):
        raise InputError("its sections must hold as many whole numbers as they announce") from None
    if points.min() < 1 or corners.min() < 1 or len(np.unique(points)) < len(points):
        raise InputError("its points must have different numbers from 1 on")


def _numbers_2(nodes, elements):
    """Numbers of points and of corners in version 2.2, where each row says how many tags it has."""
    sizes: dict[bytes, int] = {}
    corners: list[bytes] = []
    for _, kind, tags, *rest in elements[1:]:
        own = rest[int(tags) :]
        _require(int(tags) >= 0 and len(own) == sizes.setdefault(kind, len(own)))
        corners += own
    _require(all(int(rows[0][0]) == len(rows) - 1 for rows in (nodes, elements)))
    _require(all(len(row) == 4 for row in nodes[1:]))
    return [row[0] for row in nodes[1:]], corners


def _numbers_4(nodes, elements):
    """The same in version 4.1, where rows of four numbers head blocks; these are positive too."""
    for rows, each in ((nodes, 2), (elements, 1)):
        blocks, count = map(int, rows[0][:2])
        _require(len(rows) == 1 + blocks + each * count)
    points = [row[0] for row in nodes if len(row) == 1]
    _require(len(points) == int(nodes[0][1]))
    return points, [number for row in elements for number in row[1:]]


def _require(right):
    if not right:
        raise ValueError


def _keyed_by_dimension(raw, names):
    """A file of meshio's with groups by PhysicalName; names: the true ones, by their numbers."""
    keys = {
        key: PhysicalName(int(value[1]), int(value[0]), names[int(key)] if names else key)
        for key, value in raw.field_data.items()
        if np.shape(value) == (2,)
    }
    raw.field_data = {keys[key]: raw.field_data[key] for key in keys}
    raw.cell_sets = {keys.get(key, key): members for key, members in raw.cell_sets.items()}
    return raw


def _of_dropped_cells(printed):
    """A sentence about cells that meshio ignores, or ""; printed: its message."""
    if "cells that meshio cannot handle" not in " ".join(printed.split()):
        return ""
    unknown = "it holds cells of a type that meshio does not know, such as voxels"
    return f"{unknown}, and these are not read: {_SPLIT}"


def _refuse_unreadable(raw, path, printed):
    """Refuse solid cells that cannot be cut, which would leave holes, and files without any."""
    held = {block.type: block.dim for block in raw.cells if len(block.data)}
    others = sorted(kind for kind in held if held[kind] == 3 and not cells.shape_of(kind))
    if others:
        raise InputError(
            f"mesh file {path} holds {', '.join(others)} cells, which cannot be read: {_SPLIT}"
        )
    if not cells.blocks_of(raw, 3):
        remedy = _of_dropped_cells(printed) or _REMEDY
        kinds = ", ".join(sorted(held)) or "no cells"
        raise InputError(f"mesh file {path} holds no tetrahedra (it holds: {kinds}): {remedy}")


def _mesh(raw, scale, weld_tolerance, keep_coincident):
    """The mesh of a file's cells, cut once their points are welded; raw gets the welded numbers."""
    with np.errstate(over="ignore"):  # numbers that are not finite are refused
        points = checked_points(scale * np.asarray(raw.points, dtype=np.float64))
    welding: list[str] = []
    bodies = cells.bodies_in(raw, points)
    label = weld_labels(points, bodies.tetrahedra, weld_tolerance, welding)
    if welding:
        for _, block in (*cells.blocks_of(raw, 2), *cells.blocks_of(raw, 3)):
            corners = cells.corners_of(block, len(points))
            block.data = np.hstack([label[corners], block.data[:, corners.shape[1] :]])
        bodies = cells.bodies_in(raw, points)
    kept = {"keep_coincident": keep_coincident, "body_groups": cells.body_groups_in(raw, bodies)}
    arrays = points, bodies.tetrahedra, cells.face_groups_in(raw)
    return Mesh(*arrays, notes=tuple(welding), **kept)
