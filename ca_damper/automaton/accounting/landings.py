"""Accountings of the paper: particles act on the container while they move (6.2).

Only a landing counts: the first impact on a wall after a change of cell. Impacts between a heap and
the floor that it lies on are left out and go to the impulse balance, if there is one.
"""

from typing import Any, ClassVar

import taichi as ti

from ca_damper.automaton.accounting.uncounted import Uncounted
from ca_damper.automaton.impulse_balance import REST, quanta
from ca_damper.scenes.scene_fields import SceneFields


@ti.data_oriented
class Landings(Uncounted):
    """Impacts of particles that came from another cell.

    arrived: 1 for a particle that changed its cell since it last met a wall, shape (scenes, cells +
    1); meaningless in cells without a particle.
    """

    labels: ClassVar[tuple[str, str]] = ("ca_landing", "ca_landing_static")

    def __init__(self, table: SceneFields, lattice: Any, impulse_balance: Any):
        self.impulse_balance, self.lattice = impulse_balance, lattice
        self.arrived = table.field(ti.i8, "cells")

    @ti.func
    def clear(self, s):
        """No particle has moved yet."""
        self.impulse_balance.clear(s)
        for cell in range(self.lattice.cell_count() + 1):
            self.arrived[s, cell] = ti.cast(0, ti.i8)

    @ti.func
    def moved(self, s, origin, target):
        """Follow a particle to another cell."""
        self.arrived[s, target] = self.arrived[s, origin]

    @ti.func
    def arrive(self, s, cell):
        """Note that a particle has flown into a cell."""
        self.arrived[s, cell] = ti.cast(1, ti.i8)

    @ti.func
    def wall_impulse(self, s, cell, gain):
        """Count an impact [quanta] if the particle has changed its cell since the last."""
        result = ti.cast(0, ti.i64)
        if self.arrived[s, cell] == 1:
            result = quanta(gain)
        else:
            self.impulse_balance.add(s, REST, gain)
        self.arrived[s, cell] = ti.cast(0, ti.i8)
        return result


@ti.data_oriented
class LandingsAndPushes(Landings):
    """Landings, and pushes by the walls: closest to the paper's Fig. 11."""

    labels: ClassVar[tuple[str, str]] = ("ca_ejection", "ca_ejection_static")
    effects: ClassVar[tuple[str, ...]] = ("ejection",)

    @ti.func
    def push(self, s, gain):
        """Count a push [quanta]."""
        return quanta(gain)
