"""Meshes built without a mesh generator, and several meshes as one, apart or bonded.

A front view is triangulated by Delaunay's rule; each layer behind it is of prisms of three bodies.
"""

import itertools
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from taichi_dem.kit.errors import InputError
from taichi_dem.kit.fixed_order import dot
from taichi_dem.kit.validation import flag, instance, positive, several, shown, whole, word
from taichi_dem.mesh import tetrahedra as geometry
from taichi_dem.mesh.check import COINCIDENT, joined_bodies, weld_labels
from taichi_dem.mesh.mesh import Mesh, checked_mesh
from taichi_dem.mesh.scatter import scattered

#: Groups of a bar: its low and high end along each axis.
_SIDES = ("left", "right"), ("bottom", "top"), ("back", "front")
#: Boxes of a bar: ten million tetrahedra take some ten GiB to check.
_MOST_BOXES = 1_666_666
#: Height of a layer over the edge of its triangles.
_LAYER = 0.8
#: Given coordinates of points (..., 2) [m], whether each lies on a part of the outline.
OnOutline = Callable[[np.ndarray], np.ndarray]
#: Least distance of an inner point from the outline, and shift that decides between triangulations
#: of points on one circle, in elements.
_FROM_OUTLINE, _SHIFT = 0.55, 1e-4
#: Distance from the outline within which a point lies on it, in elements.
_ON = 1e-6
#: Largest circumscribed radius of an inner triangle, in elements, and where that fails.
_RADII = 0.95, 1.6
#: Rounds of smoothing, and moves of a round.
_ROUNDS, _MOVES = 3, 4
#: Share of the area that may be missing.
_AREA = 1e-9
#: Names of meshes that get none.
_NAMES = ("first", "second", "third", "fourth", "fifth", "sixth", "seventh", "eighth")
#: Points nearer than this share of the shortest edge become one where meshes are bonded.
_WELD = 1e-6
#: Cells of the curve along the longest side of a mesh, as a power of two.
_BITS = 20


def single(edge: float = 0.05) -> Mesh:
    """One regular tetrahedron of ``edge`` [m]: base in the plane x = 0, apex at x < 0."""
    base, height = _base(edge)
    points = np.vstack([[-height, 0.0, 0.0], base])
    groups = {"base": [[1, 2, 3]], "sides": [[0, 1, 2], [0, 2, 3], [0, 3, 1]]}
    return checked_mesh(points, [[0, 1, 2, 3]], groups)


def pair(edge: float = 0.05, height: float | None = None) -> Mesh:
    """Two equal tetrahedra that share the face in x = 0; body 0 lies at x < 0, body 1 at x > 0."""
    base, regular = _base(edge)
    height = regular if height is None else positive("height", height)
    points = np.vstack([base, [-height, 0.0, 0.0], [height, 0.0, 0.0]])
    around = [(0, 1), (1, 2), (2, 0)]
    groups = {"left": [[3, a, b] for a, b in around], "right": [[4, a, b] for a, b in around]}
    return checked_mesh(points, [[3, 0, 1, 2], [4, 0, 2, 1]], groups)


def bar(length: float, width: float, cells: Sequence[int]) -> Mesh:
    """Square bar along x from the origin, regular boxes cut into six tetrahedra each."""
    # Kuhn's cut: all six tetrahedra share the box's diagonal, so that neighbouring boxes match.
    # Body number = 6 * box + path; boxes run fastest along z.
    boxes = _checked_cells(length, width, cells)
    index = np.arange(np.prod(boxes + 1)).reshape(boxes + 1)
    grid = np.stack(np.meshgrid(*(np.arange(n + 1) for n in boxes), indexing="ij"), axis=-1)
    points = grid.reshape(-1, 3) / boxes * np.array([length, width, width], dtype=float)
    tetrahedra = _kuhn(index)
    return checked_mesh(points, tetrahedra, _sides(grid.reshape(-1, 3), boxes, tetrahedra))


def placed_together(parts: dict, keep_coincident: bool = False) -> Mesh:
    """Several solids as one mesh, not bonded to each other; bodies in the order of the parts."""
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


