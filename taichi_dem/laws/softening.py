"""Softening and fracture of bonds in tension (Konno et al., 2.1, Fig. 4)."""

from dataclasses import replace

import numpy as np
import taichi as ti

from taichi_dem.kit.allocation import assign
from taichi_dem.kit.types import vec2
from taichi_dem.laws.base import HARMLESS, NEAR, Effect
from taichi_dem.materials import Material
from taichi_dem.physics.fracture import envelope_traction, softening_energy
from taichi_dem.state.capacity import Capacity
from taichi_dem.state.model import Model


@ti.data_oriented
class Softening(Effect):
    """Beyond the tensile strength a unit softens along a straight line and fails at zero traction.

    Notes
    -----
    Unloading goes to the origin and the elastic limit moves to where it began; compression keeps
    the full stiffness. One failed unit releases the whole face. Strength and fracture energy are
    those of the material.

    References
    ----------
    Konno et al., section 2.1, Fig. 2.
    """

    role = "tension"
    name = "softening"
    activation = "a unit is opened to its tensile strength"

    def numbers(self, material: Material) -> tuple[float, ...]:
        """Tensile strength [Pa] and opening at failure [m]."""
        return material.tensile_strength, material.failure_opening

    def harmless(self, material: Material) -> Material:
        """Stronger than any load, by a power of two."""
        strength, energy = (
            HARMLESS * material.tensile_strength,
            HARMLESS**2 * material.fracture_energy,
        )
        return replace(material, tensile_strength=strength, fracture_energy=energy)

    def declare(self, capacity: Capacity) -> None:
        """Elastic limit and secant stiffness of every contact unit."""
        self.unit = ti.Vector.field(2, ti.f64, shape=capacity.units)

    def load(self, model: Model) -> None:
        """Set every unit intact."""
        stiffness = np.repeat(model.bond_stiffness[:, 0], 3)
        strength = model.of_bonds(lambda material: material.tensile_strength)
        onset = np.repeat(np.broadcast_to(strength, model.bond_count), 3) / stiffness
        assign(self.unit, np.stack([onset, stiffness], axis=1))

    def state(self) -> dict[str, ti.Field]:
        """Elastic limit [m] and secant stiffness [Pa/m] of every unit."""
        return {"softening_unit": self.unit}

    @ti.func
    def _onset(self, b):
        return self.law[self.tables.bond_pair[b], 0] / self.tables.bond_stiffness[b][0]

    @ti.func
    def begins(self, m, stiffness, opening):
        """1 where an intact unit comes near its strength at an opening [m], else 0."""
        return ti.cast(stiffness * opening > NEAR * self.law[m, 0], ti.i32)

    @ti.func
    def traction(self, m, stiffness, u, opening):
        """Traction [Pa] at a normal opening [m]; raises the elastic limit beyond it."""
        traction = stiffness * opening
        if opening > 0.0:
            unit = self.unit[u]
            if opening > unit[0]:
                onset = self.law[m, 0] / stiffness
                softened = envelope_traction(self.law[m, 0], onset, self.law[m, 1], opening)
                unit = vec2(opening, softened / opening)
                self.unit[u] = unit
            traction = unit[1] * opening
        return traction

    @ti.func
    def failed(self, m, u):
        """1 once the unit has been opened to the failure opening, else 0."""
        return ti.cast(self.unit[u][0] >= self.law[m, 1], ti.i32)

    @ti.func
    def is_active(self, b, u):
        """1 for a unit that has been opened beyond its elastic limit, else 0."""
        return ti.cast(self.unit[u][0] > self._onset(b), ti.i32)

    @ti.func
    def stored(self, b, u, opening):
        """Elastic energy per area [J/m^2] at the present stiffness."""
        stiffness = self.tables.bond_stiffness[b][0]
        if opening > 0.0:
            stiffness = self.unit[u][1]
        return 0.5 * stiffness * opening * opening

    @ti.func
    def spent(self, b, u):
        """Energy per area [J/m^2] that softening has spent in this unit."""
        m = self.tables.bond_pair[b]
        return softening_energy(self.law[m, 0], self._onset(b), self.law[m, 1], self.unit[u][0])

    @ti.func
    def damage(self, b, u):
        """Share of the fracture energy that is spent, 0 intact to 1 failed."""
        m = self.tables.bond_pair[b]
        return self.spent(b, u) / (0.5 * self.law[m, 0] * self.law[m, 1])
