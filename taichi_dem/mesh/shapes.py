"""Small meshes of known shape, built without a mesh generator: for tests, demos, wave bars."""

import itertools
from collections.abc import Sequence

import numpy as np

from taichi_dem.kit.errors import InputError
from taichi_dem.kit.validation import positive, several, shown, whole
from taichi_dem.mesh.mesh import Mesh, checked_mesh

#: Groups of a bar: its low and high end along each axis.
_SIDES = ("left", "right"), ("bottom", "top"), ("back", "front")
#: Boxes of a bar: ten million tetrahedra take some ten GiB to check.
_MOST_BOXES = 1_666_666


def single(edge: float = 0.05) -> Mesh:
    """One regular tetrahedron of ``edge`` [m]: base in the plane x = 0, apex at x < 0.

    Groups: base, sides.
    """
    base, height = _base(edge)
    points = np.vstack([[-height, 0.0, 0.0], base])
    groups = {"base": [[1, 2, 3]], "sides": [[0, 1, 2], [0, 2, 3], [0, 3, 1]]}
    return checked_mesh(points, [[0, 1, 2, 3]], groups)


def pair(edge: float = 0.05, height: float | None = None) -> Mesh:
    """Two equal tetrahedra that share the face in x = 0; body 0 lies at x < 0, body 1 at x > 0.

    edge, height: [m]; regular ones where no height is given.  Groups: left and right, the free
    faces of either body.
    """
    base, regular = _base(edge)
    height = regular if height is None else positive("height", height)
    points = np.vstack([base, [-height, 0.0, 0.0], [height, 0.0, 0.0]])
    around = [(0, 1), (1, 2), (2, 0)]
    groups = {
        "left": [[3, a, b] for a, b in around],
        "right": [[4, a, b] for a, b in around],
    }
    return checked_mesh(points, [[3, 0, 1, 2], [4, 0, 2, 1]], groups)


def bar(length: float, width: float, cells: Sequence[int]) -> Mesh:
    """Square bar along x from the origin, regular boxes cut into six tetrahedra each.

    length, width: [m].  cells: boxes along x, y and z.
    Groups: left, right (ends), bottom, top, back, front (z = width).
    The cut is Kuhn's: all six share the box's diagonal, and neighbours match without turning.
    Body number = 6 * box + path; boxes run fastest along z.
    """
    boxes = _checked_cells(length, width, cells)
    index = np.arange(np.prod(boxes + 1)).reshape(boxes + 1)
    grid = np.stack(np.meshgrid(*(np.arange(n + 1) for n in boxes), indexing="ij"), axis=-1)
    points = grid.reshape(-1, 3) / boxes * np.array([length, width, width], dtype=float)
    tetrahedra = _kuhn(index)
    return checked_mesh(points, tetrahedra, _sides(grid.reshape(-1, 3), boxes, tetrahedra))


def placed_together(parts: dict, keep_coincident: bool = False) -> Mesh:
    """Several solids as one mesh, not bonded to each other; bodies in the order of the parts.

    parts: name -> (mesh, shift (3,) [m]). Groups: those of every part as NAME_GROUP, and, under
    its own name, a group of all parts together. Body groups: likewise, and NAME for all bodies of a
    part. keep_coincident: solids may touch point by point (see ``checked_mesh``). Raises InputError
    as ``checked_mesh``.
    """
    points, tetrahedra, groups, first = [], [], {}, 0
    for name, (mesh, shift) in parts.items():
        points.append(mesh.points + np.asarray(shift))
        tetrahedra.append(mesh.tetrahedra + first)
        for group, faces in mesh.groups.items():
            groups[f"{name}_{group}"] = faces + first
            groups.setdefault(group, []).append(faces + first)
        first += mesh.point_count
    joined = {key: np.vstack(faces) for key, faces in groups.items()}
    arrays = np.vstack(points), np.vstack(tetrahedra), joined
    bodies = _bodies_together({name: mesh for name, (mesh, _) in parts.items()})
    return checked_mesh(*arrays, keep_coincident=keep_coincident, body_groups=bodies)


def _bodies_together(parts):
    """Body groups of ``placed_together``."""
    groups: dict[str, np.ndarray] = {}
    firsts = np.cumsum([0, *(mesh.body_count for mesh in parts.values())])
    for (name, mesh), first in zip(parts.items(), firsts):
        for group, bodies in mesh.body_groups.items():
            for key in (group, f"{name}_{group}"):
                groups[key] = np.append(groups.get(key, bodies[:0]), bodies + first)
    # The name of a part stands for all of it, whatever groups are called.
    return {**groups, **dict(zip(parts, np.split(np.arange(firsts[-1]), firsts[1:-1])))}


def _base(edge):
    """Equilateral triangle in x = 0 about the origin, normal +x, and the apex height [m]."""
    edge = positive("edge", edge)
    radius, half = edge / np.sqrt(3.0), 0.5 * edge
    triangle = [[0.0, radius, 0.0], [0.0, -0.5 * radius, half], [0.0, -0.5 * radius, -half]]
    return np.array(triangle), edge * np.sqrt(2.0 / 3.0)


def _checked_cells(length, width, cells):
    """Numbers of boxes as an array (3,)."""
    for name, value in (("length", length), ("width", width)):
        positive(name, value)
    numbers = np.array(several("cells", cells, lambda name, n: whole(name, n, 1, _MOST_BOXES)))
    if len(numbers) != 3 or np.prod(numbers.astype(float)) > _MOST_BOXES:
        raise InputError(
            f"cells must be three numbers that make at most {_MOST_BOXES} boxes, got {shown(cells)}"
        )
    return numbers


def _kuhn(index):
    """Six tetrahedra a box: one for every path of axis steps from its low to its high corner."""
    axes, paths = np.eye(3, dtype=int), []
    for order in itertools.permutations(range(3)):
        steps = axes[list(order)]
        path = np.vstack([np.zeros(3, dtype=int), np.cumsum(steps, axis=0)])
        if np.linalg.det(steps) < 0.0:  # it winds the other way round
            path[2:] = path[[3, 2]]
        paths.append(np.stack([_corner(index, step) for step in path], axis=-1))
    return np.stack(paths, axis=1).reshape(-1, 4)


def _corner(index, step):
    """Point numbers of one corner of all boxes, shape (boxes,)."""
    box = tuple(slice(s, n - 1 + s) for s, n in zip(step, index.shape))
    return index[box].ravel()


def _sides(grid, cells, tetrahedra):
    """Faces of the tetrahedra in the six outer planes: a face with all its points in the plane."""
    faces = tetrahedra[:, list(itertools.combinations(range(4), 3))].reshape(-1, 3)
    groups = {}
    for axis, names in enumerate(_SIDES):
        for name, end in zip(names, (0, cells[axis])):
            groups[name] = faces[(grid[faces, axis] == end).all(axis=1)]
    return groups
