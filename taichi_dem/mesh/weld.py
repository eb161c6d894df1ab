"""Points that lie together become one (NumPy only)."""

import numpy as np

from taichi_dem.kit.errors import InputError
from taichi_dem.kit.validation import finite, shown
from taichi_dem.mesh import tetrahedra as geometry

#: Points nearer than this share of the mesh's extent count as one and the same place.
COINCIDENT = 1e-9


def weld_labels(points: np.ndarray, tetrahedra: np.ndarray, tolerance: float) -> np.ndarray:
    """For every point the first of those that become one with it, (n,).

    points (n, 3) [m], tetrahedra (m, 4). tolerance: distance up to which points become one [m].
    Raises InputError for a tolerance that would join the ends of an edge.
    """
    if _checked_tolerance(tolerance, points, tetrahedra) == 0.0:
        return np.arange(len(points))
    label = geometry.components(len(points), geometry.close_pairs(points, tolerance))
    _refuse_joined_ends(points, tetrahedra, label, tolerance)
    return label


def _checked_tolerance(tolerance, points, tetrahedra):
    """Refuse a tolerance that would weld the ends of an edge."""
    lengths = geometry.edge_lengths(points, tetrahedra)
    shortest = lengths[lengths > COINCIDENT * np.ptp(points, axis=0).max()].min(initial=np.inf)
    if not (finite(tolerance) and 0.0 <= tolerance < shortest):
        raise InputError(
            f"weld_tolerance must lie in [0, {shortest:.6g}) m, the shortest edge, "
            f"got {shown(tolerance)}"
        )
    return tolerance


def _refuse_joined_ends(points, tetrahedra, label, tolerance):
    """Refuse a tolerance that welds the ends of an edge through points between them."""
    ends = label[tetrahedra[:, geometry.LOCAL_EDGES]]
    lengths = geometry.edge_lengths(points, tetrahedra)
    joined = (ends[..., 0] == ends[..., 1]) & (lengths > tolerance)
    if joined.any():
        raise InputError(
            f"weld_tolerance must be smaller than {tolerance:g} m: it joins the ends of an edge "
            f"of {lengths[joined].min():.6g} m through points between them"
        )
