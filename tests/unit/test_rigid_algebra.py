"""Products, rotations and 6x6 blocks of two bodies, in kernels and arrays, are those of NumPy.

Expressions of ``kit.products``: the bits of Taichi's own functions, each argument once.
Lanes compute what one member alone would, to the bit.
"""

import numpy as np
import pytest
import taichi as ti

from taichi_dem.kit import lanes, products
from taichi_dem.kit.lanes import LANES, by_lane
from taichi_dem.kit.types import mat3, vec3
from taichi_dem.physics.rotation_arrays import spins, turned_bodies
from taichi_dem.physics.wrench import mobility, point_block

EPS = np.finfo(float).eps
norm = np.linalg.norm

#: How NumPy writes each product: sums over k of what stands at the same k.
SUMS = {
    "matvec": lambda a, b: a.T[:, :, None] * b[0][:, None, None],
    "transposed_matvec": lambda a, b: a[:, :, None] * b[0][:, None, None],
    "matmul": lambda a, b: a.T[:, :, None] * b[:, None, :],
    "matmul_transposed": lambda a, b: a.T[:, :, None] * b.T[:, None, :],
    "transposed_matmul": lambda a, b: a[:, :, None] * b[:, None, :],
}
MATRIX, VECTOR = ti.types.matrix(3, 3, ti.f64), ti.types.vector(3, ti.f64)
BODIES = 11


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
def _products(given: ti.types.ndarray(ti.f64, ndim=2), out: ti.types.ndarray(ti.f64, ndim=3)):
    for _ in range(1):
        a, b, v = mat_of(given, 0), mat_of(given, 3), vec_of(given, 3)
        vectors = products.matvec(a, v), products.transposed_matvec(a, v)
        matrices = (
            products.matmul(a, b),
            products.matmul_transposed(a, b),
            products.transposed_matmul(a, b),
        )
        for r, k in ti.static(ti.ndrange(3, 2)):
            out[k, r, 0] = vectors[k][r]
        for r, c, k in ti.static(ti.ndrange(3, 3, 3)):
            out[2 + k, r, c] = matrices[k][r, c]


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


def test_products_are_sums_from_the_first_column_to_the_last_to_the_bit(random):
    given, out = random.normal(size=(6, 3)), np.zeros((5, 3, 3))
    _products(given, out)
    for got, sums in zip(out, SUMS.values()):
        terms = sums(given[:3], given[3:])
        wanted = (terms[0] + terms[1]) + terms[2]
        assert got[:, : wanted.shape[1]].tobytes() == wanted.tobytes()


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


@pytest.fixture
def bodies(random):
    """Unit quaternions, spins [rad/s] and tensors of inertia [kg m^2] of some bodies."""
    turn = random.normal(size=(7, 4))
    inertia = np.array([positive(random) for _ in turn])
    return turn / norm(turn, axis=1, keepdims=True), random.normal(size=(7, 3)), inertia


def test_momentum_is_inertia_times_spin_in_world_axes_and_gives_the_spin_back(bodies):
    _, spin, inertia = bodies
    rotation, momentum = turned_bodies(*bodies)
    world = rotation @ inertia @ rotation.transpose(0, 2, 1)
    size = norm(inertia, axis=(1, 2)) * norm(spin, axis=1)
    error = norm(momentum - np.einsum("nij,nj->ni", world, spin), axis=1)
    assert (error < 32 * EPS * size).all()
    back = spins(rotation, np.linalg.inv(inertia), momentum)
    # Errors grow by the condition of the tensor.
    bound = 64 * EPS * np.linalg.cond(inertia) * norm(spin, axis=1)
    assert (norm(back - spin, axis=1) < bound).all()


@ti.kernel
def both(
    m: ti.types.ndarray(dtype=MATRIX, ndim=1),
    v: ti.types.ndarray(dtype=VECTOR, ndim=2),
    found: ti.types.ndarray(dtype=ti.f64, ndim=3),
):
    """Own result and Taichi's side by side: dot, norm (of squared), cross, inverse."""
    for i in range(found.shape[0]):
        a, b, one = v[i, 0], v[i, 1], m[i]
        for k in ti.static(range(3)):
            found[i, k, 0], found[i, k, 1] = products.cross(a, b)[k], a.cross(b)[k]
            for r in ti.static(range(3)):
                found[i, 3 + 3 * k + r, 0] = products.inverse3(one)[k, r]
                found[i, 3 + 3 * k + r, 1] = one.inverse()[k, r]
        found[i, 12, 0], found[i, 12, 1] = products.dot(a, b), a.dot(b)
        found[i, 13, 0], found[i, 13, 1] = products.norm(one), one.norm()