def drawn_out(
    loops: Sequence[np.ndarray],
    depth: float,
    element: float,
    sides: Mapping[str, OnOutline],
    scatter: int | None = None,
) -> Mesh:
    """A solid from z = 0 to a depth; groups back (z = 0), front, and the sides by name."""
    flat, triangles = triangulated(loops, element)
    layers = max(1, round(depth / (_LAYER * element)))
    heights = np.linspace(0.0, depth, layers + 1)
    points = np.hstack([np.tile(flat, (layers + 1, 1)), np.repeat(heights, len(flat))[:, None]])
    # Which way prisms are cut follows from numbers: in their order all would be cut alike.
    rank = np.random.default_rng(len(flat)).permutation(len(flat))
    layered = [_prisms(triangles, rank, k, len(flat)) for k in range(layers)]
    tetrahedra = np.vstack(layered)
    if scatter is not None:
        outline = _outline(loops)
        near = _ON * element
        tests = (
            lambda x: _is_inside(x[:, :2], *outline),
            lambda x: _distance(x[:, :2], *outline) < near,
        )
        points, tetrahedra = scattered(points, tetrahedra, *tests, element, scatter)
    groups = _groups(points, geometry.outer_faces(tetrahedra), depth, sides)
    solid = checked_mesh(points, tetrahedra, groups)
    return solid if scatter is None else in_space_order(solid)


def _prisms(triangles, rank, layer, count):
    """Three tetrahedra for each prism: neighbours match, as low ranks go first in each of them."""
    order = np.argsort(rank[triangles], axis=1)
    low = np.take_along_axis(triangles, order, axis=1)
    # Every second layer is the mirror image, so that no direction is preferred.
    near, far = (layer, layer + 1) if layer % 2 == 0 else (layer + 1, layer)
    (a, b, c), (d, e, f) = (low + near * count).T, (low + far * count).T
    parts = [np.stack(rows, axis=1) for rows in ((a, b, c, f), (a, b, e, f), (a, d, e, f))]
    return np.vstack(parts)


def _groups(points, outer, depth, sides):
    """Faces of the two ends, and of the sides: those with all corners there."""
    z = points[outer, 2]
    ends = {"back": (z == 0.0).all(axis=1), "front": (z == depth).all(axis=1)}
    between = ~(ends["back"] | ends["front"])
    for name, on in sides.items():
        ends[name] = between & on(points[outer, :2]).all(axis=1)
    return {name: outer[chosen] for name, chosen in ends.items()}


