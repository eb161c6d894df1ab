"""Mean stress of every body, from the forces on it and where they act (Love; Weber 1966)."""

from collections.abc import Iterator

import numpy as np

from taichi_dem.kit.allocation import values
from taichi_dem.kit.fixed_order import cross, dot, length, members_last, product, transposed
from taichi_dem.loads.pressure import FacePressure
from taichi_dem.mesh.mesh import volumes
from taichi_dem.mesh.tetrahedra import area_vectors
from taichi_dem.mesh.topology import face_vertices, faces_of_group
from taichi_dem.physics.rotation_arrays import rotations
from taichi_dem.report.forces import Forces
from taichi_dem.report.readings import Run
from taichi_dem.state.model import Model, sums


def body_stress(run: Run, forces: Forces) -> np.ndarray:
    """Mean stress of every body now [Pa], (n, 3, 3), symmetric, in world axes, tension positive."""
    model, state, here = run.model, run.state, slice(run.model.body_count)
    position, rotation = values(state.position, here), rotations(values(state.orientation, here))
    total = np.zeros((model.body_count, 3, 3))
    for body, leverage in (
        *_of_bonds(run, position, rotation),
        *_of_contacts(run, position),
        *_of_groups(model, rotation, forces.on_bodies()),
    ):
        total = total + sums(body, leverage, model.body_count)
    return 0.5 * (total + transposed(total)) / volumes(model.mesh)[:, None, None]


def _outer(a, b):
    """Products a (x) b of two stacks of vectors, (n, 3, 3)."""
    return a[:, :, None] * b[:, None, :]


def _of_bonds(run, position, rotation):
    """Bodies and forces times arms of both sides of every bond."""
    model, top = run.model, run.model.topology
    branch = members_last(position[top.slave] - position[top.master])
    force, moment = map(members_last, _wrenches(run, branch))
    on_slave, rotation = map(members_last, (model.bonds["on_slave"], rotation[top.slave]))
    arms = product(on_slave, transposed(rotation))
    middle = arms.mean(axis=1)
    own = _outer(force, middle) + _spread(arms - middle[:, None], moment - cross(middle, force))
    yield top.slave, own
    yield top.master, -own - _outer(force, branch)


def _wrenches(run, branch):
    """Force of each bond on its slave [N], and its moment about the slave's centre [N m]."""
    model, state, top = run.model, run.state, run.model.topology
    level = values(state.level, slice(model.body_count))
    master, slave = level[top.master], level[top.slave]
    step = values(run.schedule.step_seconds)[np.maximum(master, slave)][:, None]
    on_master, on_slave = values(state.slot, slice(4 * model.body_count))[model.bonds["slots"].T]
    pull = on_master[:, :3]
    back = np.hstack([-pull, cross(branch, pull) - on_master[:, 3:]])
    wrench = np.where((master > slave)[:, None], back, on_slave) / step
    return wrench[:, :3], wrench[:, 3:]


def _spread(arms, moment):
    """Forces of the three units of bonds times their arms about the middle, (n, 3, 3) [N m]."""
    normal = cross(arms[:, 1] - arms[:, 0], arms[:, 2] - arms[:, 0])
    normal = normal / length(normal)[:, None]
    twist = dot(moment, normal) / dot(arms, arms).sum(axis=1)
    across = cross(normal[:, None], arms)
    turned = twist[:, None, None] * product(transposed(across), arms)
    return _outer(normal, cross(normal, moment)) + turned


def _of_contacts(run, position):
    """Bodies and forces times arms of both sides of every pair in contact."""
    table, (first, second) = run.readings.contacts_now(), run.readings.near_bodies().T
    force, leverage = 2.0 / table["step"][:, None] * table["on_second"][:, :3], table["leverage"]
    yield first, -leverage
    yield second, leverage - _outer(force, position[second] - position[first])


def _of_groups(
    model: Model, rotation: np.ndarray, forces: np.ndarray
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Bodies and forces times arms of loads, ground and supports that have a group of faces."""
    for effect, force in zip((*model.loads, *model.ground, *model.supports), forces):
        if hasattr(effect, "group"):
            body, face = faces_of_group(model.mesh, model.topology, effect.group)
            corners = face_vertices(model.mesh, body, face)
            area = area_vectors(model.mesh.points, corners)
            arm = model.mesh.points[corners].mean(axis=1) - model.centre[body]
            turned = rotation[body]
            area, arm = (product(turned, vectors[:, :, None])[:, :, 0] for vectors in (area, arm))
            share = _pressed if isinstance(effect, FacePressure) else _shared
            yield body, _outer(share(body, area, force), arm)


def _pressed(body, area, force):
    """Force on each face of a group under one pressure, found from the forces on its bodies."""
    total = sums(body, area, len(force))
    return (force * total).sum() / (total * total).sum() * area


def _shared(body, area, force):
    """Force on each face of a group, of the force on its body the share of its area."""
    size = length(area)
    return (size / np.bincount(body, size, len(force))[body])[:, None] * force[body]
