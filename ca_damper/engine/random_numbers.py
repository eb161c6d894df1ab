"""Counter-based random numbers: a hash of (seed, step, cell, purpose), whatever the order.

The output permutation of PCG (O'Neill 2014, RXS-M-XS, 32 bits) used as a mixer.
"""

import taichi as ti

# Purposes in use; a purpose of its own keeps two decisions of one cell apart.
PURPOSES = 8
START, MOVE, EVENT, DEFLECT, HOP, SIDE, GLANCE, LINE = range(8)


@ti.func
def scrambled(word):
    """A permutation of the 32-bit words (u32 -> u32) without visible order."""
    state = word * ti.u32(747796405) + ti.u32(2891336453)
    mixed = ((state >> ((state >> 28) + ti.u32(4))) ^ state) * ti.u32(277803737)
    return (mixed >> 22) ^ mixed


@ti.func
def stream(seed, step):
    """The part of the hash that all cells share in a step, u32; worth taking out of loops."""
    return scrambled(ti.cast(step, ti.u32) + scrambled(ti.cast(seed, ti.u32)))


@ti.func
def bits(shared, cell, purpose: ti.template()):
    """32 random bits for a cell (or particle) and purpose; shared: from ``stream``."""
    return scrambled(shared ^ ti.cast(cell * PURPOSES + purpose, ti.u32))


@ti.func
def unit(word):
    """32 random bits as a number in [0, 1)."""
    return ti.cast(word, ti.f64) * 2.0**-32


@ti.func
def uniform(seed, step, cell, purpose: ti.template()):
    """Number in [0, 1) for a cell (or particle) of a scene with this seed at this step."""
    return unit(bits(stream(seed, step), cell, purpose))
