"""Where bodies of a mesh meet without a common face, so that no bond holds them (NumPy only)."""

import numpy as np

from taichi_dem.kit.display import counted
from taichi_dem.mesh import tetrahedra as geometry


def parts_of(tetrahedra: np.ndarray) -> np.ndarray:
    """For every body the first of those it is joined to through shared faces, (body_count,)."""
    pairs = geometry.shared_faces(tetrahedra) // 4
    return geometry.components(len(tetrahedra), pairs)


def unbonded_places(points: np.ndarray, tetrahedra: np.ndarray) -> str:
    """A sentence on bodies that meet without a common face although their points are the same.

    "" where there are none. points (n, 3) [m], tetrahedra (m, 4) of positive volume, at most two
    at a face.
    """
    crossed = _crossed_quadrangles(points, tetrahedra)
    if len(crossed):
        place = ", ".join(f"{x:g}" for x in points[crossed[0]].mean(axis=0))
        return (
            f"at {counted(len(crossed), 'quadrangle')}, the first around ({place}) m, the "
            "tetrahedra of one side have the other diagonal than those of the other side: they "
            "share no face there and are not bonded"
        )
    count = len(_points_of_two_parts(tetrahedra))
    if count:
        parts = len(np.unique(parts_of(tetrahedra)))
        return (
            f"{count} points belong to several of the mesh's {parts} parts, which share no face "
            "and are not bonded"
        )
    return ""


def _points_of_two_parts(tetrahedra):
    """Numbers of the points that bodies of different parts share."""
    part = np.repeat(parts_of(tetrahedra), 4)
    least = np.full(tetrahedra.max() + 1, len(tetrahedra))
    most = np.full(len(least), -1)
    np.minimum.at(least, tetrahedra.ravel(), part)
    np.maximum.at(most, tetrahedra.ravel(), part)
    return np.flatnonzero(least < most)


def _crossed_quadrangles(points, tetrahedra):
    """Quadrangles that outer faces cut by both diagonals, their four points, (n, 4).

    Two outer faces of different bodies with a common edge make up a quadrangle where they look the
    same way; a hole of the shape of one tetrahedron has none, as its faces look at each other.
    """
    faces = geometry.all_faces(tetrahedra)
    outer = geometry.outer_rows(faces)
    faces, body = faces[outer], outer // 4
    normal = geometry.area_vectors(points, faces)
    first, second = _pairs_at_edges(faces)
    alike = np.einsum("ij,ij->i", normal[first], normal[second]) > 0.0
    chosen = alike & (body[first] != body[second])
    corners = np.sort(np.hstack([faces[first[chosen]], faces[second[chosen]]]), axis=1)
    twice = corners[:, 1:] == corners[:, :-1]
    known = twice.sum(axis=1) == 2  # not two triangles on the same three points
    corners, twice = corners[known], twice[known]
    diagonal = corners[:, 1:][twice].reshape(-1, 2)
    four = corners[np.hstack([np.ones((len(corners), 1), dtype=bool), ~twice])].reshape(-1, 4)
    # Of a point where three faces meet, two quadrangles have their diagonals in common there.
    with_first = (diagonal[:, :1] == four[:, :1]).astype(four.dtype)
    opposite = np.where(with_first == 1, diagonal[:, 1:], _other_two(four, diagonal)[:, 1:])
    ways = np.unique(np.hstack([four, opposite, with_first]), axis=0)
    cut, count = np.unique(ways[:, :5], axis=0, return_counts=True)
    return cut[count > 1, :4]


def _other_two(four, two):
    """The other two of four ascending numbers, (n, 4), two of which are given, (n, 2)."""
    rest = (four[:, :, None] != two[:, None, :]).all(axis=2)
    return four[rest].reshape(-1, 2)


def _pairs_at_edges(faces):
    """Pairs of faces (n, 3) that have an edge in common, two arrays of face numbers."""
    edges = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    order = np.lexsort(edges.T)
    edges, found = edges[order], [np.empty((2, 0), dtype=np.int64)]
    for step in range(1, len(edges)):
        same = np.flatnonzero((edges[step:] == edges[:-step]).all(axis=1))
        if len(same) == 0:
            break
        found.append(np.stack([order[same] // 3, order[same + step] // 3]))
    return np.hstack(found)
