"""Lanes compute what one member alone would, to the bit."""

import numpy as np
import pytest
import taichi as ti

from taichi_dem.kit import lanes
from taichi_dem.kit.lanes import LANES, by_lane

BODIES = 11


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
