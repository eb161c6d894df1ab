"""Supports that hold bodies at points alone, about which they turn."""

from typing import Any

import numpy as np
import taichi as ti

from taichi_dem.kit.errors import InputError
from taichi_dem.kit.fixed_order import length
from taichi_dem.kit.products import cross, dot, inverse3, matmul, matvec
from taichi_dem.kit.validation import direction, flag, shown
from taichi_dem.mesh.tetrahedra import area_vectors
from taichi_dem.mesh.topology import face_vertices, faces_of_group
from taichi_dem.physics.rotation import spin_of, unit3, world_tensor
from taichi_dem.physics.wrench import cross_matrix
from taichi_dem.state.model import Model

#: Length over width from which on a group is held along its middle line, else at its middle.
_SLENDER = 2.0
#: Digits of the direction of that line: those that every machine agrees on.
_DIGITS = 12


def checked_hinge(turns: bool, about: Any) -> Any:
    """Points of a hinge [m], (1, 3) or (2, 3), or None for those of the group."""
    if about is None:
        return None
    if not flag("turns", turns):
        raise InputError("about must be left out unless turns is True, got " + shown(about))
    try:
        single = np.ndim(about) == 1
        points = [direction("about", point) for point in ([about] if single else about)]
    except (TypeError, ValueError):
        points = []
    if len(points) not in (1, 2) or len({*points}) < len(points):
        raise InputError(
            "about must be a point (x, y, z) or two different points of a line, got " + shown(about)
        )
    return np.array(points)


def hinge_arms(model: Model, group: str, about: np.ndarray | None) -> np.ndarray:
    """From the centre of each body to where it is held [m], (body_count, 3)."""
    points = _middle_of(model, group) if about is None else about
    arm = points[0] - model.centre
    if len(points) == 1:
        return arm
    along = points[1] - points[0]
    along = along / np.sqrt((along**2).sum())
    # To the foot on the line through both points.
    return arm - (arm * along).sum(axis=1)[:, None] * along


def _middle_of(model, group):
    """Middle of a group's area [m], or two points of its middle line where it is slender."""
    body, face = faces_of_group(model.mesh, model.topology, group)
    corners = face_vertices(model.mesh, body, face)
    points = model.mesh.points
    area = length(area_vectors(points, corners))[:, None]
    middle = (area * points[corners].mean(axis=1)).sum(axis=0) / area.sum()
    away = points[np.unique(corners)] - middle
    axes = np.round(np.linalg.eigh(away.T @ away)[1], _DIGITS)
    _, wide, long = np.ptp(away @ axes, axis=0)
    return np.array([middle, middle + axes[:, 2]] if long >= _SLENDER * wide else [middle])


def check_alone(effect: object, given: object, model: Model) -> None:
    """Raise InputError where a support that turns shares a body with another support.

    given: attributes of the effect of the scene, by which it is known among those of the model.
    """
    mine = {*faces_of_group(model.mesh, model.topology, effect.group)[0].tolist()}
    for other in model.supports:
        group = getattr(other, "group", None)
        if vars(other) is given or group is None:
            continue
        both = mine & {*faces_of_group(model.mesh, model.topology, group)[0].tolist()}
        if both:
            raise InputError(
                f"group {effect.group} of {effect.name}, which turns, must not share bodies with "
                f"group {group} of {other.name}, got body {min(both)} in both"
            )


@ti.func
def velocity_at(tables, i, rotation, arm, velocity, momentum):
    """Velocity of a point of body i [m/s]; arm: from its centre, world [m]."""
    return velocity + cross(spin_of(rotation, tables.inertia_inverse[i], momentum), arm)


@ti.func
def mobility_at(tables, i, rotation, arm):
    """Velocity of a point of body i per impulse on it [1/kg], 3x3."""
    across = cross_matrix(arm)
    turn = world_tensor(rotation, tables.inertia_inverse[i])
    return tables.mass_inverse[i] * unit3() - matmul(matmul(across, turn), across)


@ti.func
def pushed_at(tables, i, arm, impulse, velocity, momentum):
    """Velocity and angular momentum of body i after an impulse [N s] on a point of it."""
    return velocity + tables.mass_inverse[i] * impulse, momentum + cross(arm, impulse)


@ti.func
def along_plane(tables, i, rotation, arm, normal, velocity, momentum):
    """Motion of body i of which a point keeps to a plane, by an impulse along its normal."""
    leaves = dot(normal, velocity_at(tables, i, rotation, arm, velocity, momentum))
    gives = dot(normal, matvec(mobility_at(tables, i, rotation, arm), normal))
    return pushed_at(tables, i, arm, -leaves / gives * normal, velocity, momentum)


@ti.func
def with_point(tables, i, rotation, arm, wanted, velocity, momentum):
    """Motion of body i of which a point has a wanted velocity [m/s], by an impulse on it."""
    lacks = wanted - velocity_at(tables, i, rotation, arm, velocity, momentum)
    impulse = matvec(inverse3(mobility_at(tables, i, rotation, arm)), lacks)
    return pushed_at(tables, i, arm, impulse, velocity, momentum)
