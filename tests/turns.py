"""Rotations in NumPy, apart from the package's own: quaternions are scalar first."""

import numpy as np


def quaternion(axis, angle):
    """Unit quaternion of a rotation about an axis of any length."""
    axis = np.asarray(axis, dtype=float) / np.linalg.norm(axis)
    return np.array([np.cos(angle / 2), *(np.sin(angle / 2) * axis)])


def matrix(q):
    """Rotation matrix of a unit quaternion: cos 1 + sin [n x] + (1 - cos) n n^T."""
    cosine, sine = q[0] ** 2 - q[1:] @ q[1:], 2 * q[0] * q[1:]
    cross = np.array([[0, -sine[2], sine[1]], [sine[2], 0, -sine[0]], [-sine[1], sine[0], 0]])
    return cosine * np.eye(3) + cross + 2 * np.outer(q[1:], q[1:])


def product(p, q):
    """Rotation q followed by rotation p."""
    vector = p[0] * q[1:] + q[0] * p[1:] + np.cross(p[1:], q[1:])
    return np.array([p[0] * q[0] - p[1:] @ q[1:], *vector])
