"""Rotation of rigid bodies by unit quaternions (scalar first)."""

import taichi as ti

from taichi_dem.kit.elementary import sine_and_cosine
from taichi_dem.kit.products import (
    cross,
    dot,
    matmul,
    matmul_transposed,
    matvec,
    transposed_matmul,
    transposed_matvec,
)
from taichi_dem.kit.types import mat3, vec4

# A chain of divisions would take as long as all else that turns a body.
_6TH, _12TH, _20TH, _30TH, _42TH = (1.0 / n for n in (6, 12, 20, 30, 42))


@ti.func
def quaternion_product(p, q):
    """Hamilton product p q: the rotation q followed by the rotation p."""
    return vec4(
        p[0] * q[0] - p[1] * q[1] - p[2] * q[2] - p[3] * q[3],
        p[0] * q[1] + p[1] * q[0] + p[2] * q[3] - p[3] * q[2],
        p[0] * q[2] - p[1] * q[3] + p[2] * q[0] + p[3] * q[1],
        p[0] * q[3] + p[1] * q[2] - p[2] * q[1] + p[3] * q[0],
    )


@ti.func
def rotation_matrix(q):
    """Matrix that turns body coordinates into world coordinates, for a unit quaternion q."""
    axis = q.yzw
    squares, products, turns = axis * axis, axis * axis.yzx, q[0] * axis.zxy
    diagonal = 1.0 - 2.0 * (squares.yzx + squares.zxy)
    above, below = 2.0 * (products - turns), 2.0 * (products + turns)
    return mat3(
        [
            [diagonal[0], above[0], below[2]],
            [below[0], diagonal[1], above[1]],
            [above[2], below[1], diagonal[2]],
        ]
    )


@ti.func
def turned(q, spin, dt):
    """Orientation after turning at constant world spin [rad/s] for dt [s]: exp(dt spin) q.

    A quarter of the squared angle below 1e-3 takes the power series of sine and cosine, exact to
    round-off there and several times cheaper: steps of a blast turn a body by 1e-6 rad.
    """
    half = 0.5 * dt * spin
    angle2 = dot(half, half)
    sinc = 1.0 - _6TH * angle2 * (1.0 - _20TH * angle2 * (1.0 - _42TH * angle2))
    cosine = 1.0 - 0.5 * angle2 * (1.0 - _12TH * angle2 * (1.0 - _30TH * angle2))
    if angle2 > 1e-3:
        angle = ti.sqrt(angle2)
        sine, cosine = sine_and_cosine(angle)
        sinc = sine / angle
    turn = quaternion_product(vec4(cosine, sinc * half[0], sinc * half[1], sinc * half[2]), q)
    # One Newton step of 1/sqrt is exact here: the norm is 1 to round-off before and after.
    return turn * (1.5 - 0.5 * dot(turn, turn))


@ti.func
def spin_of(rotation, inertia_inverse, angular_momentum):
    """World spin R I^-1 R^T L [rad/s]; inertia_inverse [1/(kg m^2)] in the body frame."""
    own = matvec(inertia_inverse, transposed_matvec(rotation, angular_momentum))
    return matvec(rotation, own)


@ti.func
def world_tensor(rotation, tensor):
    """A tensor of the body frame, as of inertia, in the world frame: R A R^T."""
    return matmul_transposed(matmul(rotation, tensor), rotation)


@ti.func
def place_in(rotation, other, branch):
    """Rotation and place of a body in the frame of another: R^T R' and R^T d.

    rotation: R, of the frame. other: R', of the body. branch: d, between their origins, world [m].
    """
    return transposed_matmul(rotation, other), transposed_matvec(rotation, branch)


@ti.func
def mean_spin(rotation, inertia_inverse, angular_momentum, spin, dt):
    """World spin [rad/s] in the middle of a free turn of dt [s] that begins with the given spin.

    At a constant L the spin changes by J^-1 (L x w), with J^-1 = R I^-1 R^T in the world frame:
    the spin an angular momentum of L + dt/2 L x w has now. With it the turn is of second order.
    """
    ahead = angular_momentum + 0.5 * dt * cross(angular_momentum, spin)
    return spin_of(rotation, inertia_inverse, ahead)


@ti.func
def unit3():
    """The unit matrix."""
    return mat3([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
