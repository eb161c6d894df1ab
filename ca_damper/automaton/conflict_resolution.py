"""Resolve conflicting claims to a cell by random rank, in whatever order they come."""

import taichi as ti

from ca_damper.automaton.lattice import Lattice
from ca_damper.engine.random_numbers import EVENT, bits, scrambled

#: Room for cell numbers in a rank.
MOST_CELLS = 1 << 12
#: Claims that a cell can make in a phase.
SLOTS = 8


@ti.func
def rank(step, shared, cell, purpose: ti.template()):
    """Rank of a claimant (i64): step, then 19 random bits, then its cell: no two are equal."""
    chance = ti.cast((bits(shared, cell, purpose) >> 13) << 12, ti.i64)
    return (ti.cast(step + 1, ti.i64) << 32) | chance | ti.cast(cell, ti.i64)


@ti.func
def rank_in_phase(step, shared, phase: ti.template(), cell, slot):
    """Rank of a claim (i64) in one of four phases of a step, of which a later one ranks higher."""
    chance = scrambled(bits(shared, cell, EVENT) + ti.cast(slot + SLOTS * phase, ti.u32)) >> 17
    low = (ti.cast(chance, ti.i64) << 15) | ti.cast(cell * SLOTS + slot, ti.i64)
    return (ti.cast(step + 1, ti.i64) << 32) | (ti.cast(phase, ti.i64) << 30) | low


@ti.data_oriented
class ConflictResolution:
    """Largest rank that ever claimed a cell, shape (scenes, cells + 1)."""

    def __init__(self, lattice: Lattice):
        self.lattice, self.claims = lattice, lattice.table.field(ti.i64, "cells")

    @ti.func
    def clear(self, s):
        """No claims."""
        for cell in range(self.lattice.size.cells[s] + 1):
            self.claims[s, cell] = ti.cast(0, ti.i64)

    @ti.func
    def claim(self, s, cell, ranked):
        """Claim a cell."""
        self.claims[s, cell] = max(self.claims[s, cell], ranked)

    @ti.func
    def holds(self, s, cell, ranked):
        """Whether this claim was the largest."""
        return self.claims[s, cell] == ranked
