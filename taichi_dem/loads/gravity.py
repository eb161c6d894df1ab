"""Weight."""

import math
from collections.abc import Sequence

import taichi as ti

from taichi_dem.kit.likely_units import ACCELERATION, in_unit
from taichi_dem.kit.types import vec3
from taichi_dem.kit.validation import direction
from taichi_dem.laws.base import Effect, Travel
from taichi_dem.materials import Material


@ti.data_oriented
class Gravity(Effect):
    """Uniform acceleration of all bodies.

    Parameters
    ----------
    acceleration : sequence of float, default (0.0, -9.81, 0.0)
        Acceleration along x, y and z [m/s^2].

    Examples
    --------
    >>> Gravity((0.0, -1.62, 0.0)).name
    'gravity'
    """

    role = "load"

    def __init__(self, acceleration: Sequence[float] = (0.0, -9.81, 0.0)):
        self._acceleration = direction("acceleration", acceleration)
        in_unit("size of acceleration", math.hypot(*self._acceleration), ACCELERATION)

    def numbers(self, material: Material) -> tuple[float, ...]:
        """Acceleration [m/s^2], three components."""
        return self._acceleration

    def stress(self, material: Material, size: float) -> float:
        """Weight of a column as high as the block."""
        return material.density * size * sum(x * x for x in self._acceleration) ** 0.5

    def travel(self) -> Travel:
        """Without end along the acceleration."""
        low = tuple(-math.inf if x < 0.0 else 0.0 for x in self._acceleration)
        return low, tuple(math.inf if x > 0.0 else 0.0 for x in self._acceleration)

    @ti.func
    def acts_on(self, i):
        """Every body has weight."""
        return 1

    @ti.func
    def wrench(self, i, motion):
        """Force [N] and torque about the centre [N m] on body i."""
        return self.tables.mass[i] * vec3(self.law[0], self.law[1], self.law[2]), vec3(0.0)
