"""Velocities and spins of the bodies of a scene at its start, as a user gives them; NumPy only."""

from typing import Any, Callable, Union

import numpy as np
from numpy.typing import ArrayLike

from taichi_dem.kit.errors import InputError
from taichi_dem.kit.validation import LARGEST, shown
from taichi_dem.mesh.mesh import Mesh, volumes

#: A vector for all bodies, a row for each, or a function of the centres of the bodies.
Motion = Union[ArrayLike, Callable[[np.ndarray], ArrayLike]]


def initial_motion(mesh: Mesh, velocity: Any, spin: Any) -> dict[str, np.ndarray]:
    """Velocity and spin of every body at the start, as options of ``State.set_motion``.

    Parameters
    ----------
    mesh : Mesh
    velocity, spin : options of a ``Scene`` [m/s], [rad/s]

    Returns:
    -------
    dict
        Arrays "velocity" [m/s] and "spin" [rad/s], (body_count, 3); empty for bodies at rest.

    Raises:
    ------
    InputError
        For anything that gives no three finite numbers for each body.
    """
    centre = mesh.points[mesh.tetrahedra].mean(axis=1)
    moves, _ = _rows("velocity", velocity, centre)
    turns, together = _rows("spin", spin, centre)
    if together:
        moves = moves + np.cross(turns, centre - _middle(mesh, centre))
    if not (moves.any() or turns.any()):
        return {}
    return {"velocity": moves, "spin": turns}


def _rows(name, given, centre):
    """A row for each body, and whether one vector was given for all of them."""
    if given is None:
        return np.zeros_like(centre), False
    found = given(centre.copy()) if callable(given) else given
    try:
        array = np.array(found)
        array = array.astype(np.float64) if array.dtype.kind in "iuf" else np.zeros(0)
    except (TypeError, ValueError, OverflowError):
        array = np.zeros(0)
    one = array.shape == (3,) and not callable(given)
    if not (one or array.shape == centre.shape) or not (np.abs(array) <= LARGEST).all():
        raise InputError(
            f"{name} must be three numbers, or three for each of {len(centre)} bodies, as an array "
            "or by a function of their centres, all finite and none above "
            f"{LARGEST:g}, got {shown(found)}"
        )
    return np.ascontiguousarray(np.broadcast_to(array, centre.shape)), one


def _middle(mesh, centre):
    """Centre of the volume of all bodies [m], (3,)."""
    volume = volumes(mesh)
    return (volume[:, None] * centre).sum(axis=0) / volume.sum()
