"""Rotation of all bodies of a scene, from arrays to arrays, by the functions of the step.

The kernels read no field: they are compiled once a session, whatever engines it has.
"""

import numpy as np
import taichi as ti

from taichi_dem.kit.products import matvec, transposed_matvec
from taichi_dem.kit.types import mat3, vec3, vec4
from taichi_dem.physics.rotation import rotation_matrix, spin_of

_ROWS = ti.types.ndarray(dtype=ti.f64, ndim=2)
_MATRICES = ti.types.ndarray(dtype=ti.f64, ndim=3)


def turned_bodies(
    orientation: np.ndarray, spin: np.ndarray, inertia: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Rotation matrices (n, 3, 3) and angular momenta (n, 3) [kg m^2/s] of n bodies.

    orientation: unit quaternions (n, 4). spin: in world axes (n, 3) [rad/s]. inertia: in body axes
    (n, 3, 3) [kg m^2].
    """
    rotation, momentum = np.empty((len(spin), 3, 3)), np.empty((len(spin), 3))
    _turn(orientation, spin, inertia, rotation, momentum)
    return rotation, momentum


def spins(rotation: np.ndarray, inertia_inverse: np.ndarray, momentum: np.ndarray) -> np.ndarray:
    """World spins (n, 3) [rad/s] of n bodies.

    rotation: matrices (n, 3, 3). inertia_inverse: in body axes (n, 3, 3) [1/(kg m^2)]. momentum:
    angular, in world axes (n, 3) [kg m^2/s].
    """
    found = np.empty_like(momentum)
    _find_spins(rotation, inertia_inverse, momentum, found)
    return found


@ti.func
def _vector(rows: ti.template(), i):
    return vec3(rows[i, 0], rows[i, 1], rows[i, 2])


@ti.func
def _matrix(matrices: ti.template(), i):
    found = mat3(0.0)
    for r, c in ti.static(ti.ndrange(3, 3)):
        found[r, c] = matrices[i, r, c]
    return found


@ti.kernel
def _turn(
    orientation: _ROWS, spin: _ROWS, inertia: _MATRICES, rotation: _MATRICES, momentum: _ROWS
):
    for i in range(spin.shape[0]):
        turn = vec4(orientation[i, 0], orientation[i, 1], orientation[i, 2], orientation[i, 3])
        axes = rotation_matrix(turn)
        own = transposed_matvec(axes, _vector(spin, i))
        found = matvec(axes, matvec(_matrix(inertia, i), own))
        for r in ti.static(range(3)):
            momentum[i, r] = found[r]
            for c in ti.static(range(3)):
                rotation[i, r, c] = axes[r, c]


@ti.kernel
def _find_spins(rotation: _MATRICES, inertia_inverse: _MATRICES, momentum: _ROWS, found: _ROWS):
    for i in range(momentum.shape[0]):
        spin = spin_of(_matrix(rotation, i), _matrix(inertia_inverse, i), _vector(momentum, i))
        for r in ti.static(range(3)):
            found[i, r] = spin[r]
