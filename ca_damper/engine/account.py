"""Account of the momentum along x that a filling and its container give each other."""

import numpy as np
import taichi as ti

from ca_damper.scenes.scene_fields import SceneFields


@ti.data_oriented
class MomentumAccount:
    """What fillings should have gained, less what they gave to the container and their weight.

    Counted from the end of the first step, when all that is carried moves along.

    weight: of a particle [N]. expected: momentum that a filling should have [kg m/s]. late: part of
    it that what is carried takes over at its next step [kg m/s]. exchanged: sum of the magnitudes
    of what was given [N s].
    """

    def __init__(self, table: SceneFields):
        self.table, self.weight = table, ti.field(ti.f64, shape=())
        for name in ("expected", "late", "exchanged"):
            setattr(self, name, table.field(ti.f64))

    @ti.kernel
    def load(self, weight: ti.f64):
        """Take over the weight of a particle [N]."""
        self.weight[None] = weight

    @ti.func
    def begin(self, s, momentum, late):
        """The first step is over; what the filling has now is right."""
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
        """Momentum out of nothing as a share of what was exchanged, of the worst scene.

        momentum: of the fillings, at the start of the last step for what is carried (scenes,).
        """
        late, expected, exchanged = map(
            self.table.in_use, (self.late, self.expected, self.exchanged)
        )
        missing = np.abs(momentum + late - expected)
        return float((missing / np.where(exchanged > 0.0, exchanged, np.inf)).max())
