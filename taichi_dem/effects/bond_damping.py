"""Dashpots of bonds (Konno et al., 2.1, end; Table 1)."""

from dataclasses import replace

import taichi as ti

from taichi_dem.effects.base import Effect
from taichi_dem.kit.types import vec3
from taichi_dem.materials import Material


@ti.data_oriented
class BondDamping(Effect):
    """Normal and tangential dashpots, at full strength until the face is released."""

    role = "dashpot"
    name = "bond_damping"
    activation = "bonds are strained at a rate"

    def numbers(self, material: Material) -> tuple[float, ...]:
        """Normal and tangential damping coefficient [Pa s/m]."""
        return material.normal_damping, material.shear_damping

    def harmless(self, material: Material) -> Material:
        """No damping."""
        return replace(material, normal_damping=0.0, shear_damping=0.0)

    @ti.func
    def traction(self, velocity):
        """Traction [Pa] at a relative velocity in the face frame [m/s]."""
        return vec3(self.law[0] * velocity[0], self.law[1] * velocity[1], self.law[1] * velocity[2])