def triangulated(loops: Sequence[np.ndarray], element: float) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 2) and triangles (m, 3), anticlockwise; the points of the loops come first."""
    starts, ends = _outline(loops)
    draw = np.random.default_rng(1)
    points = np.vstack([starts, _inner_points(starts, ends, element)])
    for _ in range(_ROUNDS):
        triangles = _inner_triangles(points, starts, ends, element, draw)
        _smooth(points, triangles, len(starts))
    return points, triangles


def _outline(loops):
    """Starts and ends of all sides of an outline and its holes [m], two arrays (n, 2)."""
    return np.vstack(loops), np.vstack([np.roll(loop, -1, axis=0) for loop in loops])


def _inner_triangles(points, starts, ends, element, draw):
    """Triangles that fill the region; InputError where they do not."""
    wanted = 0.5 * float((starts[:, 0] * ends[:, 1] - ends[:, 0] * starts[:, 1]).sum())
    for radius in _RADII:
        triangles = _delaunay(points, radius * element, _SHIFT * element, draw)
        triangles = triangles[_is_inside(points[triangles].mean(axis=1), starts, ends)]
        if abs(float(_areas(points, triangles).sum()) - wanted) <= _AREA * wanted:
            return triangles
    raise InputError(
        f"element must be smaller, to fit into the narrowest place of this shape, got {element:g} m"
    )


def _inner_points(starts, ends, element):
    """Lattice of triangles inside the outline, away from it."""
    low, high = starts.min(axis=0), starts.max(axis=0)
    count = np.ceil((high - low) / (element * np.array([1.0, np.sqrt(0.75)]))).astype(int) + 1
    column, row = np.meshgrid(np.arange(count[0]), np.arange(count[1]), indexing="ij")
    x = (column + 0.5 * (row % 2)).ravel() * element
    lattice = np.stack([x, row.ravel() * element * np.sqrt(0.75)], axis=1)
    lattice += 0.5 * (low + high - lattice.min(axis=0) - lattice.max(axis=0))
    lattice = lattice[_is_inside(lattice, starts, ends)]
    return lattice[_distance(lattice, starts, ends) > _FROM_OUTLINE * element]


def _distance(points, starts, ends):
    """Distance of points from the nearest of some sides [m], (n,)."""
    nearest = np.full(len(points), np.inf)
    for start, side in zip(starts, ends - starts):
        arm = points - start
        share = np.clip(dot(arm, side) / dot(side, side), 0.0, 1.0)
        away = arm - share[:, None] * side
        nearest = np.minimum(nearest, np.sqrt(dot(away, away)))
    return nearest


def _is_inside(points, starts, ends):
    """Whether points lie inside the outline and outside its holes, (n,): rays to the right."""
    (x, y), inside = points.T, np.zeros(len(points), dtype=bool)
    for (x0, y0), (x1, y1) in zip(starts, ends):
        between = (y0 > y) != (y1 > y)
        inside[between] ^= x0 + (y[between] - y0) * (x1 - x0) / (y1 - y0) > x[between]
    return inside


def _delaunay(points, radius, shift, draw):
    """Triangles of points whose circles hold no other point, each once, anticlockwise."""
    # Imported here, so that matplotlib loads only where a solid is made.
    from matplotlib.tri import Triangulation

    # Of points on one circle any triangulation is right, and all triangles must choose the same.
    moved = points + shift * draw.uniform(-1.0, 1.0, points.shape)
    corners = np.sort(Triangulation(*moved.T).triangles, axis=1)
    a, b, c = (moved[corners[:, k]] for k in range(3))
    sides = dot(a - b, a - b) * dot(b - c, b - c) * dot(c - a, c - a)
    # The product of the sides is four times the radius times the area.
    small = sides < (4.0 * radius * _areas(moved, corners)) ** 2
    triangles = np.unique(corners[small], axis=0)
    return np.where((_areas(points, triangles) < 0.0)[:, None], triangles[:, ::-1], triangles)


def _areas(points, triangles):
    """Areas of triangles [m2], negative where they are clockwise, (m,)."""
    corner = points[triangles]
    a, b = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
    return 0.5 * (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])


def _smooth(points, triangles, fixed):
    """Move the points behind the fixed ones to the middle of the triangles around them."""
    for _ in range(_MOVES):
        area = np.abs(_areas(points, triangles))
        middle = points[triangles].mean(axis=1) * area[:, None]
        corner, weight = triangles.ravel(), np.repeat(area, 3)
        sums = [np.bincount(corner, np.repeat(part, 3), len(points)) for part in middle.T]
        around = np.bincount(corner, weight, len(points))
        mean = np.stack(sums, axis=1) / np.where(around > 0.0, around, 1.0)[:, None]
        points[fixed:] = mean[fixed:]


def circle(centre: Any, diameter: float, element: float) -> np.ndarray:
    """Corners of a regular polygon on a circle, about an element apart, (k, 2), anticlockwise."""
    count = max(8, round(np.pi * diameter / element))
    angle = 2.0 * np.pi * np.arange(count) / count
    return np.asarray(centre) + 0.5 * diameter * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def divided(corners: Any, element: float) -> np.ndarray:
    """Corners of a polygon with points between them, about an element apart, (k, 2)."""
    corners, parts = np.asarray(corners, dtype=float), []
    for start, end in zip(corners, np.roll(corners, -1, axis=0)):
        count = max(1, round(float(np.sqrt(((end - start) ** 2).sum())) / element))
        parts.append(start + (end - start) * (np.arange(count) / count)[:, None])
    return np.vstack(parts)


def join(*meshes: Mesh, names: Sequence[str] | None = None, bonded: bool = False) -> Mesh:
    """Make one mesh of several.

    Parameters
    ----------
    *meshes : Mesh
        Meshes at the places where they are (``Mesh.moved``); bodies keep this order.
    names : sequence of str, optional
        Names of the meshes: first, second, ... by default.
    bonded : bool, default False
        Whether bonds join the meshes where faces match, corner by corner; else they stay apart.

    Returns
    -------
    Mesh
        Each mesh is a body group of its name. Its groups are named NAME_GROUP; groups of equal
        names are also joined under that name. Faces that have become inner ones leave their groups.

    Examples
    --------
    >>> cube = shapes.block(0.1, element=0.1)
    >>> two = join(cube, cube.moved(by=(0.2, 0.0, 0.0)), names=["left", "right"])
    >>> sorted(two.body_groups)
    ['left', 'right']
    """
    for place, mesh in enumerate(meshes):
        instance(f"mesh {place}", mesh, Mesh)
    parts = dict(zip(_checked_names(names, len(meshes)), ((mesh, (0, 0, 0)) for mesh in meshes)))
    _refuse_clashes({name: mesh for name, (mesh, _) in parts.items()})
    flag("bonded", bonded)
    points = np.vstack([mesh.points for mesh in meshes])
    near = geometry.close_pairs(points, COINCIDENT * np.ptp(points, axis=0).max())
    together = placed_together(parts, keep_coincident=len(near) > 0)
    return _bonded(together) if bonded else together


def _checked_names(names, count):
    """A name for each mesh."""
    if count < 2:
        raise InputError(f"join must have at least two meshes, got {count}")
    given = several("names", _NAMES[:count] if names is None else names, word)
    if len(given) != count or len(set(given)) < count:
        raise InputError(f"names must be {count} different names, got {shown(names)}")
    return given


def _refuse_clashes(parts):
    """Raise InputError where NAME_GROUP is the name of a group that is there already."""
    for kind, taken in (("groups", ()), ("body_groups", parts)):
        own = [(name, group) for name, mesh in parts.items() for group in getattr(mesh, kind)]
        names = [f"{name}_{group}" for name, group in own]
        for name, count in Counter([*names, *{*taken, *(group for _, group in own)}]).items():
            if count > 1:
                raise InputError(
                    "names must give each group a name of its own, but two groups would be "
                    f"{name}: give other names"
                )


def _bonded(mesh):
    """The mesh with points at one place made one, so that faces on them are shared."""
    shortest = geometry.edge_lengths(mesh.points, mesh.tetrahedra).min()
    label = weld_labels(mesh.points, mesh.tetrahedra, _WELD * shortest, [])
    tetrahedra = label[mesh.tetrahedra]
    groups = {name: label[faces] for name, faces in mesh.groups.items()}
    number, *members = geometry.numbers_in(geometry.all_faces(tetrahedra), *groups.values())
    shared = np.flatnonzero(np.bincount(number) == 2)
    for (name, own), mine in zip(mesh.groups.items(), members):
        inner = np.isin(mine, shared)
        if not inner.all():
            groups[name] = label[own[~inner]]
    bonded = checked_mesh(mesh.points, tetrahedra, groups, body_groups=mesh.body_groups)
    before, after = (len(np.unique(joined_bodies(block.tetrahedra))) for block in (mesh, bonded))
    if after == before:
        raise InputError(
            "bonded must be False for meshes that share no face: corners of their faces "
            "must coincide, got none that do"
        )
    return bonded


def in_space_order(mesh: Mesh) -> Mesh:
    """Return the mesh with its bodies in the order of Morton's curve through their centres.

    Parameters
    ----------
    mesh : Mesh
        Mesh.

    Returns
    -------
    Mesh
        The same bodies with other numbers; points and groups of faces stay, body groups follow.

    Notes
    -----
    Bonds follow, as they are sorted by their bodies. Messages and files use the new numbers. Bodies
    in one cell, a millionth of the longest side wide, keep their order.

    References
    ----------
    G. M. Morton, A computer oriented geodetic data base, IBM, 1966.
    """
    instance("mesh", mesh, Mesh)
    order = np.argsort(_morton(mesh.points[mesh.tetrahedra].mean(axis=1)), kind="stable")
    place = np.argsort(order)
    groups = {name: place[bodies] for name, bodies in mesh.body_groups.items()}
    return replace(mesh, tetrahedra=mesh.tetrahedra[order], body_groups=groups)


def _morton(places):
    """Place on the curve of points (n, 3): the bits of their three cell numbers in turn."""
    away = places - places.min(axis=0)
    cells = (away * ((2**_BITS - 1) / max(away.max(), 1e-300))).astype(np.uint64)
    key = np.zeros(len(places), dtype=np.uint64)
    for bit in range(_BITS):
        for axis in range(3):
            on = (cells[:, axis] >> np.uint64(bit)) & np.uint64(1)
            key |= on << np.uint64(3 * bit + axis)
    return key
