"""Meshes and loose blocks that several experiments and tests share."""

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from taichi_dem import CONCRETE, Mesh, checked_mesh, effects
from taichi_dem.kit.validation import whole
from taichi_dem.mesh.shapes import bar, single
from taichi_dem.mesh.tetrahedra import area_vectors

#: Blocks that stand on a plate by weight and friction: acceleration [m/s2], down along x; springs
#: softer than those of concrete, for long steps: a block sinks in by a micrometre; step [s].
GRAVITY, SOFT, STEP = 9.81, 0.01, 1e-5


def with_moved_nodes(mesh: Mesh, most: ArrayLike, seed: int) -> Mesh:
    """The mesh with its nodes moved at random by up to ``most`` [m] along each axis.

    most: for all nodes, or (nodes, 1), for each. Nodes in a plane that bounds the mesh across an
    axis stay in it, so that a bar keeps its form.
    """
    low, extent = mesh.points.min(axis=0), np.ptp(mesh.points, axis=0)
    moved = np.asarray(most) * np.random.default_rng(seed).uniform(-1.0, 1.0, mesh.points.shape)
    near = 1e-9 * extent
    moved[(mesh.points < low + near) | (mesh.points > low + extent - near)] = 0.0
    points, groups = mesh.points + moved, dict(mesh.groups)
    return checked_mesh(points, mesh.tetrahedra, groups, body_groups=mesh.body_groups)


def mirrored_copies(mesh: Mesh, copies: int) -> Mesh:
    """Copies of a block one behind the other along z, each the mirror image of the one before.

    mesh: fills 0 to its depth along z, with flat ends in the groups back (z = 0) and front; as
    mirror images meet, the faces of both match and bond. Groups, of faces and bodies: as in the
    mesh; back and front are those of the ends. Raises InputError as ``checked_mesh``.
    """
    copies = whole("copies", copies, 1, 1_666_666)
    depth = float(mesh.points[:, 2].max())
    points = np.tile(mesh.points, (copies, 1, 1))
    points[1::2, :, 2] = depth - points[1::2, :, 2]
    points[:, :, 2] += depth * np.arange(copies)[:, None]
    # Mirrored points differ from their originals in the last bit.
    unit = 2.0 ** np.ceil(np.log2(np.ptp(mesh.points, axis=0).max()))
    rounded = unit * np.round(points.reshape(-1, 3) / unit, 12)
    points, place = np.unique(rounded, axis=0, return_inverse=True)
    place = place.reshape(copies, -1)
    groups = {name: place[:, faces].reshape(-1, 3) for name, faces in mesh.groups.items()}
    groups["back"] = place[0][mesh.groups["back"]]
    groups["front"] = place[-1][mesh.groups["front" if copies % 2 else "back"]]
    shifts = mesh.body_count * np.arange(copies)[:, None]
    bodies = {name: (shifts + group).ravel() for name, group in mesh.body_groups.items()}
    tetrahedra = place[:, mesh.tetrahedra].reshape(-1, 4)
    return checked_mesh(points, tetrahedra, groups, body_groups=bodies)


def group_area(mesh: Mesh, name: str) -> float:
    """Area of the faces of a group [m2]."""
    vectors = area_vectors(mesh.points, mesh.group_faces(name))
    return float(np.linalg.norm(vectors, axis=1).sum())


def crossings(triangles, normal, place):
    """Where triangles (n, 3, 3) [m] cross the plane at a place on an axis.

    Returns the ends of the lines (m, 2, 3) [m] and which triangle each belongs to (m,). One with a
    corner in the plane counts as lying above it.
    """
    above = triangles[..., normal] >= place
    which = np.flatnonzero(above.any(axis=1) & ~above.all(axis=1))
    crossed, above = triangles[which], above[which]
    # The corner that lies alone on its side: both lines that cross start there.
    alone = np.where(above.sum(axis=1) == 1, above.argmax(axis=1), (~above).argmax(axis=1))
    rows, ends = np.arange(len(which)), []
    first = crossed[rows, alone]
    for k in (1, 2):
        end = crossed[rows, (alone + k) % 3]
        share = (place - first[:, normal]) / (end[:, normal] - first[:, normal])
        ends.append(first + share[:, None] * (end - first))
    return np.stack(ends, axis=1), which


def with_neighbours(edge, heights):
    """A regular tetrahedron with a neighbour on some of its faces, bodies in the order of the dict.

    edge: [m]. heights: of the neighbours over that of a regular one, by the corner opposite to the
    face. Returns the mesh and the unit vectors (n, 3) from body 0 towards the neighbours.
    """
    alone = single(edge)
    corners = alone.points[alone.tetrahedra[0]]
    points, bodies, outward = [*corners], [[0, 1, 2, 3]], []
    for k, height in heights.items():
        face = [j for j in range(4) if j != k]
        bodies.append([*face, len(points)])
        away = corners[face].mean(axis=0) - corners[k]
        points.append(corners[face].mean(axis=0) + height * away)
        outward.append(away / np.linalg.norm(away))
    return checked_mesh(points, bodies, {}), np.array(outward)


def hexahedron(place):
    """A block of six bodies; place: of points (n, 3) of the unit cube, their places [m]."""
    cube = bar(1.0, 1.0, (1, 1, 1))
    return checked_mesh(np.asarray(place(cube.points)), cube.tetrahedra, dict(cube.groups))


def brick(size, corner=(0.0, 0.0, 0.0)):
    """A block of six bodies with edges ``size`` [m] from a corner on."""
    return hexahedron(lambda unit: np.asarray(corner) + unit * np.asarray(size, dtype=float))


def softened(friction):
    """Concrete with all springs softer."""
    names = ("normal_stiffness", "shear_stiffness", "contact_stiffness")
    dashpots = ("normal_damping", "shear_damping", "contact_damping")
    values = {name: SOFT * getattr(CONCRETE, name) for name in names}
    values.update({name: SOFT**0.5 * getattr(CONCRETE, name) for name in dashpots})
    return replace(CONCRETE, friction=friction, fracture_energy=1e5, **values)


def loose(weight=(-GRAVITY, 0.0, 0.0), fixed=("plate_left",), **contact):
    """Effects of blocks that touch and stick, on plates that are held at groups ``fixed``."""
    touch = effects.BondDamping(), effects.BodyContact(**contact), effects.StickingFriction()
    return [*touch, effects.Gravity(tuple(weight)), *map(effects.Fixed, fixed)]
