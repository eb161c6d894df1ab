"""Time as an integer: ticks, levels, and the levels active at a tick.

Level k steps by dt0 / 2^k; one tick is the step of the finest level allowed. A level is active at
the multiples of its own step, so a body may refine at any of its own times and coarsen only at
times of the coarser grid (Konno et al., 3.1). Plain integers here, mirrored for kernels below.
"""

import taichi as ti

#: Finest level. 2^20 ticks a macro step let steps fall to a millionth of the largest.
MAX_LEVEL = 20
#: Ticks in the largest step.
MACRO_TICKS = 1 << MAX_LEVEL
#: Value of a tick field for "not yet".
NEVER = -1


def ticks_of(level: int) -> int:
    """Ticks in a step of a level."""
    return 1 << (MAX_LEVEL - level)


def coarsest_active(tick: int) -> int:
    """Lowest level active at a tick; all finer levels are active too."""
    rest = tick % MACRO_TICKS
    return 0 if rest == 0 else MAX_LEVEL - ((rest & -rest).bit_length() - 1)


def next_level(wanted: int, tick: int) -> int:
    """Level that a body active at a tick takes: the wanted one, or the coarsest allowed then."""
    return max(wanted, coarsest_active(tick))


@ti.func
def device_ticks_of(level):
    """``ticks_of`` for kernels."""
    return ti.cast(1, ti.i64) << (MAX_LEVEL - level)


@ti.func
def device_coarsest_active(tick):
    """``coarsest_active`` for kernels."""
    rest = ti.cast(tick & (MACRO_TICKS - 1), ti.i32)
    level = 0
    if rest != 0:
        level = MAX_LEVEL
        while rest & 1 == 0:
            rest = rest >> 1
            level -= 1
    return level
