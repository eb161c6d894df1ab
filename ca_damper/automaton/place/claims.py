"""Claims of a step, made in phases: a later phase outranks the earlier ones."""

import taichi as ti

from ca_damper.engine.random_numbers import EVENT, bits, scrambled

#: Phases of a step, by rising rank.
BLOWS, ACROSS, ALONG = range(3)
#: Claims that a cell can make in a phase.
SLOTS = 8


@ti.func
def rank_in_phase(step, shared, phase: ti.template(), cell, slot):
    """Rank of a claim (i64): step, phase, 15 random bits, then cell and slot to tell all apart.

    shared: hash of seed and step.
    """
    chance = scrambled(bits(shared, cell, EVENT) + ti.cast(slot + SLOTS * phase, ti.u32)) >> 17
    low = (ti.cast(chance, ti.i64) << 15) | ti.cast(cell * SLOTS + slot, ti.i64)
    return (ti.cast(step + 1, ti.i64) << 32) | (ti.cast(phase, ti.i64) << 30) | low
