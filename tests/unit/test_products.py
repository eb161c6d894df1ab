"""Products in kernels are NumPy's sums from the first column to the last, to the bit."""

import numpy as np
import pytest
import taichi as ti

from taichi_dem import runtime
from taichi_dem.kit import products
from taichi_dem.kit.types import mat3, vec3


@ti.data_oriented
class Made:
    """Two matrices and a vector, and what each product makes of them."""

    def __init__(self):
        self.a, self.b = (ti.Matrix.field(3, 3, ti.f64, shape=()) for _ in range(2))
        self.v = ti.Vector.field(3, ti.f64, shape=())
        self.vectors = {name: ti.Vector.field(3, ti.f64, shape=()) for name in VECTORS}
        self.matrices = {name: ti.Matrix.field(3, 3, ti.f64, shape=()) for name in MATRICES}

    @ti.kernel
    def work(self):
        for _ in range(1):
            a, b, v = self.a[None], self.b[None], self.v[None]
            for product, made in ti.static(zip(VECTORS.values(), self.vectors.values())):
                made[None] = product(a, v)
            for product, made in ti.static(zip(MATRICES.values(), self.matrices.values())):
                made[None] = product(a, b)


VECTORS = {name: getattr(products, name) for name in ("matvec", "transposed_matvec")}
MATRICES = {
    name: getattr(products, name) for name in ("matmul", "matmul_transposed", "transposed_matmul")
}
#: How NumPy writes each: sums over k of what stands at the same k.
SUMS = {
    "matvec": lambda a, b, v: a.T[:, :, None] * v[:, None, None],
    "transposed_matvec": lambda a, b, v: a[:, :, None] * v[:, None, None],
    "matmul": lambda a, b, v: a.T[:, :, None] * b[:, None, :],
    "matmul_transposed": lambda a, b, v: a.T[:, :, None] * b.T[:, None, :],
    "transposed_matmul": lambda a, b, v: a[:, :, None] * b[:, None, :],
}


@pytest.fixture(scope="module")
def made():
    runtime.start()
    made, random = Made(), np.random.default_rng(5)
    for field in (made.a, made.b, made.v):
        field.from_numpy(random.normal(size=field.to_numpy().shape))
    made.work()
    return made


@pytest.mark.parametrize("name", SUMS)
def test_a_product_is_its_sum_to_the_bit(made, name):
    terms = SUMS[name](*(field.to_numpy() for field in (made.a, made.b, made.v)))
    found = {**made.vectors, **made.matrices}[name].to_numpy()
    assert found.tobytes() == ((terms[0] + terms[1]) + terms[2]).reshape(found.shape).tobytes()


def test_an_argument_that_is_an_expression_is_computed_as_it_stands():
    out = ti.Vector.field(3, ti.f64, shape=())

    @ti.kernel
    def work():
        for _ in range(1):
            m = mat3([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0], [7.0, 8.0, 10.0]])
            out[None] = products.matvec(2.0 * m, vec3(1.0, 0.0, -1.0) - vec3(0.0, 1.0, 0.0))

    work()
    assert out.to_numpy().tolist() == [-8.0, -14.0, -22.0]
