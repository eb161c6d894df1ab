"""Geometry and connectivity of bare tetrahedron arrays (NumPy only)."""

from __future__ import annotations

import functools
from collections.abc import Iterator

import numpy as np

from taichi_dem.kit.fixed_order import dot, length

#: Local vertices of the four faces, in the order whose right-hand normal points outward
#: for a tetrahedron of positive volume.
LOCAL_FACES = np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]], dtype=np.int32)

#: Local vertices of the six edges.
LOCAL_EDGES = np.array([[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]], dtype=np.int32)

#: Two edges of each of the four faces.
_FROM, _TO = [0, 0, 1, 3], [1, 2, 2, 4]

#: Powers of the inverse of the root of x^4 = x + 1: their multiples fill the unit cube evenly.
_SPREAD = np.multiply.accumulate(np.full(3, 1.0 / 1.2207440846057596))


def signed_volumes(points: np.ndarray, tetrahedra: np.ndarray) -> np.ndarray:
    """Signed volumes det(p1 - p0, p2 - p0, p3 - p0) / 6 [m3], shape (body_count,)."""
    corners = points[tetrahedra]
    a, b, c = (corners[:, k] - corners[:, 0] for k in (1, 2, 3))
    return dot(a, np.cross(b, c)) / 6.0


def edge_lengths(points: np.ndarray, tetrahedra: np.ndarray) -> np.ndarray:
    """Lengths of the six edges [m], shape (body_count, 6)."""
    ends = points[tetrahedra[:, LOCAL_EDGES]]
    return length(ends[:, :, 1] - ends[:, :, 0])


