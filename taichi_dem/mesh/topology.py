"""Which faces are bonds, which are free, and the mass properties of the bodies (NumPy only).

Local face f of a body is the face opposite its local vertex f.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from taichi_dem.kit.display import by_fields
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.fixed_order import dot, length, product, transposed
from taichi_dem.mesh import tetrahedra as geometry
from taichi_dem.mesh.mesh import Mesh

#: Density of all bodies [kg/m3], or of each, (body_count,).
Density = float | np.ndarray
#: Share of the mesh's extent by which a point may lie outside of a body: rounding.
_ROUNDING = 1e-9


@dataclass(frozen=True, eq=False)
class Topology:
    """Bonds, which are shared faces, and free faces of a mesh.

    master, slave: (bond_count,) int32 bodies, master < slave; sorted by (master, slave).
    master_face, slave_face: (bond_count,) int32 local faces.
    vertices: (bond_count, 3) int32 points of the face; right-hand normal out of the master.
    body_bond: (body_count, 4) int32 bond at local face f, -1 at an outer face.
    outer_body, outer_face: (outer_count,) int32 body and local face of the free faces.
    is_open: (outer_count,) whether another body lies behind the free face: no bond joins them.
    bonded_share: (bond_count,) share of the face's area that is bonded (``Mesh.bonded_by``).
    Source: Konno et al., section 2.1 (master is the body of lower index).
    """

    master: np.ndarray
    slave: np.ndarray
    master_face: np.ndarray
    slave_face: np.ndarray
    vertices: np.ndarray
    body_bond: np.ndarray
    outer_body: np.ndarray
    outer_face: np.ndarray
    is_open: np.ndarray
    bonded_share: np.ndarray

    __repr__ = by_fields

    @property
    def bond_count(self) -> int:
        """Number of shared faces."""
        return len(self.master)

    @property
    def outer_count(self) -> int:
        """Number of faces without a bond."""
        return len(self.outer_body)


def topology_of(mesh: Mesh) -> Topology:
    """Match the faces of all bodies."""
    rows, share = _bonded_faces(mesh)
    order = np.lexsort((rows[:, 1] // 4, rows[:, 0] // 4))
    rows, share = rows[order].astype(np.int32), share[order]
    body, face = rows // 4, rows % 4
    body_bond = np.full((mesh.body_count, 4), -1, dtype=np.int32)
    for side in (0, 1):
        body_bond[body[:, side], face[:, side]] = np.arange(len(rows))
    outer_body, outer_face = np.nonzero(body_bond < 0)
    shared = np.zeros(4 * mesh.body_count, dtype=bool)
    shared[geometry.shared_faces(mesh.tetrahedra).ravel()] = True
    return Topology(
        master=body[:, 0].copy(),
        slave=body[:, 1].copy(),
        master_face=face[:, 0].copy(),
        slave_face=face[:, 1].copy(),
        vertices=geometry.all_faces(mesh.tetrahedra)[rows[:, 0]],
        body_bond=body_bond,
        outer_body=outer_body.astype(np.int32),
        outer_face=outer_face.astype(np.int32),
        is_open=shared[4 * outer_body + outer_face],
        bonded_share=share,
    )


def bonded_bodies(mesh: Mesh) -> np.ndarray:
    """Pairs of bodies that a bond joins, (n, 2)."""
    return _bonded_faces(mesh)[0] // 4


def _bonded_faces(mesh):
    """Pairs of faces 4 * body + f with a bond, (n, 2), and the share of each that is bonded, (n,).

    The least share of the groups that a face is in; all of one in none.
    """
    rows = geometry.shared_faces(mesh.tetrahedra)
    share = np.ones(len(rows))
    if mesh.bonded_shares:
        faces = geometry.all_faces(mesh.tetrahedra)[rows[:, 0]]
        groups = [mesh.group_faces(name) for name, _ in mesh.bonded_shares]
        number, *members = geometry.numbers_in(faces, *groups)
        of_face = np.ones(1 + max(map(np.max, (number, *members))))
        for (_, least), mine in zip(mesh.bonded_shares, members):
            of_face[mine] = np.minimum(of_face[mine], least)
        share = of_face[number]
    return rows[share > 0.0], share[share > 0.0]


def skin(topology: Topology, broken: Any) -> Any:
    """Faces that show: outer ones and both sides of broken bonds.

    broken: (bond_count,) bool. Returns body, local face (n,) and whether it is a crack face (n,).
    """
    bodies = (topology.outer_body, topology.master[broken], topology.slave[broken])
    faces = (topology.outer_face, topology.master_face[broken], topology.slave_face[broken])
    body = np.concatenate(bodies)
    return body, np.concatenate(faces), np.arange(len(body)) >= topology.outer_count


def face_vertices(mesh: Mesh, body: np.ndarray, face: np.ndarray) -> np.ndarray:
    """Points of local faces in the order whose right-hand normal points outward, (n, 3) int32.

    body, face: body and local face, shape (n,).
    """
    return np.take_along_axis(mesh.tetrahedra[body], geometry.LOCAL_FACES[face], axis=1)


def faces_of_group(mesh: Mesh, topology: Topology, name: str) -> tuple[np.ndarray, np.ndarray]:
    """Body and local face of every face of a group, two arrays (n,) int32, in the group's order.

    Of inner faces without bonds both sides, one after the other. Raises InputError when the mesh
    has no such group, or bonds join its faces.
    """
    check_free(mesh, name)
    outer = face_vertices(mesh, topology.outer_body, topology.outer_face)
    number, wanted = geometry.numbers_in(outer, mesh.group_faces(name))
    place = np.full(max(number.max(), wanted.max()) + 1, -1)
    place[wanted] = np.arange(len(wanted))
    found = np.flatnonzero(place[number] >= 0)
    found = found[np.argsort(place[number[found]], kind="stable")]
    return topology.outer_body[found], topology.outer_face[found]


def check_free(mesh: Mesh, name: str) -> None:
    """Raise InputError for a group of inner faces that bonds join: nothing acts on them."""
    if name in mesh.inner_groups and (name, 0.0) not in mesh.bonded_shares:
        raise InputError(
            f"group {name} must be of outer faces, or unbonded (Scene(unbonded=[{name!r}])), "
            "got inner faces that are bonded"
        )


def body_properties(mesh: Mesh, density: Density) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mass [kg] (n,), centre of mass [m] (n, 3), inertia about it [kg m2] (n, 3, 3).

    density [kg/m3]: of all bodies, or of each, (body_count,).  With the vertices x_k taken from the
    centroid, the second moment of a homogeneous tetrahedron is S = m/20 sum_k x_k x_k^T and its
    inertia is tr(S) 1 - S (F. Tonon, J. Math. Stat. 1(1), 2005, 8-11, writes out the same integral
    by components).
    """
    corners = mesh.points[mesh.tetrahedra]
    centre = corners.mean(axis=1)
    mass = density * geometry.signed_volumes(mesh.points, mesh.tetrahedra)
    arms = corners - centre[:, None]
    second = mass[:, None, None] / 20.0 * product(transposed(arms), arms)
    trace = np.trace(second, axis1=1, axis2=2)
    return mass, centre, trace[:, None, None] * np.eye(3) - second


def body_at(mesh: Mesh, name: str, point: np.ndarray) -> int:
    """Number of the body that holds a point, the lowest where several share it.

    Parameters
    ----------
    mesh : Mesh
    name : str
        Of the point, for the sentence.
    point : array (3,) [m]

    Raises
    ------
    InputError
        For a point in no body, with the nearest body and the distance of its centre.
    """
    faces = geometry.all_faces(mesh.tetrahedra)
    normal = geometry.unit_normals(mesh.points, faces)
    outside = dot(point - mesh.points[faces[:, 0]], normal).reshape(-1, 4).max(axis=1)
    holding = np.flatnonzero(outside <= _ROUNDING * np.ptp(mesh.points, axis=0).max())
    if len(holding):
        return int(holding[0])
    away = length(mesh.points[mesh.tetrahedra].mean(axis=1) - point)
    raise InputError(
        f"{name} must lie in a body, got ({point[0]:g}, {point[1]:g}, {point[2]:g}) m; the centre "
        f"of the nearest, body {away.argmin()}, is {away.min():.3g} m away"
    )
