"""Products, rotations and 6x6 blocks of two bodies, in kernels and arrays, are those of NumPy.

Expressions of ``kit.products``: the bits of Taichi's own functions, each argument once.
Lanes compute what one member alone would, to the bit.
"""

import numpy as np
import pytest
import taichi as ti

from taichi_dem.kit.types import mat3, vec3
from taichi_dem.physics.wrench import mobility, point_block

EPS = np.finfo(float).eps
norm = np.linalg.norm


@ti.func
def mat_of(table: ti.template(), row: ti.i32):
    """Rows row .. row + 2 of a table as a matrix."""
    found = mat3(0.0)
    for r, c in ti.static(ti.ndrange(3, 3)):
        found[r, c] = table[row + r, c]
    return found


@ti.func
def vec_of(table: ti.template(), row: ti.i32):
    """A row of a table as a vector."""
    return vec3(table[row, 0], table[row, 1], table[row, 2])


@ti.func
def write(block, out: ti.template()):
    """All 6x6 numbers of a block."""
    for r, c in ti.static(ti.ndrange(3, 3)):
        out[r, c], out[3 + r, 3 + c] = block.a[r, c], block.c[r, c]
        out[r, 3 + c], out[3 + c, r] = block.b[r, c], block.b[r, c]


@ti.kernel
def _point(given: ti.types.ndarray(ti.f64, ndim=2), out: ti.types.ndarray(ti.f64, ndim=2)):
    for _ in range(1):
        write(point_block(vec_of(given, 0), mat_of(given, 1)), out)


@ti.kernel
def _mobility(given: ti.types.ndarray(ti.f64, ndim=2), out: ti.types.ndarray(ti.f64, ndim=2)):
    for _ in range(1):
        matrices = mat_of(given, 1), mat_of(given, 4), mat_of(given, 7), mat_of(given, 10)
        branch = vec_of(given, 0)
        write(mobility(matrices[0], matrices[1], matrices[2], matrices[3], branch), out)


def found(kernel, *parts):
    """What a kernel makes of vectors and 3x3 matrices, one below the other, (6, 6)."""
    given = np.vstack([np.atleast_2d(part) for part in parts])
    out = np.zeros((6, 6))
    kernel(np.ascontiguousarray(given, dtype=np.float64), out)
    return out


def cross(r):
    """Matrix of r x."""
    return np.cross(r, np.eye(3)).T


def positive(random, size=3):
    """A random symmetric positive definite matrix."""
    root = random.standard_normal((size, size))
    return root @ root.T + 0.1 * np.eye(size)


@pytest.fixture(params=range(2))
def random(request):
    """Sequences of random numbers."""
    return np.random.default_rng(request.param)


def test_point_block_is_the_law_at_a_point(random):
    """J^T law J with J = [1, -[arm]x]: two products in a row, 10 eps of their norms."""
    arm, law = random.standard_normal(3), positive(random)
    jacobian = np.hstack([np.eye(3), -cross(arm)])
    expected = jacobian.T @ law @ jacobian
    error = 10 * EPS * norm(law) * norm(jacobian) ** 2
    assert np.abs(found(_point, arm, law) - expected).max() < error


def moved_apart(slack, turn, branch, wrench):
    """Change of the twist of j against i, at j's centre, by a wrench there on j, less it on i.

    v' = A f and w' = T (moment about the own centre); j's centre on i moves with v_i + w_i x r.
    """
    force, moment = wrench[:3], wrench[3:]
    velocity_i, spin_i = -slack[0] @ force, -turn[0] @ (moment + np.cross(branch, force))
    velocity_j, spin_j = slack[1] @ force, turn[1] @ moment
    linear = velocity_j - velocity_i - np.cross(spin_i, branch)
    return np.concatenate([linear, spin_j - spin_i])


def test_mobility_is_what_an_impulse_on_two_bodies_does(random):
    """Columns from unit wrenches on two bodies with any slack and inertia; symmetric, positive."""
    slack, turn = [positive(random), positive(random)], [positive(random), positive(random)]
    branch = random.standard_normal(3)
    expected = np.array([moved_apart(slack, turn, branch, unit) for unit in np.eye(6)]).T
    block = found(_mobility, branch, slack[0], turn[0], slack[1], turn[1])
    error = 10 * EPS * (norm(slack) + norm(turn) * (1.0 + norm(branch)) ** 2)
    assert np.abs(block - expected).max() < error
    assert np.abs(expected - expected.T).max() < error
    assert np.linalg.eigvalsh(block).min() > 0.0
