"""Monitoring of a block with a hole: the displacement of the bodies at its wall."""

import numpy as np

from taichi_dem.kit.fixed_order import dot, length, weakest_direction
from taichi_dem.loads.gas_pressure import GasPressure
from taichi_dem.mesh.tetrahedra import area_vectors, unit_normals
from taichi_dem.mesh.topology import face_vertices, faces_of_group
from taichi_dem.scene import Scene
from taichi_dem.state.model import Model


def watched_groups(scene: Scene) -> tuple[str, ...]:
    """The groups under gas pressure; without gas, one called hole if the mesh has it."""
    groups = [effect.group for effect in scene.effects if isinstance(effect, GasPressure)]
    groups = groups or [name for name in scene.mesh.groups if name == "hole"]
    return tuple(dict.fromkeys(groups))


class HoleMonitor:
    """Displacement at the wall of a hole.

    axis_point (3,) [m] and axis (3,): of the hole. bodies: those with a face on it. outward
    (n, 3): in-plane unit direction from the axis to each body's first centre. monitored: place in
    bodies of the one that is nearest to the closest free face, at mid depth, or at mid depth alone
    where no face along the axis is free.
    """

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
        way = length(away)[:, None]
        self.outward = np.divide(away, way, out=np.zeros_like(away), where=way > 0.0)
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
