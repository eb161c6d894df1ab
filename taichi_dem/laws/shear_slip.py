"""Coulomb slip of bonds (Konno et al., 2.1, eq. 1 and 2, Fig. 3)."""

from dataclasses import replace

import taichi as ti

from taichi_dem.kit.products import dot, squared
from taichi_dem.laws.base import HARMLESS, NEAR, Effect
from taichi_dem.materials import Material
from taichi_dem.physics.fracture import coulomb_limit, slip_beyond
from taichi_dem.state.capacity import Capacity


@ti.data_oriented
class ShearSlip(Effect):
    """Shear traction is bounded by cohesion + friction * pressure; beyond it the unit slips.

    Notes
    -----
    The pressure is the spring's part alone and lowers the limit in tension, never below zero.
    Cohesion does not degrade, and slip alone never releases a face.

    References
    ----------
    Konno et al., section 2.1, eq. 1 and 2, Fig. 3.
    """

    role = "shear"
    name = "shear_slip"
    activation = "a unit is sheared to its Coulomb limit"
    remembers_slip = True

    def numbers(self, material: Material) -> tuple[float, ...]:
        """Cohesion [Pa] and friction coefficient."""
        return material.cohesion, material.friction

    def harmless(self, material: Material) -> Material:
        """Cohesion beyond any load."""
        return replace(material, cohesion=HARMLESS * material.tensile_strength)

    def declare(self, capacity: Capacity) -> None:
        """Residual slip of every contact unit."""
        self.slip = ti.Vector.field(2, ti.f64, shape=capacity.units)

    def state(self) -> dict[str, ti.Field]:
        """Residual slip of every unit in the face frame [m]."""
        return {"shear_slip": self.slip}

    @ti.func
    def begins(self, m, stiffness, sliding, pressure):
        """1 where a unit that never slipped comes near its limit at a pressure [Pa], else 0."""
        limit = NEAR * coulomb_limit(self.law[m, 0], self.law[m, 1], pressure)
        return ti.cast(stiffness * stiffness * squared(sliding) > limit * limit, ti.i32)

    @ti.func
    def traction(self, m, stiffness, u, sliding, pressure):
        """Shear traction [Pa] and the energy per area slipped away now [J/m^2]."""
        limit = coulomb_limit(self.law[m, 0], self.law[m, 1], pressure)
        elastic = sliding - self.slip[u]
        spent = 0.0
        # Squares first: almost every unit stays elastic and needs no root.
        if stiffness * stiffness * dot(elastic, elastic) > limit * limit:
            slip = slip_beyond(stiffness, limit, elastic)
            # Mean of the tractions before and after, so that stored plus spent is exact.
            spent = dot(stiffness * (elastic - 0.5 * slip), slip)
            self.slip[u] = self.slip[u] + slip
            elastic -= slip
        return stiffness * elastic, spent

    @ti.func
    def is_active(self, b, u):
        """1 for a unit that has slipped, else 0."""
        return ti.cast(squared(self.slip[u]) > 0.0, ti.i32)

    @ti.func
    def residual_slip(self, u):
        """Residual slip of a unit in the face frame [m]."""
        return self.slip[u]

    @ti.func
    def stored(self, b, u, sliding):
        """Elastic energy per area [J/m^2]."""
        elastic = sliding - self.slip[u]
        return 0.5 * self.tables.bond_stiffness[b][1] * dot(elastic, elastic)
