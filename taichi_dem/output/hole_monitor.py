"""A block with a hole: displacement at its wall, peak velocities over the distance."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from taichi_dem.kit.data_table import data_frame
from taichi_dem.kit.display import by_fields
from taichi_dem.kit.fixed_order import dot, length, weakest_direction
from taichi_dem.kit.validation import flag, positive, word
from taichi_dem.loads.pressure import GasPressure
from taichi_dem.mesh.tetrahedra import area_vectors, unit_normals
from taichi_dem.mesh.topology import face_vertices, faces_of_group
from taichi_dem.scene import Scene
from taichi_dem.state.model import Model

#: Bodies below which no power is fitted.
_FEWEST = 10


def watched_groups(scene: Scene) -> tuple[str, ...]:
    """The groups under gas pressure; without gas, one called hole if the mesh has it."""
    groups = [effect.group for effect in scene.effects if isinstance(effect, GasPressure)]
    groups = groups or [name for name in scene.mesh.groups if name == "hole"]
    return tuple(dict.fromkeys(groups))


class HoleMonitor:
    """Displacement at the wall of a hole."""

    def __init__(self, model: Model, group: str):
        mesh, topology = model.mesh, model.topology
        body, face = faces_of_group(mesh, topology, group)
        corners = face_vertices(mesh, body, face)
        area = area_vectors(mesh.points, corners)
        middle = mesh.points[corners].mean(axis=1)
        weight = length(area)
        normal = area / weight[:, None]
        # No wall face has a normal along the axis: it is the weakest direction among the normals.
        self.axis = weakest_direction((area[:, :, None] * normal[:, None, :]).sum(axis=0))
        self.axis_point = (weight[:, None] * middle).sum(axis=0) / weight.sum()
        self.bodies, self._wall = np.unique(body), mesh.points[np.unique(corners)]
        self.first = model.centre[self.bodies]
        away = self._in_plane(self.first - self.axis_point)
        # A body in the middle of what is loaded, where that is no hole, has no way outward.
        distance = length(away)[:, None]
        self.outward = np.divide(away, distance, out=np.zeros_like(away), where=distance > 0.0)
        self.monitored = self._nearest_to_free_face(model, body, face)

    def _in_plane(self, vectors):
        return vectors - dot(vectors, self.axis)[:, None] * self.axis

    def _nearest_to_free_face(self, model, hole_body, hole_face):
        mesh, topology = model.mesh, model.topology
        outer = 4 * topology.outer_body + topology.outer_face
        free = ~np.isin(outer, 4 * hole_body + hole_face)
        corners = face_vertices(mesh, topology.outer_body[free], topology.outer_face[free])
        normal = unit_normals(mesh.points, corners)
        distance = dot(mesh.points[corners[:, 0]] - self.axis_point, normal)
        distance[np.abs(dot(normal, self.axis)) > 0.5] = np.inf
        depth = np.abs(dot(self.first - self.axis_point, self.axis))
        if not np.isfinite(distance).any():
            return int(depth.argmin())
        toward = normal[distance.argmin()]
        return int((dot(self.first - self.axis_point, toward) - depth).argmax())

    @property
    def radius(self) -> float:
        """Mean distance of the points of the wall from the axis [m]."""
        return float(length(self._in_plane(self._wall - self.axis_point)).mean())

    def radial_displacement(self, position: np.ndarray) -> float:
        """Mean displacement of the hole's bodies away from its axis [m]; position (n, 3)."""
        moved = position[self.bodies] - self.first
        return float(dot(moved, self.outward).mean())

    def monitored_displacement(self, position: np.ndarray) -> float:
        """Displacement of the monitored body [m]."""
        return float(length(position[self.bodies[self.monitored]] - self.first[self.monitored]))


def hole_of(model: Model, group: str) -> HoleMonitor:
    """The monitor of a group, which is made once for a model."""
    if word("group", group) not in model.holes:
        model.holes[group] = HoleMonitor(model, group)
    return model.holes[group]


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
        Whether a body is nearer to the axis than to any side of the block, shape (body_count,).
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
    """Measure the attenuation in a run."""
    hole, points = hole_of(model, group), model.mesh.points
    radius = hole.radius if radius is None else positive("radius", radius)
    away = model.centre - hole.axis_point
    away = np.linalg.norm(away - np.outer(away @ hole.axis, hole.axis), axis=1)
    ends = model.centre - points.min(axis=0), points.max(axis=0) - model.centre
    return Attenuation(away / radius, peak_speed, away < np.minimum(*ends).min(axis=1))
