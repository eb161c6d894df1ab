"""Solids of which only the surface is drawn, STL and STEP, filled with tetrahedra by Gmsh."""

import os
from typing import Any

import numpy as np

from taichi_dem.kit.errors import InputError
from taichi_dem.kit.fixed_order import dot, length
from taichi_dem.kit.validation import FileName, path_name, positive, told_apart
from taichi_dem.mesh import tetrahedra as geometry
from taichi_dem.mesh.gmsh import session
from taichi_dem.mesh.mesh import Mesh, checked_mesh

#: Angle between triangles of an STL from which on an edge parts two surfaces [degrees].
_EDGE_DEG = 40.0
#: Most elements of a mesh: ten million tetrahedra take some ten GiB to check.
_MOST_BODIES = 10_000_000
#: Tetrahedra in a cube of an element; Gmsh makes 8.5.
_PER_CUBE = 8.7
#: Endings of files, by how they are read.
_DRAWN, _TRIANGLES = (".step", ".stp"), (".stl",)


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
            if not gmsh.model.getEntities(3):
                raise InputError(f"surface file {name} must hold a closed surface, got none")
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
    tags, places, _ = gmsh.model.mesh.getNodes()
    place = dict(zip(tags.tolist(), places.reshape(-1, 3)))
    _, nodes = gmsh.model.mesh.getElementsByType(2)
    corners = np.array([place[node] for node in nodes.tolist()]).reshape(-1, 3, 3)
    return abs(float(np.linalg.det(corners - corners[:1, :1]).sum())) / 6.0


def refuse_too_many(element: float, volume: float) -> None:
    """Raise InputError for more tetrahedra in a volume [m3] than there is memory for."""
    least = (_PER_CUBE * volume / _MOST_BODIES) ** (1.0 / 3.0)
    if element < least:
        got, bound = told_apart(element, least)
        raise InputError(
            f"element must be at least {bound} m, for {_MOST_BODIES} tetrahedra at most in "
            f"{volume:.3g} m3, got {got}"
        )


def _draw_triangles(gmsh: Any, name: str) -> None:
    """Read triangles, part them at their edges, and make a volume of what they enclose."""
    gmsh.merge(name)
    gmsh.model.mesh.removeDuplicateNodes()
    _refuse_open(gmsh, name)
    angle = np.radians(_EDGE_DEG)
    gmsh.model.mesh.classifySurfaces(angle, True, True, np.pi)
    gmsh.model.mesh.createGeometry()
    surfaces = [tag for _, tag in gmsh.model.getEntities(2)]
    gmsh.model.geo.addVolume([gmsh.model.geo.addSurfaceLoop(surfaces)])
    gmsh.model.geo.synchronize()


def _refuse_open(gmsh, name):
    """Raise InputError unless every edge of the triangles belongs to two of them."""
    _, nodes = gmsh.model.mesh.getElementsByType(2)
    if not len(nodes):
        raise InputError(f"surface file {name} must hold triangles, got none")
    corners = nodes.reshape(-1, 3)[:, [[0, 1], [1, 2], [0, 2]]].reshape(-1, 2)
    count = np.unique(np.sort(corners, axis=1), axis=0, return_counts=True)[1]
    wrong = int((count != 2).sum())
    if wrong:
        raise InputError(
            f"surface file {name} must be closed, each edge between two triangles, but {wrong} of "
            f"its {len(count)} edges are not: close its holes, or join its points"
        )


def _mesh_of(gmsh, scale, name, drawn):
    """The mesh that Gmsh has made; a group for each surface."""
    tags, places, _ = gmsh.model.mesh.getNodes()
    number = np.zeros(int(tags.max()) + 1, dtype=np.int64)
    number[tags.astype(np.int64)] = np.arange(len(tags))
    _, bodies = gmsh.model.mesh.getElementsByType(4)
    if not len(bodies):
        raise InputError(f"surface file {name} must enclose a solid, but Gmsh filled none")
    points = scale * places.reshape(-1, 3)
    tetrahedra = number[bodies.astype(np.int64)].reshape(-1, 4)
    groups = _drawn_groups(gmsh, number) if drawn else _smooth_parts(points, tetrahedra)
    return checked_mesh(points, tetrahedra, groups, source=name)


def _drawn_groups(gmsh, number):
    """Faces of each surface of a CAD file, by the last part of its name there, else its number."""
    groups: dict[str, np.ndarray] = {}
    for _, tag in gmsh.model.getEntities(2):
        given = gmsh.model.getEntityName(2, tag).rsplit("/", 1)[-1].replace('"', "").strip()
        key = given if given.isprintable() and given else f"surface_{tag}"
        _, corners = gmsh.model.mesh.getElementsByType(2, tag)
        faces = number[corners.astype(np.int64)].reshape(-1, 3)
        groups[key] = np.vstack([groups.get(key, faces[:0]), faces])
    return {name: faces for name, faces in groups.items() if len(faces)}


def _smooth_parts(points, tetrahedra):
    """Outer faces in groups that end at sharp edges: Gmsh cuts smooth surfaces into patches."""
    faces = geometry.all_faces(tetrahedra)
    outer = faces[geometry.outer_rows(faces)]
    normal = geometry.area_vectors(points, outer)
    normal /= length(normal)[:, None]
    first, second = geometry.pairs_at_edges(outer)
    smooth = dot(normal[first], normal[second]) > np.cos(np.radians(_EDGE_DEG))
    label = geometry.components(len(outer), np.stack([first[smooth], second[smooth]], axis=1))
    parts = (outer[label == first] for first in np.unique(label))
    return {f"surface_{k}": part for k, part in enumerate(parts, 1)}
