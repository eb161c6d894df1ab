"""Account of the momentum along x that a filling and its container exchange."""

import numpy as np
import taichi as ti

from ca_damper.scenes.scene_fields import SceneFields
from taichi_dem.kit.allocation import assign


@ti.data_oriented
class MomentumAccount:
    """Expected momentum of the fillings: the initial one, less that given to container and gravity.

    Counted from the end of the first step, when all carried particles move along.

    weight: of a particle [N]. expected: momentum that a filling should have [kg m/s]. late: part of
    it that the carried mass takes over at its next step [kg m/s]. exchanged: sum of the magnitudes
    of the impulses on the container [N s].
    """

    def __init__(self, table: SceneFields):
        self.table, self.weight = table, ti.field(ti.f64, shape=())
        for name in ("expected", "late", "exchanged"):
            setattr(self, name, table.field(ti.f64))

    def load(self, weight: float) -> None:
        """Take over the weight of a particle [N]."""
        assign(self.weight, weight)

    @ti.func
    def begin(self, s, momentum, late):
        """Start the account after the first step, from the present momentum of the filling."""
        self.expected[s], self.late[s], self.exchanged[s] = momentum + late, late, 0.0

    @ti.func
    def add(self, s, force, late):
        """Book a step with a mean force [N] on the container."""
        dt = self.table.dt[s]
        self.expected[s] = (
            self.expected[s] - (force + self.table.particles[s] * self.weight[None]) * dt
        )
        self.exchanged[s] = self.exchanged[s] + ti.abs(force) * dt
        self.late[s] = late

    def error(self, momentum: np.ndarray) -> float:
        """Error of momentum relative to the momentum exchanged, of the worst scene.

        momentum: of the fillings, (scenes,); at the start of the last step for carried particles.
        NaN of scenes that do not count.
        """
        late, expected, exchanged = map(
            self.table.in_use, (self.late, self.expected, self.exchanged)
        )
        missing = np.abs(momentum + late - expected)
        share = missing / np.where(exchanged > 0.0, exchanged, np.inf)
        return float(np.fmax.reduce(share))
