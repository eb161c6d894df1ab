"""Expressions of ``kit.products``: the bits of Taichi's own functions, each argument once."""

import numpy as np
import taichi as ti

from taichi_dem.kit import products

MATRIX, VECTOR = ti.types.matrix(3, 3, ti.f64), ti.types.vector(3, ti.f64)


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
