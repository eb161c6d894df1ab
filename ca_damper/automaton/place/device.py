"""Automaton by the rules of place on the device."""

from typing import Any

import numpy as np
import taichi as ti

from ca_damper.automaton.device import LatticeDevice
from ca_damper.automaton.lattice import UP
from ca_damper.automaton.place.blows import Collisions
from ca_damper.automaton.place.grains import Grains, Heap
from ca_damper.automaton.place.transport import Transport
from ca_damper.scenes.gravity import gravity_across
from ca_damper.scenes.scene_fields import SceneFields


@ti.data_oriented
class PlaceAutomaton(LatticeDevice):
    """Grains fly in any direction, and collide where their positions meet."""

    def __init__(self, options: Any, table: SceneFields):
        super().__init__(table, looks_ahead=False)
        self.tilted = gravity_across(options) != 0.0
        grains = Grains(self, options.traversal == "list")
        self._fill(options, grains, Heap(self, grains, None, options.particles_rest), UP)
        self.transport, self.collisions = Transport(self), Collisions(self)

    @ti.func
    def find_blows(self, s, step, motion):
        """First part of a step; returns the blows on the container."""
        self.meet(s, step, motion)
        return self.collisions.blows(s)

    @ti.func
    def energy(self, s):
        """Kinetic and potential energy [J]; held grains move as the container did last."""
        total, sideways = 0.0, self.parameters.sideways[s] * self.parameters.width[s]
        for cell in range(self.lattice.size.cells[s]):
            if self.cells.is_grain(s, cell):
                velocity = self.cells.velocity(s, cell)
                height = self.cells.height(s, cell) - self.cells.offset[s]
                total += 0.5 * velocity.dot(velocity) + self.parameters.gravity[s] * height
                total -= sideways * self.lattice.column_of(s, cell)
        return self.parameters.mass[s] * total

    @ti.func
    def divergence_code(self, s):
        """1 when a grain would cross more than one cell a step, which no rule allows."""
        # 2: others pushed a grain beyond floor or ceiling more often than it could turn over there.
        fastest, farthest, width = 0.0, 0.0, self.parameters.width[s]
        for cell in range(self.lattice.size.cells[s]):
            across = ti.abs(self.cells.across[s, cell])
            fastest = ti.max(fastest, ti.abs(self.cells.speed[s, cell]), across)
            if self.cells.is_grain(s, cell):
                farthest = ti.max(farthest, self.outside(s, cell))
        result = 0 if fastest * self.table.dt[s] < width else 1
        return 2 if farthest > width else result

    @ti.func
    def outside(self, s, cell):
        """By how much a grain is farther out than those at floor and ceiling can be [m]."""
        most = ti.cast(self.lattice.size.rows[s], ti.f64) * self.parameters.width[s]
        height = self.cells.height(s, cell) - self.cells.offset[s]
        return ti.max(-height, height - most)

    def motion_of(self, s: int, kind: np.ndarray, travelled: np.ndarray, speed: np.ndarray) -> Any:
        """Places off the centres of cells, and velocities; grains stand amid their columns."""
        across = self.table.row(self.cells.across, s)[: len(kind)]
        offset = float(self.table.row(self.cells.offset, s))
        shift = np.where(kind == UP, travelled - offset, 0.0)
        return np.column_stack([np.zeros(len(kind)), shift]), np.column_stack([across, speed])
