"""Accounting that conserves momentum: all but gravity acts on the container."""

from typing import ClassVar

import taichi as ti

from ca_damper.automaton.accounting.uncounted import Uncounted
from ca_damper.automaton.impulse_balance import quanta


@ti.data_oriented
class AllImpulses(Uncounted):
    """Every impact and push counts, and so do losses to the six directions of the lattice.

    The container holds the lattice, so impulses of the lattice act on it. Momentum is then
    conserved, and the mean force is the weight.
    """

    labels: ClassVar[tuple[str, str]] = ("ca_all", "ca_static")
    effects: ClassVar[tuple[str, ...]] = ("ejection",)
    static_contact: ClassVar[bool] = True
    counts_all: ClassVar[bool] = True

    @ti.func
    def clear(self, s):
        """Nothing to clear."""

    @ti.func
    def wall_impulse(self, s, cell, gain):
        """Count an impact [quanta]."""
        return quanta(gain)

    @ti.func
    def push(self, s, gain):
        """Count a push [quanta]."""
        return quanta(gain)

    @ti.func
    def lattice_impulse(self, s, item: ti.template(), gain):
        """Count a gain that the lattice causes [quanta]."""
        return quanta(gain)