def test_products_have_the_bits_of_taichis_own():
    rng = np.random.default_rng(1)
    found = np.zeros((50, 14, 2))
    both(rng.normal(size=(50, 3, 3)), rng.normal(size=(50, 2, 3)), found)
    assert np.array_equal(found[..., 0], found[..., 1]) and np.count_nonzero(found) == found.size


@ti.func
def counted(count: ti.template(), value):
    count[None] = count[None] + 1
    return value


@ti.kernel
def evaluate(count: ti.template()) -> ti.f64:
    """A product whose argument counts how often it is evaluated."""
    return products.dot(counted(count, ti.Vector([1.0, 2.0, 3.0])), ti.Vector([1.0, 1.0, 1.0]))


def test_an_argument_is_evaluated_once():
    count = ti.field(ti.i32, shape=())
    assert evaluate(count) == 6.0 and count[None] == 1


@ti.data_oriented
class Operations:
    """Vectors and matrices of some bodies, and what lanes make of them."""

    def __init__(self):
        self.vector = ti.Vector.field(6, ti.f64, shape=BODIES)
        self.number = ti.field(ti.f64, shape=BODIES)
        self.matrix = ti.Matrix.field(3, 3, ti.f64, shape=BODIES)
        self.rows = tuple(ti.Matrix.field(3, LANES, ti.f64, shape=2) for _ in range(3))
        self.made = {
            name: ti.Matrix.field(3, LANES, ti.f64, shape=())
            for name in ("cross", "scaled", "gathered", "turned", "product", "transposed")
        }
        self.dot = ti.Vector.field(LANES, ti.f64, shape=())
        self.row = ti.Vector.field(6, ti.f64, shape=LANES)

    @ti.kernel
    def work(self, first: ti.i32):
        """Apply every function to bodies first, first + 2 and so on."""
        for _ in range(1):
            members = lanes.lane_indices(0)
            for n in ti.static(range(LANES)):
                members[n] = first + 2 * n
            one = lanes.gathered(self.vector, members, 0)
            other = lanes.gathered(self.vector, members, 3)
            self.made["gathered"][None] = other
            self.made["cross"][None] = lanes.cross(one, other)
            numbers = lanes.gathered_numbers(self.number, members)
            self.made["scaled"][None] = lanes.scaled(numbers, one)
            self.made["turned"][None] = lanes.gathered_product(self.matrix, members, one)
            self.made["product"][None] = lanes.product(self.rows, 1, one)
            self.made["transposed"][None] = lanes.transposed_product(self.rows, 1, one)
            self.dot[None] = lanes.dot(one, other)
            for n in ti.static(range(LANES)):
                self.row[n] = lanes.row_of(one, other, n)


@pytest.fixture(scope="module")
def operations():
    made, random = Operations(), np.random.default_rng(3)
    for field in (made.vector, made.number, made.matrix, *made.rows):
        field.from_numpy(random.normal(size=field.to_numpy().shape))
    made.work(1)
    return made


def applied(matrices, vectors):
    """Matrices times vectors, summed from the first column to the last."""
    total = matrices[..., 0] * vectors[:, 0, None]
    for k in (1, 2):
        total = total + matrices[..., k] * vectors[:, k, None]
    return total


def test_each_lane_has_the_bits_of_its_member(operations):
    members = 1 + 2 * np.arange(LANES)
    both = operations.vector.to_numpy()[members]
    one, other = both[:, :3], both[:, 3:]
    block = np.stack([by_lane(row.to_numpy())[LANES:] for row in operations.rows], axis=1)
    following, third = np.roll(np.arange(3), -1), np.roll(np.arange(3), -2)
    wanted = {
        "gathered": other,
        "cross": one[:, following] * other[:, third] - one[:, third] * other[:, following],
        "scaled": operations.number.to_numpy()[members, None] * one,
        "turned": applied(operations.matrix.to_numpy()[members], one),
        "product": applied(block, one),
        "transposed": applied(block.swapaxes(1, 2), one),
    }
    for name, values_wanted in wanted.items():
        assert np.array_equal(operations.made[name].to_numpy().T, values_wanted), name
    products = one * other
    dots = products[:, 0] + products[:, 1] + products[:, 2]
    assert np.array_equal(operations.dot.to_numpy(), dots)
    assert np.array_equal(operations.row.to_numpy(), both)
