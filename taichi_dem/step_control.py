"""Which step a body may take: one object a rule, asked by the schedule at the body's own times."""

import numpy as np
import taichi as ti

from taichi_dem.fields import then
from taichi_dem.timeline import MAX_LEVEL
from taichi_dem.types import real


@ti.data_oriented
class FixedStep:
    """Every body keeps the largest step."""

    @ti.func
    def wanted(self, level, speed2, low):
        """Level 0, always."""
        return 0


@ti.data_oriented
class Displacement:
    """No body moves by more than a given distance in a step (Konno et al., 3.1).

    distance: l [m]. dt0: step of level 0 [s]. The level is the lowest k with
    dt0 / 2^k <= l / |v|.
    """

    def __init__(self, distance, dt0):
        steps = dt0 / 2.0 ** np.arange(MAX_LEVEL + 1)
        self.speed2 = ti.field(real, shape=MAX_LEVEL + 2)
        then(self.speed2.from_numpy, np.append((distance / steps) ** 2, np.inf))

    @ti.func
    def wanted(self, level, speed2, low):
        """Level for a body now on a level, of squared speed [m^2/s^2]; low: coarsest allowed."""
        k = level
        while speed2 > self.speed2[k] and k < MAX_LEVEL:
            k += 1
        while k > low and speed2 <= self.speed2[ti.max(k - 1, 0)]:
            k -= 1
        return k