def area_vectors(points: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Right-hand normals times the area of triangles [m2], shape (n, 3)."""
    corners = points[faces]
    return 0.5 * np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


def unit_normals(points: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Right-hand unit normals of triangles, shape (n, 3); faces: point indices, (n, 3)."""
    vectors = area_vectors(points, faces)
    return vectors / length(vectors)[:, None]


def all_faces(tetrahedra: np.ndarray) -> np.ndarray:
    """Every face of every body, outward order, shape (4 * body_count, 3); row 4 * body + f."""
    return tetrahedra[:, LOCAL_FACES].reshape(-1, 3)


def face_numbers(faces: np.ndarray) -> np.ndarray:
    """Number every distinct vertex set of ``faces``; equal sets get equal numbers, shape (n,)."""
    # Numbers instead of rows are sorted, in a twentieth of the time.
    first, *others = np.sort(faces, axis=1).T.astype(np.int64)
    for column in others:
        first = np.unique(first * (column.max(initial=0) + 1) + column, return_inverse=True)[1]
    return first


def numbers_in(*faces: np.ndarray) -> list[np.ndarray]:
    """``face_numbers`` of several arrays of faces, counted together, one array for each."""
    ends = np.cumsum([len(rows) for rows in faces])[:-1]
    return np.split(face_numbers(np.vstack(faces)), ends)


def outer_rows(faces: np.ndarray) -> np.ndarray:
    """Rows of ``all_faces`` that are the face of one body only, in order, shape (n,)."""
    number = face_numbers(faces)
    return np.flatnonzero(np.bincount(number)[number] == 1)


def outer_faces(tetrahedra: np.ndarray) -> np.ndarray:
    """Faces of one body only, outward order, (n, 3)."""
    faces = all_faces(tetrahedra)
    return faces[outer_rows(faces)]


def shared_faces(tetrahedra: np.ndarray) -> np.ndarray:
    """Rows of ``all_faces`` that are one face of two bodies, shape (n, 2), smaller row first."""
    return equal_rows(all_faces(tetrahedra))


def equal_rows(rows: np.ndarray) -> np.ndarray:
    """Numbers of rows on the same points, each with the next such one, (n, 2)."""
    number = face_numbers(rows)
    order = np.argsort(number, kind="stable")
    same = number[order[1:]] == number[order[:-1]]
    return np.column_stack([order[:-1][same], order[1:][same]])


def penetration(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Least way [m] that parts each two tetrahedra, at most 0 where they share no volume, (n,)."""
    # Theorem of separating axes: convex bodies are apart along a face normal or across two edges.
    origin = first[:, :1]
    first, second = first - origin, second - origin
    a, b = (np.diff(c[:, LOCAL_EDGES], axis=2)[:, :, 0] for c in (first, second))
    normals = [np.cross(edges[:, _FROM], edges[:, _TO]) for edges in (a, b)]
    least = _overlap(np.concatenate(normals, axis=1), first, second)
    (left,) = np.nonzero(least > 0.0)
    across = np.cross(a[left, :, None], b[left, None]).reshape(len(left), 36, 3)
    least[left] = np.minimum(least[left], _overlap(across, first[left], second[left]))
    return least


def _overlap(axes, first, second):
    """Least overlap [m] of the projections of each two bodies on some axes, (n, axes, 3), (n,)."""
    size = np.linalg.norm(axes, axis=2)
    a, b = (np.einsum("nax,ncx->nac", axes, corners) for corners in (first, second))
    both = np.minimum(a.max(axis=2) - b.min(axis=2), b.max(axis=2) - a.min(axis=2))
    # Parallel edges have no axis across both.
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(size > 0.0, both / size, np.inf).min(axis=1, initial=np.inf)


def components(count: int, pairs: np.ndarray) -> np.ndarray:
    """Connected components of a graph: the smallest member of each node's part, shape (count,)."""
    label = np.arange(count)
    while True:
        lowest = np.minimum(label[pairs[:, 0]], label[pairs[:, 1]])
        merged = label.copy()
        for side in (0, 1):
            np.minimum.at(merged, label[pairs[:, side]], lowest)
        while not np.array_equal(merged, merged[merged]):
            merged = merged[merged]
        if np.array_equal(merged, label):
            return label
        label = merged


def close_pairs(points: np.ndarray, distance: float) -> np.ndarray:
    """Pairs of points not farther apart than ``distance`` [m], shape (n, 2), first < second."""
    # Close points share a cell of at least one of eight grids of cell size 4 distance, shifted by
    # half a cell along each axis.
    pairs = []
    cell = 4.0 * distance
    low = points.min(axis=0)
    for shift in np.ndindex(2, 2, 2):
        first, second = _in_one_cell(np.floor((points - low) / cell + 0.5 * np.array(shift)))
        near = length(points[first] - points[second]) <= distance
        pairs.append(np.sort(np.column_stack([first[near], second[near]]), axis=1))
    return np.unique(np.vstack(pairs), axis=0)


def _in_one_cell(rows):
    """Numbers of each two equal rows (n, ...), (2, pairs)."""
    order = np.lexsort(rows.T)
    rows, pairs = rows[order], [np.empty((2, 0), dtype=np.int64)]
    for step in range(1, len(rows)):
        same = np.flatnonzero((rows[step:] == rows[:-step]).all(axis=1))
        if len(same) == 0:
            break
        pairs.append(np.stack([order[same], order[same + step]]))
    return np.hstack(pairs)


@functools.cache
def points_of_parts(halvings: int) -> np.ndarray:
    """A point in each of the equal parts of a tetrahedron, as shares of its corners, (parts, 4)."""
    # Middles of the parts would lie in layers along each face, and a body pressed in by less than a
    # layer would hold none: Roberts's sequence spreads the points.
    parts = [np.eye(4)]
    for _ in range(halvings):
        parts = [piece for whole in parts for piece in eighths(whole)]
    cuts = np.sort(np.arange(1, len(parts) + 1)[:, None] * _SPREAD % 1.0, axis=1)
    shares = np.diff(cuts, axis=1, prepend=0.0, append=1.0)
    points = (shares[:, :, None] * np.array(parts)).sum(axis=1)
    points.flags.writeable = False
    return points


def eighths(corners: np.ndarray) -> Iterator[np.ndarray]:
    """Eight parts of equal volume: one at each corner and four around an inner diagonal."""
    middle = {(a, b): 0.5 * (corners[a] + corners[b]) for a in range(4) for b in range(a)}

    def between(a, b):
        return middle[max(a, b), min(a, b)]

    for a in range(4):
        yield np.array([corners[a] if b == a else between(a, b) for b in range(4)])
    ring = [between(0, 2), between(0, 3), between(1, 3), between(1, 2)]
    for k in range(4):
        yield np.array([between(0, 1), between(2, 3), ring[k], ring[(k + 1) % 4]])
