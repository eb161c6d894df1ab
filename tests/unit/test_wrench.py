"""Blocks between the relative twist of two bodies and their wrench, against 6x6 matrices."""

import numpy as np
import pytest
import taichi as ti

from taichi_dem.kit.types import mat3, vec3
from taichi_dem.physics.wrench import (
    Block,
    cross_matrix,
    inverse,
    mobility,
    plus,
    point_block,
    zero_block,
)

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
def write(block, out: ti.template()):
    """All 6x6 numbers of a block."""
    for r, c in ti.static(ti.ndrange(3, 3)):
        out[r, c], out[3 + r, 3 + c] = block.a[r, c], block.c[r, c]
        out[r, 3 + c], out[3 + c, r] = block.b[r, c], block.b[r, c]


@ti.kernel
def _cross(given: ti.types.ndarray(ti.f64, ndim=2), out: ti.types.ndarray(ti.f64, ndim=2)):
    for _ in range(1):
        found = cross_matrix(vec3(given[0, 0], given[0, 1], given[0, 2]))
        for r, c in ti.static(ti.ndrange(3, 3)):
            out[r, c] = found[r, c]


@ti.kernel
def _point(given: ti.types.ndarray(ti.f64, ndim=2), out: ti.types.ndarray(ti.f64, ndim=2)):
    for _ in range(1):
        arm = vec3(given[0, 0], given[0, 1], given[0, 2])
        write(point_block(arm, mat_of(given, 1)), out)


@ti.kernel
def _mobility(given: ti.types.ndarray(ti.f64, ndim=2), out: ti.types.ndarray(ti.f64, ndim=2)):
    for _ in range(1):
        branch = vec3(given[0, 0], given[0, 1], given[0, 2])
        matrices = mat_of(given, 1), mat_of(given, 4), mat_of(given, 7), mat_of(given, 10)
        write(mobility(matrices[0], matrices[1], matrices[2], matrices[3], branch), out)


@ti.kernel
def _inverse(given: ti.types.ndarray(ti.f64, ndim=2), out: ti.types.ndarray(ti.f64, ndim=2)):
    for _ in range(1):
        block = Block(a=mat_of(given, 0), b=mat_of(given, 3), c=mat_of(given, 6))
        write(inverse(block), out)


@ti.kernel
def _plus(given: ti.types.ndarray(ti.f64, ndim=2), out: ti.types.ndarray(ti.f64, ndim=2)):
    for _ in range(1):
        one = Block(a=mat_of(given, 0), b=mat_of(given, 3), c=mat_of(given, 6))
        other = Block(a=mat_of(given, 9), b=mat_of(given, 12), c=mat_of(given, 15))
        write(plus(plus(zero_block(), one), other), out)


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


def parts(matrix):
    """The three 3x3 matrices that a block keeps of a 6x6 matrix."""
    return matrix[:3, :3], matrix[:3, 3:], matrix[3:, 3:]


@pytest.fixture(params=range(5))
def random(request):
    """Five sequences of random numbers."""
    return np.random.default_rng(request.param)


def test_cross_matrix_is_the_vector_product(random):
    r, w = random.standard_normal((2, 3))
    # The matrices, not their products: a library rounds a product as its operands lie in memory.
    assert np.array_equal(found(_cross, r)[:3, :3], cross(r))
    assert np.allclose(cross(r) @ w, np.cross(r, w), rtol=0, atol=4 * EPS * norm(r) * norm(w))


def test_point_block_is_the_law_at_a_point(random):
    """J^T law J with J = [1, -[arm]x]: two products in a row, 10 eps of their norms."""
    arm, law = random.standard_normal(3), positive(random)
    jacobian = np.hstack([np.eye(3), -cross(arm)])
    expected = jacobian.T @ law @ jacobian
    error = 10 * EPS * norm(law) * norm(jacobian) ** 2
    assert np.abs(found(_point, arm, law) - expected).max() < error


def test_point_block_gives_force_and_moment_of_the_law(random):
    """A twist (v, w) meets the force f = law (v + w x arm) and its moment arm x f."""
    arm, law = random.standard_normal(3), positive(random)
    velocity, spin = random.standard_normal((2, 3))
    wrench = found(_point, arm, law) @ np.concatenate([velocity, spin])
    force = law @ (velocity + np.cross(spin, arm))
    error = 20 * EPS * norm(law) * (1.0 + norm(arm)) ** 2 * (norm(velocity) + norm(spin))
    assert np.abs(wrench - np.concatenate([force, np.cross(arm, force)])).max() < error


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


def test_mobility_is_free_of_where_it_is_written_down(random):
    """From j's side: twist and wrench at i's centre, branch reversed. X^T carries wrenches over."""
    slack, turn = [positive(random), positive(random)], [positive(random), positive(random)]
    branch = random.standard_normal(3)
    first = found(_mobility, branch, slack[0], turn[0], slack[1], turn[1])
    second = found(_mobility, -branch, slack[1], turn[1], slack[0], turn[0])
    # Twist at i's centre from that at j's: v - w x branch.
    carry = np.eye(6)
    carry[:3, 3:] = cross(branch)
    error = 20 * EPS * norm(first) * norm(carry) ** 2
    assert np.abs(carry @ first @ carry.T - second).max() < error


def test_inverse_undoes_a_block(random):
    """Error of an inverse: eps times the condition number, ten operations deep; symmetric."""
    matrix = positive(random, 6)
    inverted = found(_inverse, *parts(matrix))
    error = 100 * EPS * np.linalg.cond(matrix)
    assert np.abs(inverted @ matrix - np.eye(6)).max() < error
    assert np.abs(inverted - np.linalg.inv(matrix)).max() < error * np.abs(inverted).max()


def test_inverse_bears_the_scales_of_a_bond(random):
    """Dashpots of 1e4 N s/m at arms of 1e-2 m: a in 1e4, b in 1e2, c in 1 N s m."""
    scale = np.diag([100.0] * 3 + [1.0] * 3)
    matrix = scale @ positive(random, 6) @ scale
    inverted = found(_inverse, *parts(matrix))
    product = np.linalg.inv(scale) @ (matrix @ inverted) @ scale
    assert np.abs(product - np.eye(6)).max() < 100 * EPS * np.linalg.cond(matrix)


def test_plus_adds_all_entries(random):
    first, second = positive(random, 6), positive(random, 6)
    assert np.array_equal(found(_plus, *parts(first), *parts(second)), first + second)
