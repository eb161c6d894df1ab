"""Several members computed side by side, one per lane of a vector."""

import taichi as ti

from taichi_dem.kit import backend
from taichi_dem.kit.types import real, vec6

#: Members worked on side by side.
LANES = 4

lane_numbers = ti.types.vector(LANES, real)
lane_vectors = ti.types.matrix(3, LANES, real)


@ti.func
def cross(one, other):
    """Cross products, lane by lane."""
    made = lane_vectors(0.0)
    for k in ti.static(range(3)):
        a, b = ti.static((k + 1) % 3, (k + 2) % 3)
        for n in ti.static(range(LANES)):
            made[k, n] = one[a, n] * other[b, n] - one[b, n] * other[a, n]
    return made


@ti.func
def dot(one, other):
    """Scalar products, lane by lane."""
    made = lane_numbers(0.0)
    for n in ti.static(range(LANES)):
        made[n] = one[0, n] * other[0, n] + one[1, n] * other[1, n] + one[2, n] * other[2, n]
    return made


@ti.func
def scaled(numbers, vectors):
    """Vectors times a number a lane."""
    made = lane_vectors(0.0)
    for k in ti.static(range(3)):
        for n in ti.static(range(LANES)):
            made[k, n] = numbers[n] * vectors[k, n]
    return made


@ti.func
def gathered(field: ti.template(), members, first: ti.template()):
    """Three entries of a vector field at each lane's member, from component first on."""
    made = lane_vectors(0.0)
    for n in ti.static(range(LANES)):
        entry = field[members[n]]
        for k in ti.static(range(3)):
            made[k, n] = entry[first + k]
    return made


@ti.func
def gathered_numbers(field: ti.template(), members):
    """Entry of a field of numbers at each lane's member."""
    made = lane_numbers(0.0)
    for n in ti.static(range(LANES)):
        made[n] = field[members[n]]
    return made


@ti.func
def gathered_product(field: ti.template(), members, vectors, turned: ti.template()):
    """Products of the 3x3 matrix at each lane's member, or of its transpose, with its vector."""
    made = lane_vectors(0.0)
    for n in ti.static(range(LANES)):
        entry = field[members[n]]
        if ti.static(turned):
            entry = entry.transpose()
        for r in ti.static(range(3)):
            made[r, n] = (
                entry[r, 0] * vectors[0, n]
                + entry[r, 1] * vectors[1, n]
                + entry[r, 2] * vectors[2, n]
            )
    return made


@ti.func
def product(rows: ti.template(), place, vectors):
    """Products of a 3x3 matrix a lane with the lane's vector; rows: three fields of its rows."""
    made = lane_vectors(0.0)
    for r in ti.static(range(3)):
        row = rows[r][place]
        for n in ti.static(range(LANES)):
            made[r, n] = (
                row[0, n] * vectors[0, n] + row[1, n] * vectors[1, n] + row[2, n] * vectors[2, n]
            )
    return made


@ti.func
def transposed_product(rows: ti.template(), place, vectors):
    """The same with the transposed matrices."""
    made = lane_vectors(0.0)
    first, second, third = rows[0][place], rows[1][place], rows[2][place]
    for r in ti.static(range(3)):
        for n in ti.static(range(LANES)):
            made[r, n] = (
                first[r, n] * vectors[0, n]
                + second[r, n] * vectors[1, n]
                + third[r, n] * vectors[2, n]
            )
    return made


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
    found = 0.0
    for m in ti.static(range(LANES)):
        if m == n:
            found = field[g][k, m]
    return found


def access() -> tuple:
    """What writes component k of lane n of group g, writes lane n of numbers, reads a component."""
    # Only a CPU can index a lane by a number that is unknown when the kernel is compiled.
    if backend.is_cpu():
        return _put, _put_number, _entry
    return _put_by_branch, _put_number_by_branch, _entry_by_branch


@ti.func
def row_of(one, other, n: ti.template()):
    """The vectors of lane n, one after the other: six numbers."""
    return vec6(one[0, n], one[1, n], one[2, n], other[0, n], other[1, n], other[2, n])
