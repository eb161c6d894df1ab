"""Dashpots of bonds (Konno et al., 2.1, end; Table 1)."""

import taichi as ti

from taichi_dem.kit.allocation import assign
from taichi_dem.kit.types import real, vec3
from taichi_dem.laws.base import Effect
from taichi_dem.state.capacity import Capacity
from taichi_dem.state.model import Model


@ti.data_oriented
class BondDamping(Effect):
    """Normal and tangential dashpots of bonds, at full strength until the face is released.

    References
    ----------
    Konno et al., section 2.1 and Table 1.
    """

    role = "dashpot"
    name = "bond_damping"
    activation = "bonds are strained at a rate"
    may_be_silent = True

    def declare(self, capacity: Capacity) -> None:
        """Normal and tangential coefficient of every bond per area [Pa s/m]."""
        self.coefficient = ti.Vector.field(2, real, shape=capacity.bonds)

    def load(self, model: Model) -> None:
        """Take the coefficients of the material."""
        assign(self.coefficient, model.bond_damping)

    @ti.func
    def traction(self, b, velocity):
        """Traction [Pa] of bond b at a relative velocity in the face frame [m/s]."""
        c = self.coefficient[b]
        return vec3(c[0] * velocity[0], c[1] * velocity[1], c[1] * velocity[2])
