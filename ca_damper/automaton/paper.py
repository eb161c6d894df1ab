"""Automaton by the rules of the paper on the device."""

from typing import Any

import numpy as np
import taichi as ti

from ca_damper.automaton.accounting import ACCOUNTINGS
from ca_damper.automaton.cells import Cells
from ca_damper.automaton.collisions import Collisions
from ca_damper.automaton.device import LatticeDevice
from ca_damper.automaton.lattice import DIRECTIONS, DOWN, EMPTY, HELD, WALL, unit_vectors
from ca_damper.automaton.static_contact import StaticContact
from ca_damper.automaton.transport import Accumulator, Transport
from ca_damper.scenes.scene_fields import SceneFields


@ti.data_oriented
class PaperAutomaton(LatticeDevice):
    """Particles fly in six directions, at most a cell a step, and collide with what is ahead."""

    def __init__(self, options: Any, table: SceneFields):
        super().__init__(table, looks_ahead=True)
        self.accounting = ACCOUNTINGS[options.accounting](table, self.lattice)
        self.accumulator = Accumulator(options.accumulator, self.lattice)
        cells = Cells(table, self.lattice, options.traversal == "list", self.accounting)
        resting = StaticContact(self, cells, self.accumulator, options.particles_rest)
        self._fill(options, cells, resting, DOWN)
        self.transport = Transport(self)
        self.collisions = Collisions(self, options.pair_rule == "both")

    @ti.func
    def energy(self, s):
        """Kinetic and potential energy [J]; held particles move as the container did last."""
        total = 0.0
        for cell in range(self.lattice.size.cells[s]):
            kind = self.cells.at(s, cell)
            if kind != EMPTY and kind != WALL:
                speed = self.velocity[s] if kind == HELD else self.cells.speed[s, cell]
                height = self.lattice.height_of(s, cell) * self.parameters.width[s]
                height += self.cells.travelled[s, cell] * self.lattice.upward(kind)
                total += 0.5 * speed * speed + self.parameters.gravity[s] * height
        return self.parameters.mass[s] * total

    @ti.func
    def divergence_code(self, s):
        """1 when a particle would cross more than one cell a step, which no rule allows."""
        fastest = 0.0
        for cell in range(self.lattice.size.cells[s]):
            fastest = max(fastest, self.cells.speed[s, cell])
        return 0 if fastest * self.table.dt[s] < self.parameters.width[s] else 1

    def motion_of(self, s: int, kind: np.ndarray, travelled: np.ndarray, speed: np.ndarray) -> Any:
        """Places off the centres of cells, and velocities, along the direction of each particle."""
        way = np.zeros((len(kind), 2))
        way[kind < DIRECTIONS] = unit_vectors()[kind[kind < DIRECTIONS]]
        return way * travelled[:, None], way * speed[:, None]
