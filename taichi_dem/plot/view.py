"""What a viewer sees of a block along an axis: facing faces from back to front, crack traces.

NumPy only. Corners are world positions (body_count, 4, 3) [m], as ``record.body_corners`` gives.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from taichi_dem.mesh.mesh import Mesh
from taichi_dem.mesh.tetrahedra import LOCAL_FACES
from taichi_dem.mesh.topology import Topology, skin
from taichi_dem.output.cracks import picture_axes

#: Faces that lean away from the viewer by less than this sine count as seen edge on.
_EDGE_ON = 1e-6


class View:
    """Projection along an axis.

    axis: direction from the block to the viewer, any length. right, up, toward (3,): unit vectors
    of the picture, right-handed; looking down a coordinate axis, the next two are right and up.
    """

    def __init__(self, axis: Sequence[float] = (0.0, 0.0, 1.0)):
        along = np.asarray(axis, dtype=float)
        main = int(np.abs(along).argmax())
        self.toward = along / np.linalg.norm(along) * np.sign(along[main])
        self.right, self.up = picture_axes(self.toward)

    def project(self, points: np.ndarray) -> np.ndarray:
        """Picture coordinates [m] of points (..., 3), shape (..., 2)."""
        return points @ np.column_stack([self.right, self.up])

    def labels(self) -> Any:
        """Labels of the two picture axes: a coordinate's name where the axis is one."""
        return tuple(self._label(vector) for vector in (self.right, self.up))

    def _label(self, vector):
        axis = int(np.abs(vector).argmax())
        along = abs(vector[axis]) > 1.0 - 1e-6
        return f"{'xyz'[axis]} [m]" if along else "in the picture [m]"

    def facing(self, triangles: np.ndarray) -> np.ndarray:
        """Indices of triangles (n, 3, 3) whose normal points to the viewer, the farthest first."""
        normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
        seen = np.flatnonzero(normal @ self.toward > _EDGE_ON * np.linalg.norm(normal, axis=1))
        depth = triangles[seen].mean(axis=1) @ self.toward
        return seen[np.argsort(depth, kind="stable")]


def surface(topology: Topology, view: View, corners: np.ndarray, broken: Any) -> Any:
    """Visible polygons (n, 3, 2) [m] from back to front, their bodies, which are crack faces."""
    body, face, crack = skin(topology, broken)
    triangles = corners[body[:, None], LOCAL_FACES[face]]
    seen = view.facing(triangles)
    return view.project(triangles[seen]), body[seen], crack[seen]


def traces(mesh: Mesh, topology: Topology, view: View, broken_time: np.ndarray) -> Any:
    """Where broken faces reach the outer faces that the viewer sees of the block at rest.

    broken_time: (bond_count,) [s], NaN while a bond holds. A crack has two lips, each an edge of
    one body. Returns body (n,), its local ends (n, 2), and time [s] (n,) of the first break there.
    """
    body, face, _ = skin(topology, np.zeros(topology.bond_count, dtype=bool))
    seen = view.facing(mesh.points[mesh.tetrahedra[body[:, None], LOCAL_FACES[face]]])
    body = np.repeat(body[seen], 3)
    ends = _edges(LOCAL_FACES[face[seen]])
    points = np.take_along_axis(mesh.tetrahedra[body], ends, axis=1)
    first = first_breaks(mesh, topology, broken_time, points)
    hit = ~np.isnan(first)
    return body[hit], ends[hit], first[hit]


def first_breaks(
    mesh: Mesh, topology: Topology, broken_time: np.ndarray, edges: np.ndarray
) -> np.ndarray:
    """First break [s] of a face that ends at each edge, given by its points (n, 2); (n,), or NaN.

    broken_time: (bond_count,) [s], NaN while a bond holds.
    """
    broken = ~np.isnan(broken_time)
    cracked = _edge_keys(_edges(topology.vertices[broken]), mesh.point_count)
    times = np.repeat(broken_time[broken], 3)
    order = np.lexsort((times, cracked))
    keys, first = np.unique(cracked[order], return_index=True)
    wanted, found = _edge_keys(edges, mesh.point_count), np.full(len(edges), np.nan)
    hit = np.isin(wanted, keys)
    found[hit] = times[order[first[np.searchsorted(keys, wanted[hit])]]]
    return found


def _edges(triangles):
    """The three edges of every triangle, (3 n, 2)."""
    return triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)


def _edge_keys(edges, point_count):
    """One number for every edge (n, 2), whichever way round it is given."""
    return edges.min(axis=1).astype(np.int64) * point_count + edges.max(axis=1)
