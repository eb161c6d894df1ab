"""State of one scene at one time, for pictures."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from taichi_dem.kit.errors import InputError
from taichi_dem.kit.validation import shown


@dataclass(frozen=True, eq=False)
class SceneFrame:
    """Snapshot of one scene.

    Parameters
    ----------
    time_s : float
        Time [s].
    x : float
        Displacement of the container [m].
    y : float
        Displacement of the base [m].
    position : ndarray
        Positions of the particles, horizontal and vertical [m], shape (particles, 2).
    velocity : ndarray
        Velocities of the particles [m/s], shape (particles, 2).
    diameter : ndarray, optional
        Diameter of each particle [m], (particles,), of several sizes; else None.
    """

    time_s: float
    x: float
    y: float
    position: np.ndarray
    velocity: np.ndarray
    diameter: np.ndarray | None = None


def frames_of(batch: Any, present: dict[str, np.ndarray] | None = None) -> tuple[SceneFrame, ...]:
    """A Frame of every scene of a batch as it is now."""
    sample = batch.sample() if present is None else present
    time_s, x, y = (sample[name].tolist() for name in ("time_s", "x", "y"))
    shots = [batch.snapshot(s) for s in range(batch.count)]
    return tuple(
        SceneFrame(time_s[s], x[s], y[s], shot["position"], shot["velocity"], shot.get("diameter"))
        for s, shot in enumerate(shots)
    )


def inner_size(box: Any) -> tuple[float, float, float]:
    """Width and height of the box of an Automaton or Spheres, and diameter of a particle [m]."""
    if hasattr(box, "columns"):
        cell = box.width
        return box.columns * cell, box.rows * cell, cell
    if not hasattr(box, "diameter"):
        raise InputError(f"filling must be an Automaton or Spheres for this, got {shown(box)}")
    return box.width, box.height, box.diameter
