"""Edges and corners at which the faces of bodies end, where others do not continue them.

A flat side of a solid is made of many faces; only its own rim is an edge that others can meet.
NumPy only.
"""

from dataclasses import dataclass

import numpy as np

from taichi_dem.kit.display import by_fields
from taichi_dem.kit.fixed_order import dot, length
from taichi_dem.mesh.mesh import Mesh
from taichi_dem.mesh.tetrahedra import all_faces, area_vectors

#: Angle between faces below which one continues the other [rad].
FLAT = 1e-5


@dataclass(frozen=True, eq=False)
class FaceRims:
    """Rim of every face; row 4 * body + f, entry k an edge from corner k to the next, or corner k.

    edge: (n, 3), whether the edge ends the flat side. corner: (n, 3), whether the corner belongs to
    this face alone, among those of the side that meet in it. ends: (n, 3, 2, 3), directions of the
    two edges in which the side ends at the corner.
    """

    edge: np.ndarray
    corner: np.ndarray
    ends: np.ndarray

    def __repr__(self):
        return by_fields(self)


def face_rims(mesh: Mesh, outer: np.ndarray) -> FaceRims:
    """Rims of all faces; only outer faces continue each other.

    outer: (4 * body_count,), whether a face is outer. Broken faces end at all their edges.
    """
    faces = all_faces(mesh.tetrahedra)
    corners = mesh.points[faces]
    along = np.roll(corners, -1, axis=1) - corners
    along /= length(along)[..., None]
    back = -np.roll(along, 1, axis=1)
    mate = _continued(mesh, faces, np.flatnonzero(outer))
    group = _groups(mate)
    angle = np.arctan2(length(np.cross(along, back)), dot(along, back)).reshape(-1)
    whole = np.bincount(group, weights=angle, minlength=len(angle))
    # A side that ends at a corner has there one edge that leaves it and one that arrives.
    ends = np.zeros((len(angle), 2, 3))
    leaves, arrives = mate < 0, np.roll(mate.reshape(-1, 3), 1, axis=1).reshape(-1) < 0
    ends[group[leaves], 0] = along.reshape(-1, 3)[leaves]
    ends[group[arrives], 1] = back.reshape(-1, 3)[arrives]
    convex = np.bincount(group[leaves], minlength=len(angle)) == 1
    convex &= whole < np.pi - FLAT
    corner = convex & (group == np.arange(len(group)))
    shape = (-1, 3)
    return FaceRims(leaves.reshape(shape), corner.reshape(shape), ends.reshape(-1, 3, 2, 3))


def _continued(mesh, faces, outer):
    """Edge 3 * face + e of the outer face that continues another, -1 for none, (3 n,)."""
    mate = np.full(3 * len(faces), -1)
    edges = (3 * outer[:, None] + np.arange(3)).reshape(-1)
    start, end = faces[outer].reshape(-1), np.roll(faces[outer], -1, axis=1).reshape(-1)
    normal = area_vectors(mesh.points, faces[outer])
    normal = np.repeat(normal / length(normal)[:, None], 3, axis=0)
    # The other face runs along the edge in the opposite direction.
    count = len(mesh.points)
    key, sought = start * count + end, end * count + start
    order = np.argsort(key, kind="stable")
    if len(order) == 0:
        return mate
    found = np.minimum(np.searchsorted(key[order], sought), len(order) - 1)
    other = order[found]
    flat = (key[other] == sought) & (dot(normal, normal[other]) > 0.0)
    flat &= length(np.cross(normal, normal[other])) < FLAT
    # Of several faces at one edge, each must be the other's.
    flat &= np.where(flat, other[other], -1) == np.arange(len(other))
    mate[edges[flat]] = edges[other[flat]]
    return mate


def _groups(mate):
    """Smallest corner 3 * face + k of those that lie in one point of one flat side, (3 n,)."""
    group = np.arange(len(mate))
    leaving = np.flatnonzero(mate >= 0)
    # The edge that leaves this corner arrives, in the other face, at the corner after its start.
    face, k = np.divmod(mate[leaving], 3)
    other = 3 * face + (k + 1) % 3
    before = None
    while before is None or not np.array_equal(before, group):
        before = group.copy()
        np.minimum.at(group, leaving, before[other])
        np.minimum.at(group, other, before[leaving])
    return group
