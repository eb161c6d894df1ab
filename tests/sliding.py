"""A body that slides on a plate of tetrahedra under its own weight, by contact of faces."""

from dataclasses import replace

import numpy as np

from taichi_dem import CONCRETE, Scene, Simulation, checked_mesh, effects
from taichi_dem.mesh.shapes import bar, placed_together, single
from taichi_dem.mesh.tetrahedra import all_faces

GRAVITY = 9.81
#: Plate: its side and that of its boxes, of six tetrahedra each [m]; the body starts at a corner.
SIDE, BOX = 0.4, 0.4 / 6
#: Step [s] at which sphere springs are stable.
STEP = 2e-6


def tetrahedron():
    """A regular tetrahedron of edge 0.05 m that stands on a face."""
    mesh = single(0.05)
    standing = np.stack([mesh.points[:, 1], -mesh.points[:, 0], mesh.points[:, 2]], axis=1)
    return checked_mesh(standing, mesh.tetrahedra, {})


def plate():
    """A plate with its upper side at y = 0, of bars that are welded; group bottom."""
    boxes = round(SIDE / BOX)
    row = bar(SIDE, BOX, (boxes, 1, 1))
    points = [row.points + np.array([0.0, -BOX, k * BOX]) for k in range(boxes)]
    bodies = [row.tetrahedra + k * row.point_count for k in range(boxes)]
    made = checked_mesh(np.vstack(points), np.vstack(bodies), {}, weld_tolerance=1e-6)
    faces = all_faces(made.tetrahedra)
    below = np.isclose(made.points[faces][:, :, 1], -BOX).all(axis=1)
    return checked_mesh(made.points, made.tetrahedra, {"bottom": faces[below]})


def sliding(body, speed, angle, friction, method):
    """Simulation of a body that slides over a fixed plate at a speed [m/s], and its direction.

    angle: of the direction against the edges of the plate's boxes.
    """
    low, high = body.points.min(axis=0), body.points.max(axis=0)
    place = np.array([0.13, 0.0, 0.13]) - 0.5 * (low + high)
    place[1] = 1e-9 - low[1]
    mesh = placed_together({"plate": (plate(), (0.0, 0.0, 0.0)), "body": (body, place)})
    listed = [
        effects.BondDamping(),
        effects.BodyContact(),
        effects.Friction(),
        effects.Gravity((0.0, -GRAVITY, 0.0)),
        effects.Fixed("plate_bottom"),
    ]
    material = replace(CONCRETE, friction=friction)
    simulation = Simulation(Scene(mesh, material, listed), method)
    direction = np.array([np.cos(angle), 0.0, np.sin(angle)])
    velocity = np.zeros((mesh.body_count, 3))
    velocity[-body.body_count :] = speed * direction
    simulation.state.set_motion(simulation.model.centre, [1.0, 0.0, 0.0, 0.0], velocity)
    return simulation, direction
