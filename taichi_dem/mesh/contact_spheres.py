"""Where the contact spheres of a face sit and how large they are (NumPy only).

Konno et al., section 2.2 and Fig. 5.
"""

from dataclasses import dataclass

import numpy as np

from taichi_dem.kit.fixed_order import dot, length, product, transposed
from taichi_dem.mesh.mesh import Mesh
from taichi_dem.mesh.tetrahedra import all_faces, area_vectors

#: Steps towards the centre of a small ball around spheres, and a negligible distance [m].
_CENTRINGS, _SMALL = 10, 1e-300


@dataclass(frozen=True, eq=False)
class ContactSpheres:
    """Spheres of every face of every body in body frames [m]: centre (body_count, 4, n, 3), radius.

    cluster: centre and radius of a ball around those of a face; extent: radius of the ball around
    all of a body.
    """

    centre: np.ndarray
    radius: np.ndarray
    cluster: np.ndarray
    extent: np.ndarray

    @property
    def per_face(self) -> int:
        """Number of spheres on a face."""
        return self.radius.shape[2]


def interior_crossings(divisions: int) -> np.ndarray:
    """Barycentric coordinates (k, 3) of the interior crossings for edges cut in n equal parts."""
    n = divisions
    rows = [(a, b, n - a - b) for a in range(1, n) for b in range(1, n - a)]
    return np.array(rows, dtype=float) / n


def spheres_of_faces(mesh: Mesh, centre: np.ndarray, divisions: int = 5) -> ContactSpheres:
    """Spheres tangent to their own face and as large as the other three faces allow."""
    # Radius: least of d_g / (1 - m_f . m_g) over the other faces g, with d_g the distance of the
    # touching point from face g and m the inward unit normals.
    faces = all_faces(mesh.tetrahedra).reshape(-1, 4, 3)
    corners = mesh.points[faces] - centre[:, None, None, :]
    inward = -area_vectors(mesh.points, faces.reshape(-1, 3)).reshape(-1, 4, 3)
    inward /= length(inward)[..., None]
    touch = product(interior_crossings(divisions), corners)
    height = product(touch, transposed(inward)[:, None])
    height -= dot(corners[:, :, 0], inward)[:, None, None, :]
    slope = 1.0 - product(inward, transposed(inward))
    with np.errstate(divide="ignore", invalid="ignore"):
        allowed = height / slope[:, :, None, :]
    allowed[:, np.arange(4), :, np.arange(4)] = np.inf
    radius = allowed.min(axis=-1)
    middle = touch + radius[..., None] * inward[:, :, None, :]
    extent = (length(middle) + radius).max(axis=(1, 2))
    return ContactSpheres(middle, radius, _clusters(middle, radius), extent)


def _clusters(middle, radius):
    """Small balls around the spheres of each face: centre and radius, (body_count, 4, 4)."""
    # Steps towards the farthest sphere shrink; ten take 7 % off the radius on average, a thousand 9
    # % (Badoiu and Clarkson 2003).
    centre = middle.mean(axis=2)
    for k in range(_CENTRINGS):
        away, reach = _reach(middle, radius, centre)
        far = reach.argmax(axis=2)[..., None]
        towards = np.take_along_axis(away, far[..., None], axis=2)[:, :, 0]
        towards /= np.maximum(length(towards)[..., None], _SMALL)
        centre = centre + towards * reach.max(axis=2)[..., None] / (k + 2)
    reach = _reach(middle, radius, centre)[1].max(axis=2)
    return np.concatenate([centre, reach[..., None]], axis=-1)


def _reach(middle, radius, centre):
    away = middle - centre[:, :, None]
    return away, length(away) + radius
