"""Time as an integer: ticks, levels, and the levels active at a tick (Konno et al., 3.1).

Level k steps by dt0 / 2^k; a tick is the finest level's step. A level is active at multiples of its
step: a body may refine at any of its times and coarsen only at times of the coarser grid.
"""

import taichi as ti

#: Finest level. 2^20 ticks a macro step let steps fall to a millionth of the largest.
MAX_LEVEL = 20
#: Ticks in the largest step.
MACRO_TICKS = 1 << MAX_LEVEL
#: Value of a tick field for "not yet".
NEVER = -1


@ti.func
def ticks_of(level):
    """Ticks in a step of a level."""
    return ti.cast(1, ti.i64) << (MAX_LEVEL - level)


@ti.func
def coarsest_active(tick):
    """Lowest level active at a tick; all finer levels are active too."""
    rest = ti.cast(tick & (MACRO_TICKS - 1), ti.i32)
    level = 0
    if rest != 0:
        level = MAX_LEVEL
        while rest & 1 == 0:
            rest = rest >> 1
            level -= 1
    return level
