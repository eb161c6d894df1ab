"""Parts of a mesh that no bond joins: their bodies, where they are, and whether they may meet.

NumPy only: it is asked before a run, and at recording times.
"""

from typing import Any

import numpy as np

from taichi_dem.mesh.mesh import Mesh
from taichi_dem.mesh.tetrahedra import components
from taichi_dem.mesh.topology import bonded_bodies, faces_of_group, topology_of

#: How far a part may come by deforming and breaking, as a share of its longest side. Nobody can
#: know before the run; so parts count as near each other up to the length of one of them.
NEARNESS = 0.5


def parts_of(mesh: Mesh) -> np.ndarray:
    """Number of the part of each body, from 0, (body_count,)."""
    joined = components(mesh.body_count, bonded_bodies(mesh))
    return np.unique(joined, return_inverse=True)[1].reshape(-1)


def part_boxes(corners: np.ndarray, part: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Boxes around parts: lowest and highest coordinates [m], two arrays (part_count, 3).

    corners: of every body [m], (body_count, 4, 3). part: what ``parts_of`` gave.
    """
    order = np.argsort(part, kind="stable")
    first = np.searchsorted(part[order], np.arange(part.max() + 1))
    low = np.minimum.reduceat(corners.min(axis=1)[order], first)
    return low, np.maximum.reduceat(corners.max(axis=1)[order], first)


def any_overlap(low: np.ndarray, high: np.ndarray) -> bool:
    """Whether two boxes overlap; touching is not enough.

    Sorted by where they begin along x, a box is compared with those that begin before its end.
    """
    order = np.argsort(low[:, 0], kind="stable")
    low, high = low[order], high[order]
    ends = np.searchsorted(low[:, 0], high[:, 0])
    return any(
        ((low[k + 1 : end] < high[k]) & (low[k] < high[k + 1 : end])).all(axis=1).any()
        for k, end in enumerate(ends.tolist())
    )


def may_meet(scene: Any, part: np.ndarray) -> bool:
    """Whether parts of a scene at rest may meet, as far as can be known before a run.

    They cannot where nothing moves them, or where uniform acceleration is all that does. Else every
    part may move from its box by a share of its size (``NEARNESS``), by the displacement that
    its loads and supports may cause (``Effect.travel``), and without end along the initial velocity
    that it has beside the mean of all parts; displacements common to all parts do not count, unless
    they are unbounded in all directions, as with gas. scene: a Scene. part: from ``parts_of``.
    """
    drives = [effect for effect in scene.effects if effect.role in ("load", "support")]
    travels = np.array([effect.travel() for effect in drives]).reshape(-1, 2, 3)
    anywhere = np.isinf(travels).all(axis=(1, 2))
    flights = _flights(scene, part)
    weight_only = not any(hasattr(effect, "group") for effect in drives) and not anywhere.any()
    if (weight_only or not travels.any()) and not flights.any():
        return False
    low, high = part_boxes(scene.mesh.points[scene.mesh.tetrahedra], part)
    reach = NEARNESS * (high - low).max(axis=1, keepdims=True)
    low, high = low - reach + flights[0], high + reach + flights[1]
    acts = np.array([parts_under(scene.mesh, effect, part) for effect in drives], dtype=bool)
    acts = acts.reshape(-1, part.max() + 1)
    alike = (acts == acts[:, :1]).all()
    for travel, on in zip(travels[anywhere] if alike else travels, acts[anywhere | ~alike]):
        low[on] += travel[0]
        high[on] += travel[1]
    return any_overlap(low, high)


def _flights(scene, part):
    """Lowest and highest displacement of parts by their initial velocities, (2, part_count, 3)."""
    count = part.max() + 1
    flights = np.zeros((2, count, 3))
    if scene.initial_motion:
        rows = scene.initial_motion["velocity"]
        sums = np.array([np.bincount(part, along, count) for along in rows.T]).T
        velocity = sums / np.bincount(part, minlength=count)[:, None]
        beside = velocity - velocity.mean(axis=0)
        # Rounding of the mean makes no part move against the others.
        moving = np.abs(beside) > 1e-9 * np.abs(velocity).max()
        flights[0][moving & (beside < 0.0)] = -np.inf
        flights[1][moving & (beside > 0.0)] = np.inf
    return flights


def parts_under(mesh: Mesh, effect: Any, part: np.ndarray) -> np.ndarray:
    """Whether a load, support or ground acts on each part, (part_count,)."""
    marks = np.zeros(part.max() + 1, dtype=bool)
    body: slice | np.ndarray = slice(None)
    if hasattr(effect, "group"):
        body, _ = faces_of_group(mesh, topology_of(mesh), effect.group)
    marks[part[body]] = True
    return marks
