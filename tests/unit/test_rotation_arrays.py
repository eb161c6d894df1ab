"""Rotation of all bodies at once: L = R I R^T w by NumPy, and back to the spin."""

import numpy as np
import pytest

from taichi_dem.physics.rotation_arrays import spins, turned_bodies

EPSILON = np.finfo(float).eps


@pytest.fixture(scope="module")
def bodies():
    """Unit quaternions, spins [rad/s] and tensors of inertia [kg m^2] of some bodies."""
    draw = np.random.default_rng(5)
    turn, spin = draw.normal(size=(7, 4)), draw.normal(size=(7, 3))
    roots = draw.normal(size=(7, 3, 3))
    return (
        turn / np.linalg.norm(turn, axis=1, keepdims=True),
        spin,
        roots @ roots.transpose(0, 2, 1) + np.eye(3),
    )


def test_axes_of_bodies_are_orthogonal_and_turn_as_the_quaternion_says(bodies):
    rotation, _ = turned_bodies(*bodies)
    assert np.abs(rotation @ rotation.transpose(0, 2, 1) - np.eye(3)).max() < 16 * EPSILON
    assert np.linalg.det(rotation).min() > 0.0
    # The axis (x, y, z) of a unit quaternion stays, its angle is twice the arc cosine of w.
    axis = bodies[0][:, 1:]
    assert np.abs(np.einsum("nij,nj->ni", rotation, axis) - axis).max() < 16 * EPSILON
    trace = np.einsum("nii->n", rotation)
    assert np.abs(trace - (4.0 * bodies[0][:, 0] ** 2 - 1.0)).max() < 16 * EPSILON


def test_momentum_is_inertia_times_spin_in_world_axes_and_gives_the_spin_back(bodies):
    _, spin, inertia = bodies
    rotation, momentum = turned_bodies(*bodies)
    world = rotation @ inertia @ rotation.transpose(0, 2, 1)
    size = np.linalg.norm(inertia, axis=(1, 2)) * np.linalg.norm(spin, axis=1)
    error = np.linalg.norm(momentum - np.einsum("nij,nj->ni", world, spin), axis=1)
    assert (error < 32 * EPSILON * size).all()
    found = spins(rotation, np.linalg.inv(inertia), momentum)
    # Errors grow by the condition of the tensor.
    bound = 64 * EPSILON * np.linalg.cond(inertia) * np.linalg.norm(spin, axis=1)
    assert (np.linalg.norm(found - spin, axis=1) < bound).all()
