"""How peak particle velocities fall with the distance from a blast hole."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from taichi_dem.kit.data_table import data_frame
from taichi_dem.kit.display import by_fields
from taichi_dem.kit.validation import flag, positive
from taichi_dem.output.hole_monitor import HoleMonitor
from taichi_dem.state.model import Model

#: Bodies below which no power is fitted.
_FEWEST = 10


@dataclass(frozen=True, eq=False)
class Attenuation:
    """Peak velocities of bodies over their scaled distance from a hole.

    Parameters
    ----------
    distance : ndarray
        From the hole's axis, in radii of the hole, shape (body_count,).
    speed : ndarray
        Largest speed of each body [m/s], shape (body_count,).
    inner : ndarray
        Whether a body is nearer to the axis than to any side of the block, shape (body_count,);
        elsewhere the wave comes back.
    """

    distance: np.ndarray
    speed: np.ndarray
    inner: np.ndarray

    __repr__ = by_fields

    @property
    def table(self) -> Any:
        """A DataFrame, a row a body: distance in radii, peak speed, whether it is an inner one."""
        columns = {
            "body": np.arange(len(self.speed)),
            "distance_by_radius": self.distance,
            "peak_speed_m_s": self.speed,
            "is_inner": self.inner,
        }
        return data_frame(columns)

    def power_law(self, nearest: float, inner_only: bool = True) -> tuple[float, float]:
        """Fit a power of the distance by least squares.

        Parameters
        ----------
        nearest : float
            Number of radii below which bodies are left out.
        inner_only : bool
            Whether the inner bodies alone are fitted.

        Returns
        -------
        exponent : float
            Power of the distance, a pure number; NaN where fewer than ten bodies are left.
        speed : float
            Speed of the fit at one radius [m/s]; NaN likewise.
        """
        positive("nearest", nearest, zero_allowed=True)
        flag("inner_only", inner_only)
        taken = (self.inner | (not inner_only)) & (self.distance > nearest) & (self.speed > 0.0)
        if taken.sum() < _FEWEST:
            return np.nan, np.nan
        slope, level = np.polyfit(np.log(self.distance[taken]), np.log(self.speed[taken]), 1)
        return float(slope), float(np.exp(level))


def attenuation_of(
    model: Model, peak_speed: np.ndarray, group: str, radius: float | None = None
) -> Attenuation:
    """Measure the attenuation in a run.

    Parameters
    ----------
    model : Model
    peak_speed : ndarray
        Largest speed of each body [m/s], shape (body_count,).
    group : str
        Face group of the hole's wall.
    radius : float, optional
        Radius of the hole [m]; that of the points of its wall by default.

    Returns
    -------
    Attenuation
    """
    hole, points = HoleMonitor(model, group), model.mesh.points
    radius = hole.radius if radius is None else positive("radius", radius)
    away = model.centre - hole.axis_point
    away = np.linalg.norm(away - np.outer(away @ hole.axis, hole.axis), axis=1)
    ends = model.centre - points.min(axis=0), points.max(axis=0) - model.centre
    return Attenuation(away / radius, peak_speed, away < np.minimum(*ends).min(axis=1))
