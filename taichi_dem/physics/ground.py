"""A body on dashpots to ground at rest, over one step."""

import taichi as ti

from taichi_dem.kit.products import matvec, transposed_matvec
from taichi_dem.physics.rotation import unit3
from taichi_dem.physics.wrench import Block, inverse, plus


@ti.func
def braked_twist(mass, inertia, resistance, momentum, spin_momentum, dt):
    """Mean velocity and spin of a body over a step dt [s], as its dashpots leave them.

    mass [kg], inertia (world, [kg m^2]). resistance: a ``Block`` of the dashpots. momentum,
    spin_momentum: of the body without them, the mean of before and after the step.
    With p the latter, M the inertia of both and C the resistance, the body loses dt C u at the mean
    twist u, which is thus u = (M + dt C / 2)^-1 p: the trapezoidal rule. It is stable for any C,
    and leaves the limit of springs and other dashpots as it is: with w the frequency and d the rate
    of those, the roots of z^2 - (1 + a - b (w dt)^2) z + a, a = (1 - d dt - c) / (1 + c), b = 1 /
    (1 + c), c = dt C / (2 M), lie within the unit circle while (w dt)^2 + 2 d dt < 4, for any c.
    """
    half = 0.5 * dt
    slowed = plus(
        Block(a=mass * unit3(), b=0.0 * inertia, c=inertia),
        Block(a=half * resistance.a, b=half * resistance.b, c=half * resistance.c),
    )
    return twist_of(inverse(slowed), momentum, spin_momentum)


@ti.func
def twist_of(block, first, second):
    """Product of a block and a pair of vectors: a twist from a wrench, or the reverse."""
    return (
        matvec(block.a, first) + matvec(block.b, second),
        transposed_matvec(block.b, first) + matvec(block.c, second),
    )
