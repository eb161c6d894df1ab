"""Which faces are bonds, which are free, and the mass properties of the bodies (NumPy only).

Local face f of a body is the face opposite its local vertex f.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from taichi_dem.kit.display import by_fields
from taichi_dem.kit.fixed_order import product, transposed
from taichi_dem.mesh import tetrahedra as geometry
from taichi_dem.mesh.mesh import Mesh


@dataclass(frozen=True, eq=False)
class Topology:
    """Shared faces (bonds) and outer faces of a mesh.

    master, slave: (bond_count,) int32 bodies, master < slave; sorted by (master, slave).
    master_face, slave_face: (bond_count,) int32 local faces.
    vertices: (bond_count, 3) int32 points of the face; right-hand normal out of the master.
    body_bond: (body_count, 4) int32 bond at local face f, -1 at an outer face.
    outer_body, outer_face: (outer_count,) int32 body and local face of the outer faces.
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

    def __repr__(self):
        return by_fields(self)

    @property
    def bond_count(self) -> int:
        """Number of shared faces."""
        return len(self.master)

    @property
    def outer_count(self) -> int:
        """Number of faces that belong to one body only."""
        return len(self.outer_body)


def topology_of(mesh: Mesh) -> Topology:
    """Match the faces of all bodies."""
    rows = geometry.shared_faces(mesh.tetrahedra)
    rows = rows[np.lexsort((rows[:, 1] // 4, rows[:, 0] // 4))].astype(np.int32)
    body, face = rows // 4, rows % 4
    body_bond = np.full((mesh.body_count, 4), -1, dtype=np.int32)
    for side in (0, 1):
        body_bond[body[:, side], face[:, side]] = np.arange(len(rows))
    outer_body, outer_face = np.nonzero(body_bond < 0)
    return Topology(
        master=body[:, 0].copy(),
        slave=body[:, 1].copy(),
        master_face=face[:, 0].copy(),
        slave_face=face[:, 1].copy(),
        vertices=geometry.all_faces(mesh.tetrahedra)[rows[:, 0]],
        body_bond=body_bond,
        outer_body=outer_body.astype(np.int32),
        outer_face=outer_face.astype(np.int32),
    )


def face_vertices(mesh: Mesh, body: np.ndarray, face: np.ndarray) -> np.ndarray:
    """Points of local faces in the order whose right-hand normal points outward, (n, 3) int32.

    body, face: body and local face, shape (n,).
    """
    return np.take_along_axis(mesh.tetrahedra[body], geometry.LOCAL_FACES[face], axis=1)


def faces_of_group(mesh: Mesh, topology: Topology, name: str) -> tuple[np.ndarray, np.ndarray]:
    """Body and local face of every face of a group, two arrays (n,) int32, in the group's order.

    Raises InputError when the mesh has no such group.
    """
    wanted = mesh.group_faces(name)
    outer = face_vertices(mesh, topology.outer_body, topology.outer_face)
    number = geometry.face_numbers(np.vstack([outer, wanted]))
    index_of = np.full(number.max() + 1, -1)
    index_of[number[: len(outer)]] = np.arange(len(outer))
    index = index_of[number[len(outer) :]]
    return topology.outer_body[index], topology.outer_face[index]


def body_properties(mesh: Mesh, density: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mass [kg] (n,), centre of mass [m] (n, 3), inertia about it [kg m2] (n, 3, 3).

    density [kg/m3].  With the vertices x_k taken from the centroid, the second moment of a
    homogeneous tetrahedron is S = m/20 sum_k x_k x_k^T and its inertia is tr(S) 1 - S
    (F. Tonon, J. Math. Stat. 1(1), 2005, 8-11, writes out the same integral by components).
    """
    corners = mesh.points[mesh.tetrahedra]
    centre = corners.mean(axis=1)
    mass = density * geometry.signed_volumes(mesh.points, mesh.tetrahedra)
    arms = corners - centre[:, None]
    second = mass[:, None, None] / 20.0 * product(transposed(arms), arms)
    trace = np.trace(second, axis1=1, axis2=2)
    return mass, centre, trace[:, None, None] * np.eye(3) - second
