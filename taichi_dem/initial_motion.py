"""Velocities and spins of the bodies of a scene at its start, as a user gives them; NumPy only."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from taichi_dem.kit.errors import InputError
from taichi_dem.kit.validation import direction, real_numbers, shown
from taichi_dem.mesh.mesh import Mesh, volumes


def initial_motion(mesh: Mesh, velocity: Any, spin: Any) -> dict[str, np.ndarray]:
    """Velocity and spin of every body at the start, as options of ``State.set_motion``.

    Parameters
    ----------
    mesh : Mesh
    velocity, spin : options of a ``Scene`` [m/s], [rad/s]

    Returns
    -------
    dict
        Arrays "velocity" [m/s] and "spin" [rad/s], (body_count, 3); empty for bodies at rest.

    Raises
    ------
    InputError
        For anything that gives no three finite numbers for each body, an unknown body group, and
        groups that share a body.
    """
    centre = mesh.points[mesh.tetrahedra].mean(axis=1)
    moves, _ = _rows("velocity", velocity, mesh, centre)
    turns, shared = _rows("spin", spin, mesh, centre)
    for bodies, turn in shared:
        volume = volumes(mesh)[bodies]
        middle = (volume[:, None] * centre[bodies]).sum(axis=0) / volume.sum()
        moves[bodies] = moves[bodies] + np.cross(turn, centre[bodies] - middle)
    if not (moves.any() or turns.any()):
        return {}
    return {"velocity": moves, "spin": turns}


def _rows(name, given, mesh, centre) -> tuple[np.ndarray, list[tuple[np.ndarray, np.ndarray]]]:
    """A row for each body, and bodies with the vector that was given for all of them."""
    if given is None:
        return np.zeros_like(centre), []
    if isinstance(given, Mapping) and given:
        return _by_group(name, given, mesh)
    found = given(centre.copy()) if callable(given) else given
    array = real_numbers(name, found)
    one = array.shape == (3,) and not callable(given)
    if not (one or array.shape == centre.shape):
        raise InputError(
            f"{name} must be three numbers, for all bodies or by body group, or three for each of "
            f"{len(centre)} bodies, as an array or by a function of their centres, "
            f"got {shown(found)}"
        )
    shared = [(np.arange(len(centre)), array)] if one else []
    return np.array(np.broadcast_to(array, centre.shape)), shared


def _by_group(name, given, mesh):
    """The same from vectors by body group; bodies in none are at rest."""
    rows, shared = np.zeros((mesh.body_count, 3)), []
    taken = np.zeros(mesh.body_count, dtype=bool)
    for group, value in given.items():
        try:
            bodies = mesh.group_bodies(group)
        except InputError as error:
            raise InputError(
                f"{name} must have names of body groups, got {shown(given)}: {error}"
            ) from None
        vector = np.array(direction(f"{name}[{group!r}]", value))
        if taken[bodies].any():
            raise InputError(
                f"{name} must have each body in one group at most, got body "
                f"{bodies[taken[bodies]][0]} in {group} and in another"
            )
        rows[bodies], taken[bodies] = vector, True
        shared.append((bodies, vector))
    return rows, shared
