"""Symmetric 6x6 blocks between the relative twist of two bodies and the wrench they exchange."""

import taichi as ti

from taichi_dem.kit.products import inverse3, matmul, matmul_transposed, transposed_matmul
from taichi_dem.kit.types import mat3


@ti.dataclass
class Block:
    """[[a, b], [b^T, c]]: a maps velocity to force, c spin to moment."""

    a: ti.types.matrix(3, 3, ti.f64)
    b: ti.types.matrix(3, 3, ti.f64)
    c: ti.types.matrix(3, 3, ti.f64)


@ti.func
def zero_block():
    """The zero block, as a start for sums."""
    return Block(a=mat3(0.0), b=mat3(0.0), c=mat3(0.0))


@ti.func
def cross_matrix(r):
    """Matrix [r]x with [r]x w = r x w."""
    return mat3([[0.0, -r[2], r[1]], [r[2], 0.0, -r[0]], [-r[1], r[0], 0.0]])


@ti.func
def point_block(arm, law):
    """Block of a law at one point: J^T law J, J = [1, -[arm]x] from the twist to its velocity.

    arm: from where the twist is taken to the point [m]. law: symmetric, force per velocity.
    """
    lever = matmul(law, cross_matrix(arm))
    return Block(a=law, b=-lever, c=transposed_matmul(cross_matrix(arm), lever))


@ti.func
def mobility(mass_inverse_i, turn_i, mass_inverse_j, turn_j, branch):
    """Twist of j against i, at j's centre, per unit wrench that pushes them apart there.

    mass_inverse [1/kg] (3, 3), turn: world inverse inertia [1/(kg m^2)], branch: i to j [m].
    """
    across = cross_matrix(branch)
    lever = matmul(across, turn_i)
    return Block(
        a=mass_inverse_i + mass_inverse_j - matmul(lever, across), b=-lever, c=turn_i + turn_j
    )


@ti.func
def coupled_mobility(coupling_i, coupling_j, branch):
    """What ``mobility`` has beside that of two bodies of which an impulse turns the one it moves.

    coupling: velocity of a body per moment on it, and transposed its spin per impulse [1/(kg m)].
    """
    lever = matmul(coupling_i, cross_matrix(branch))
    return Block(a=lever + lever.transpose(), b=coupling_i + coupling_j, c=mat3(0.0))


@ti.func
def plus(first, second):
    """Sum of two blocks."""
    return Block(a=first.a + second.a, b=first.b + second.b, c=first.c + second.c)


@ti.func
def inverse(block):
    """Inverse of a positive definite block, by its Schur complement."""
    first = inverse3(block.a)
    across = matmul(first, block.b)
    last = inverse3(block.c - transposed_matmul(block.b, across))
    b = -matmul(across, last)
    return Block(a=first - matmul_transposed(b, across), b=b, c=last)
