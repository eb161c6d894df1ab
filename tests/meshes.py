"""Small meshes that several tests share."""

import numpy as np

from taichi_dem import checked_mesh
from taichi_dem.mesh.shapes import bar, single


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
