"""Which body of a mesh holds a point (NumPy only)."""

import numpy as np

from taichi_dem.kit.errors import InputError
from taichi_dem.kit.fixed_order import dot, length
from taichi_dem.mesh import tetrahedra as geometry
from taichi_dem.mesh.mesh import Mesh

#: Share of the mesh's extent by which a point may lie outside of a body: rounding.
_ROUNDING = 1e-9


def body_at(mesh: Mesh, name: str, point: np.ndarray) -> int:
    """Number of the body that holds a point, the lowest where several share it.

    Parameters
    ----------
    mesh : Mesh
    name : str
        Of the point, for the sentence.
    point : array (3,) [m]

    Raises
    ------
    InputError
        For a point in no body, with the nearest body and the distance of its centre.
    """
    corners = mesh.points[geometry.all_faces(mesh.tetrahedra)]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= length(normal)[:, None]
    outside = dot(point - corners[:, 0], normal).reshape(-1, 4).max(axis=1)
    holding = np.flatnonzero(outside <= _ROUNDING * np.ptp(mesh.points, axis=0).max())
    if len(holding):
        return int(holding[0])
    away = length(mesh.points[mesh.tetrahedra].mean(axis=1) - point)
    raise InputError(
        f"{name} must lie in a body, got ({point[0]:g}, {point[1]:g}, {point[2]:g}) m; the centre "
        f"of the nearest, body {away.argmin()}, is {away.min():.3g} m away"
    )
