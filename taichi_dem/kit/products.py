"""Products of small matrices and vectors in kernels, summed from the first column to the last."""

from collections.abc import Callable
from functools import cache, reduce
from itertools import product
from operator import add
from typing import Any

import taichi as ti
from taichi._lib import core as ti_core
from taichi.lang import impl
from taichi.lang.expr import Expr

from taichi_dem.kit.types import mat3, real, vec3, vec6

_AXES = range(3)


def once(value: object) -> Any:
    """A value that is evaluated here, where it is used more than once; in Python itself."""
    return impl.expr_init(value) if impl.inside_kernel() else value


def expression(function: Callable[..., Any]) -> Callable[..., Any]:
    """A function that kernels may call as it is; its arguments are evaluated once."""

    def built(*given):
        return function(*map(once, given))

    built.__name__, built.__doc__ = function.__name__, function.__doc__
    # Without this attribute Taichi warns of a function that it does not know.
    built._is_taichi_function = False  # type: ignore[attr-defined]
    return built


def entry(tensor: Any, *place: int) -> Any:
    """An entry of a vector or matrix in an expression."""
    runtime, group = impl.get_runtime(), ti_core.ExprGroup()
    for index in place:
        # Numbers kept for other kernels would crash Taichi: it writes into them.
        group.push_back(Expr(index).ptr)
    info = ti_core.DebugInfo(runtime.get_current_src_info())
    builder = runtime.compiling_callable.ast_builder()
    return Expr(builder.expr_subscript(tensor.ptr, group, info))


@cache
def _tensor(*shape):
    return ti.types.vector(*shape, real) if len(shape) == 1 else ti.types.matrix(*shape, real)


def _products(rows, inner, columns, at_one, at_other):
    """Matrix of sums over k of at_one(r, k) times at_other(k, c)."""
    terms = [
        [[at_one(r, k) * at_other(k, c) for k in range(inner)] for c in range(columns)]
        for r in range(rows)
    ]
    return _tensor(rows, columns)([[reduce(add, sums) for sums in row] for row in terms])


@expression
def matvec(m, v):
    """Product m v."""
    rows, inner = m.get_shape()
    terms = [[entry(m, r, k) * entry(v, k) for k in range(inner)] for r in range(rows)]
    return _tensor(rows)([reduce(add, sums) for sums in terms])


@expression
def transposed_matvec(m, v):
    """Product m^T v."""
    inner, rows = m.get_shape()
    terms = [[entry(m, k, r) * entry(v, k) for k in range(inner)] for r in range(rows)]
    return _tensor(rows)([reduce(add, sums) for sums in terms])


@expression
def matmul(a, b):
    """Product a b."""
    rows, inner = a.get_shape()
    columns = b.get_shape()[1]
    return _products(rows, inner, columns, lambda r, k: entry(a, r, k), lambda k, c: entry(b, k, c))


@expression
def matmul_transposed(a, b):
    """Product a b^T."""
    rows, inner = a.get_shape()
    columns = b.get_shape()[0]
    return _products(rows, inner, columns, lambda r, k: entry(a, r, k), lambda k, c: entry(b, c, k))


@expression
def transposed_matmul(a, b):
    """Product a^T b."""
    inner, rows = a.get_shape()
    columns = b.get_shape()[1]
    return _products(rows, inner, columns, lambda r, k: entry(a, k, r), lambda k, c: entry(b, k, c))


@expression
def dot(a, b):
    """Scalar product of two vectors."""
    return reduce(add, (entry(a, k) * entry(b, k) for k in range(*a.get_shape())))


@expression
def squared(a):
    """Square of the length of a vector, or the sum of the squares of a matrix's entries."""
    places = product(*map(range, a.get_shape()))
    return reduce(add, (entry(a, *place) * entry(a, *place) for place in places))


@expression
def norm(a):
    """Root of ``squared``."""
    return ti.sqrt(squared(a))


@expression
def cross(a, b):
    """Vector product."""
    return vec3(
        [
            entry(a, (k + 1) % 3) * entry(b, (k + 2) % 3)
            - entry(a, (k + 2) % 3) * entry(b, (k + 1) % 3)
            for k in _AXES
        ]
    )


@expression
def inverse3(m):
    """Inverse of a 3x3 matrix, by its cofactors."""

    def minor(r, c):
        """Two products of the entries without row r and column c."""
        r, s, c, d = (r + 1) % 3, (r + 2) % 3, (c + 1) % 3, (c + 2) % 3
        return entry(m, r, c) * entry(m, s, d) - entry(m, s, c) * entry(m, r, d)

    determinant = (
        entry(m, 0, 0) * (entry(m, 1, 1) * entry(m, 2, 2) - entry(m, 2, 1) * entry(m, 1, 2))
        - entry(m, 1, 0) * (entry(m, 0, 1) * entry(m, 2, 2) - entry(m, 2, 1) * entry(m, 0, 2))
        + entry(m, 2, 0) * (entry(m, 0, 1) * entry(m, 1, 2) - entry(m, 1, 1) * entry(m, 0, 2))
    )
    share = once(1.0 / determinant)
    return mat3([[share * minor(c, r) for c in _AXES] for r in _AXES])


@expression
def stacked(first, second):
    """Two vectors as one of six numbers: written at once, as each write looks a field up anew."""
    return vec6([*(entry(first, k) for k in _AXES), *(entry(second, k) for k in _AXES)])
