"""Rotation of all bodies of a scene, from arrays to arrays, by the functions of the step."""

import numpy as np
import taichi as ti

from taichi_dem.kit import backend
from taichi_dem.kit.launch import Launch
from taichi_dem.kit.products import matvec, transposed_matvec
from taichi_dem.kit.types import mat3, vec3, vec4
from taichi_dem.physics.rotation import rotation_matrix, spin_of

_ROWS = ti.types.ndarray(dtype=ti.f64, ndim=2)
_MATRICES = ti.types.ndarray(dtype=ti.f64, ndim=3)


def angular_momenta(orientation: np.ndarray, spin: np.ndarray, inertia: np.ndarray) -> np.ndarray:
    """Angular momenta (n, 3) of n bodies [kg m^2/s].

    orientation: unit quaternions. spin: in world axes [rad/s]. inertia: in body axes [kg m^2].
    """
    momenta = np.empty((len(spin), 3))
    _launch_momenta(*_rows(orientation, spin, inertia), momenta)
    return momenta


def rotations(orientation: np.ndarray) -> np.ndarray:
    """Rotation matrices (n, 3, 3) of unit quaternions (n, 4)."""
    matrices = np.empty((len(orientation), 3, 3))
    _launch_rotations(*_rows(orientation), matrices)
    return matrices


def spins(orientation: np.ndarray, inertia_inverse: np.ndarray, momentum: np.ndarray) -> np.ndarray:
    """World spins (n, 3) [rad/s] of n bodies.

    orientation: unit quaternions. inertia_inverse: in body axes. momentum: angular, in world axes.
    """
    spin_rates = np.empty((len(momentum), 3))
    _launch_spins(*_rows(orientation, inertia_inverse, momentum), spin_rates)
    return spin_rates


def _rows(*arrays):
    return [np.ascontiguousarray(array, dtype=np.float64) for array in arrays]


@ti.func
def _vector(rows: ti.template(), i):
    return vec3(rows[i, 0], rows[i, 1], rows[i, 2])


@ti.func
def _matrix(matrices: ti.template(), i):
    matrix = mat3(0.0)
    for r, c in ti.static(ti.ndrange(3, 3)):
        matrix[r, c] = matrices[i, r, c]
    return matrix


@ti.func
def _rotation(rows: ti.template(), i):
    return rotation_matrix(vec4(rows[i, 0], rows[i, 1], rows[i, 2], rows[i, 3]))


@ti.kernel
def _find_momenta(orientation: _ROWS, spin: _ROWS, inertia: _MATRICES, found: _ROWS):
    ti.loop_config(serialize=ti.static(backend.is_cpu()))
    for i in range(spin.shape[0]):
        rotation = _rotation(orientation, i)
        own = transposed_matvec(rotation, _vector(spin, i))
        momentum = matvec(rotation, matvec(_matrix(inertia, i), own))
        for r in ti.static(range(3)):
            found[i, r] = momentum[r]


@ti.kernel
def _find_rotations(orientation: _ROWS, found: _MATRICES):
    ti.loop_config(serialize=ti.static(backend.is_cpu()))
    for i in range(orientation.shape[0]):
        rotation = _rotation(orientation, i)
        for r, c in ti.static(ti.ndrange(3, 3)):
            found[i, r, c] = rotation[r, c]


@ti.kernel
def _find_spins(orientation: _ROWS, inertia_inverse: _MATRICES, momentum: _ROWS, found: _ROWS):
    ti.loop_config(serialize=ti.static(backend.is_cpu()))
    for i in range(momentum.shape[0]):
        inverse = _matrix(inertia_inverse, i)
        spin = spin_of(_rotation(orientation, i), inverse, _vector(momentum, i))
        for r in ti.static(range(3)):
            found[i, r] = spin[r]


_launch_momenta, _launch_rotations = Launch(_find_momenta), Launch(_find_rotations)
_launch_spins = Launch(_find_spins)
