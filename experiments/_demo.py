"""What the demonstrations of the blast share: several solids in one scene, and their motion."""

import numpy as np

from taichi_dem import checked_mesh


def placed_together(parts):
    """One mesh of several solids that do not touch; bodies in the order of the parts.

    parts: name -> (mesh, shift (3,) [m]). Groups: those of every part as NAME_GROUP, and, under
    its own name, a group of all parts together.
    """
    points, tetrahedra, groups, first = [], [], {}, 0
    for name, (mesh, shift) in parts.items():
        points.append(mesh.points + np.asarray(shift))
        tetrahedra.append(mesh.tetrahedra + first)
        for group, faces in mesh.groups.items():
            groups[f"{name}_{group}"] = faces + first
            groups.setdefault(group, []).append(faces + first)
        first += mesh.point_count
    joined = {key: np.vstack(faces) for key, faces in groups.items()}
    return checked_mesh(np.vstack(points), np.vstack(tetrahedra), joined)


def set_moving(simulation, velocity, moved=0.0, spin=None):
    """Begin with a velocity [m/s], displacement [m] and spin [rad/s] of all bodies, (n, 3) each."""
    centre = simulation.model.centre
    turn = np.tile([1.0, 0.0, 0.0, 0.0], (len(centre), 1))
    simulation.state.set_motion(centre + moved, turn, velocity, spin)
