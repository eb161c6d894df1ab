"""Parts that automata of all rules have in common on the device."""

from typing import Any

import numpy as np
import taichi as ti

from ca_damper.automaton.lattice import Geometry
from ca_damper.scenes.scene_fields import SceneFields
from taichi_dem.kit.effect_usage import EffectUse


@ti.data_oriented
class LatticeDevice:
    """Numbers, momentum and counts of events; rules of their own have ``reset`` and ``advance``.

    velocity: of the container at the beginning of the last step [m/s], (scenes,).
    """

    def __init__(self, table: SceneFields, components: Any, placement: Any):
        self.table, self.parameters, self.lattice = table, components.parameters, components.lattice
        self.cells, self.conflict_resolution = components.cells, components.conflict_resolution
        self.resting, self.event_counts = components.resting, components.event_counts
        self.placement = placement
        self.velocity = table.field(ti.f64)

    def load(self, options: Any) -> None:
        """Take over the numbers of an automaton of the same structure."""
        self.lattice.load(Geometry(options.columns, options.rows))
        self.parameters.load(options)
        self.placement.load(options.start)

    @ti.func
    def place_all(self, s):
        """Particles at rest in their first cells, which are clear; nothing has happened."""
        self.conflict_resolution.clear(s)
        self.resting.clear(s)
        self.event_counts.clear(s)
        self.placement.fill(s)
        self.velocity[s] = 0.0

    @ti.func
    def momentum(self, s):
        """Momentum along x [kg m/s]; held particles move as the container did last."""
        total = self.resting.count(s) * self.velocity[s]
        for cell in range(self.lattice.cell_count()):
            total += self.cells.vertical_speed(s, cell)
        return self.parameters.mass[None] * total

    def uses(self, effects: tuple[str, ...]) -> tuple[EffectUse, ...]:
        """How often each of the named effects acted."""
        return self.event_counts.uses(effects)

    def first_steps(self, effects: tuple[str, ...]) -> dict[str, np.ndarray]:
        """Step in which each counted effect first acted, infinite if never, (scenes,)."""
        return self.event_counts.first_steps(effects)
