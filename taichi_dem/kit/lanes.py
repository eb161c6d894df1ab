"""Several members computed side by side, one per lane of a vector."""

import taichi as ti

from taichi_dem.kit import backend
from taichi_dem.kit.types import real, vec6

#: Members worked on side by side.
LANES = 4

lane_numbers = ti.types.vector(LANES, real)
lane_vectors = ti.types.matrix(3, LANES, real)


@ti.func
def cross(first, second):
    """Cross products, lane by lane."""
    product = lane_vectors(0.0)
    for k in ti.static(range(3)):
        a, b = ti.static((k + 1) % 3, (k + 2) % 3)
        for n in ti.static(range(LANES)):
            product[k, n] = first[a, n] * second[b, n] - first[b, n] * second[a, n]
    return product


@ti.func
def dot(first, second):
    """Scalar products, lane by lane."""
    product = lane_numbers(0.0)
    for n in ti.static(range(LANES)):
        product[n] = (
            first[0, n] * second[0, n] + first[1, n] * second[1, n] + first[2, n] * second[2, n]
        )
    return product


@ti.func
def scaled(numbers, vectors):
    """Vectors times a number a lane."""
    products = lane_vectors(0.0)
    for k in ti.static(range(3)):
        for n in ti.static(range(LANES)):
            products[k, n] = numbers[n] * vectors[k, n]
    return products


@ti.func
def gathered(field: ti.template(), members, first: ti.template()):
    """Three entries of a vector field at each lane's member, from component first on."""
    vectors = lane_vectors(0.0)
    for n in ti.static(range(LANES)):
        entry = field[members[n]]
        for k in ti.static(range(3)):
            vectors[k, n] = entry[first + k]
    return vectors


@ti.func
def gathered_numbers(field: ti.template(), members):
    """Entry of a field of numbers at each lane's member."""
    numbers = lane_numbers(0.0)
    for n in ti.static(range(LANES)):
        numbers[n] = field[members[n]]
    return numbers


@ti.func
def gathered_product(field: ti.template(), members, vectors, turned: ti.template()):
    """Products of the 3x3 matrix at each lane's member, or of its transpose, with its vector."""
    products = lane_vectors(0.0)
    for n in ti.static(range(LANES)):
        entry = field[members[n]]
        if ti.static(turned):
            entry = entry.transpose()
        for r in ti.static(range(3)):
            products[r, n] = (
                entry[r, 0] * vectors[0, n]
                + entry[r, 1] * vectors[1, n]
                + entry[r, 2] * vectors[2, n]
            )
    return products


@ti.func
def product(rows: ti.template(), place, vectors):
    """Products of a 3x3 matrix a lane with the lane's vector; rows: three fields of its rows."""
    products = lane_vectors(0.0)
    for r in ti.static(range(3)):
        row = rows[r][place]
        for n in ti.static(range(LANES)):
            products[r, n] = (
                row[0, n] * vectors[0, n] + row[1, n] * vectors[1, n] + row[2, n] * vectors[2, n]
            )
    return products


@ti.func
def transposed_product(rows: ti.template(), place, vectors):
    """The same with the transposed matrices."""
    products = lane_vectors(0.0)
    first, second, third = rows[0][place], rows[1][place], rows[2][place]
    for r in ti.static(range(3)):
        for n in ti.static(range(LANES)):
            products[r, n] = (
                first[r, n] * vectors[0, n]
                + second[r, n] * vectors[1, n]
                + third[r, n] * vectors[2, n]
            )
    return products


@ti.func
def _put(field: ti.template(), g, k: ti.template(), n, value):
    field[g][k, n] = value


@ti.func
def _put_number(field: ti.template(), g, n, value):
    field[g][n] = value


@ti.func
def _entry(field: ti.template(), g, k: ti.template(), n):
    return field[g][k, n]


@ti.func
def _put_by_branch(field: ti.template(), g, k: ti.template(), n, value):
    for m in ti.static(range(LANES)):
        if m == n:
            field[g][k, m] = value


@ti.func
def _put_number_by_branch(field: ti.template(), g, n, value):
    for m in ti.static(range(LANES)):
        if m == n:
            field[g][m] = value


@ti.func
def _entry_by_branch(field: ti.template(), g, k: ti.template(), n):
    entry = 0.0
    for m in ti.static(range(LANES)):
        if m == n:
            entry = field[g][k, m]
    return entry


def access() -> tuple:
    """What writes component k of lane n of group g, writes lane n of numbers, reads a component."""
    # Only a CPU can index a lane by a number that is unknown when the kernel is compiled.
    if backend.is_cpu():
        return _put, _put_number, _entry
    return _put_by_branch, _put_number_by_branch, _entry_by_branch


@ti.func
def row_of(first, second, n: ti.template()):
    """The vectors of lane n, one after the other: six numbers."""
    return vec6(first[0, n], first[1, n], first[2, n], second[0, n], second[1, n], second[2, n])
