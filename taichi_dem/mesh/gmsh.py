"""Drawn solids filled by Gmsh; the only importer of gmsh."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator
from typing import Any

import numpy as np

from taichi_dem.kit.errors import InputError
from taichi_dem.kit.fixed_order import dot
from taichi_dem.kit.validation import FileName, path_name, positive, told_apart
from taichi_dem.mesh import tetrahedra as geometry
from taichi_dem.mesh.mesh import Mesh

#: Options that could make two runs of the same Gmsh differ, or change the elements.
_OPTIONS = {
    "General.Terminal": 0,
    "General.NumThreads": 1,
    "Mesh.MaxNumThreads1D": 1,
    "Mesh.MaxNumThreads2D": 1,
    "Mesh.MaxNumThreads3D": 1,
    "Mesh.RandomSeed": 1,
    "Mesh.Algorithm": 6,
    "Mesh.Algorithm3D": 1,
    "Mesh.Optimize": 1,
    "Mesh.OptimizeNetgen": 1,
    "Mesh.MeshSizeFromPoints": 0,
    "Mesh.MeshSizeFromCurvature": 0,
    "Mesh.MeshSizeExtendFromBoundary": 0,
    "Mesh.MshFileVersion": 4.1,
    "Mesh.Binary": 0,
}
#: Angle between triangles of an STL from which on an edge parts two surfaces [degrees].
_EDGE_DEG = 40.0
#: Most elements of a mesh: ten million tetrahedra take some ten GiB to check.
_MOST_BODIES = 10_000_000
#: Tetrahedra in a cube of an element; Gmsh makes 8.5.
_PER_CUBE = 8.7
#: Endings of files, by how they are read.
_DRAWN, _TRIANGLES = (".step", ".stp"), (".stl",)


@contextlib.contextmanager
def session(name: str) -> Iterator[Any]:
    """A Gmsh model of our own, removed afterwards; a session of the caller stays open."""
    try:
        import gmsh
    except (ImportError, OSError) as error:
        raise InputError(
            f"making this mesh needs gmsh ({error}): pip install gmsh, or run make mesh"
        ) from None
    owned = not gmsh.isInitialized()
    if owned:
        gmsh.initialize(interruptible=False, readConfigFiles=False)
    gmsh.model.add(name)
    try:
        for name, value in _OPTIONS.items():
            gmsh.option.setNumber(name, value)
        yield gmsh
    except InputError:
        raise
    except Exception as error:  # gmsh knows no other class
        raise InputError(f"gmsh failed: {error}") from None
    finally:
        gmsh.model.remove()
        if owned:
            gmsh.finalize()


def prism(occ: Any, ring: Any, direction: Any) -> tuple[int, int]:
    """The volume, as (3, tag), of a polygon (n, 3) that is drawn out along a way (3,)."""
    points = [occ.addPoint(*place) for place in ring]
    lines = [occ.addLine(*pair) for pair in zip(points, points[1:] + points[:1])]
    base = occ.addPlaneSurface([occ.addCurveLoop(lines)])
    return next(entity for entity in occ.extrude([(2, base)], *direction) if entity[0] == 3)


def filled_surface(path: FileName, element: float, scale: float = 1.0) -> Mesh:
    """The solid inside a drawn surface, see ``shapes.from_surface``."""
    name = path_name("path", path)
    element, scale = positive("element", element), positive("scale", scale)
    if not name.lower().endswith((*_DRAWN, *_TRIANGLES)):
        raise InputError(f"path must end in .stl, .step or .stp, got {name}")
    if not os.path.isfile(name):
        raise InputError(f"surface file {name} does not exist")
    with session("filled") as gmsh:
        drawn = name.lower().endswith(_DRAWN)
        if drawn:
            gmsh.option.setString("Geometry.OCCTargetUnit", "M")
            gmsh.option.setNumber("Geometry.OCCImportLabels", 1)
            gmsh.model.occ.importShapes(name)
            gmsh.model.occ.synchronize()
        else:
            _draw_triangles(gmsh, name)
        refuse_too_many(element, _drawn_volume(gmsh, drawn) * scale**3)
        gmsh.option.setNumber("Mesh.MeshSizeMin", element / scale)
        gmsh.option.setNumber("Mesh.MeshSizeMax", element / scale)
        gmsh.model.mesh.generate(3)
        return _mesh_of(gmsh, scale, name, drawn)


def _drawn_volume(gmsh, drawn):
    """Volume inside the surface, in units of the file."""
    if drawn:
        return sum(gmsh.model.occ.getMass(3, tag) for _, tag in gmsh.model.getEntities(3))
    points, triangles = places_and_rows(gmsh, 2)
    corners = points[triangles]
    return abs(float(np.linalg.det(corners - corners[:1, :1]).sum())) / 6.0


def refuse_too_many(element: float, volume: float) -> None:
    """Raise InputError for more tetrahedra in a volume [m3] than there is memory for."""
    least = (_PER_CUBE * volume / _MOST_BODIES) ** (1.0 / 3.0)
    if element < least:
        got, bound = told_apart(element, least)
        raise InputError(
            f"element must be at least {bound} m, to make at most {_MOST_BODIES} tetrahedra in "
            f"{volume:.3g} m3, got {got}"
        )


def _draw_triangles(gmsh: Any, name: str) -> None:
    """Read triangles, part them at their edges, and make a volume of what they enclose."""
    gmsh.merge(name)
    gmsh.model.mesh.removeDuplicateNodes()
    angle = np.radians(_EDGE_DEG)
    gmsh.model.mesh.classifySurfaces(angle, True, True, np.pi)
    gmsh.model.mesh.createGeometry()
    surfaces = [tag for _, tag in gmsh.model.getEntities(2)]
    gmsh.model.geo.addVolume([gmsh.model.geo.addSurfaceLoop(surfaces)])
    gmsh.model.geo.synchronize()


def _mesh_of(gmsh, scale, name, drawn):
    """The mesh that Gmsh has made; a group for each surface."""
    points, tetrahedra = places_and_rows(gmsh, 4)
    if not len(tetrahedra):
        raise InputError(
            f"surface file {name} must be closed, each edge between two faces, but Gmsh found no "
            "solid in it: close its holes, or join its points"
        )
    points *= scale
    groups = _drawn_groups(gmsh) if drawn else _smooth_parts(points, tetrahedra)
    return Mesh(points, tetrahedra, groups, source=name)


def places_and_rows(gmsh, kind, tag=-1):
    """Points (n, 3), and corners of triangles (kind 2) or tetrahedra (4) of an entity or all."""
    tags, places, _ = gmsh.model.mesh.getNodes()
    number = np.zeros(int(tags.max()) + 1, dtype=np.int64)
    number[tags.astype(np.int64)] = np.arange(len(tags))
    _, nodes = gmsh.model.mesh.getElementsByType(kind, tag)
    return places.reshape(-1, 3), number[nodes.astype(np.int64)].reshape(-1, {2: 3, 4: 4}[kind])


def _drawn_groups(gmsh):
    """Faces of each surface of a CAD file, by the last part of its name there, else its number."""
    groups: dict[str, np.ndarray] = {}
    for _, tag in gmsh.model.getEntities(2):
        given = gmsh.model.getEntityName(2, tag).rsplit("/", 1)[-1].replace('"', "").strip()
        key = given if given.isprintable() and given else f"surface_{tag}"
        _, faces = places_and_rows(gmsh, 2, tag)
        groups[key] = np.vstack([groups.get(key, faces[:0]), faces])
    return {name: faces for name, faces in groups.items() if len(faces)}


def _smooth_parts(points, tetrahedra):
    """Outer faces in groups that end at sharp edges: Gmsh cuts smooth surfaces into patches."""
    outer = geometry.outer_faces(tetrahedra)
    normal = geometry.unit_normals(points, outer)
    pairs = geometry.equal_rows(outer[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)) // 3
    smooth = dot(normal[pairs[:, 0]], normal[pairs[:, 1]]) > np.cos(np.radians(_EDGE_DEG))
    label = geometry.components(len(outer), pairs[smooth])
    parts = (outer[label == first] for first in np.unique(label))
    return {f"surface_{k}": part for k, part in enumerate(parts, 1)}
