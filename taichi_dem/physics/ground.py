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
    With p the latter, M the inertia and C the resistance, the mean twist is (M + dt C / 2)^-1 p, by
    the trapezoidal rule. It is stable for any C, and leaves other limits as they are: for springs
    of frequency w and dashpots of rate d, (w dt)^2 + 2 d dt < 4, whatever C.
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
