"""The container of the paper: one mode, on a base that moves by a single sine.

All that RK45 needs of the base is known before: its turn from the beginning of a step to each stage
is the same in every step, so that a step takes two thirds of the time under any excitation.
"""

import taichi as ti

from ca_damper.engine import rk45
from ca_damper.engine.container import MOST_ATTEMPTS, Container
from ca_damper.engine.mount import MountKind
from ca_damper.engine.signals import DeviceExcitation
from ca_damper.scenes.clock import CycleClock, small_turn
from ca_damper.scenes.scene_fields import SceneFields

#: Times of the stages of RK45 at which the turn is needed, as shares of the step.
_STAGES = (1 / 5, 3 / 10, 4 / 5, 8 / 9, 1.0)


@ti.dataclass
class Turning:
    """What acts per mass over the step of a scene: constant but for a part that turns by omega."""

    stiffness: ti.f64
    damping: ti.f64
    constant: ti.f64
    omega: ti.f64
    drive: ti.f64
    quadrature: ti.f64


@ti.data_oriented
class SineContainer(Container):
    """The container on its spring, its base moving by the sine of the scenes' table."""

    def __init__(
        self, table: SceneFields, clock: CycleClock, excitation: DeviceExcitation, kind: MountKind
    ):
        super().__init__(table, clock, excitation, kind)
        self.phase = table.vector(2, ti.f64, len(_STAGES))

    @ti.func
    def begin(self, s):
        """Turns of the base from the beginning of a step to the stages."""
        omega = 2.0 * ti.math.pi * self.table.frequency[s]
        for k in ti.static(range(len(_STAGES))):
            self.phase[s, k] = small_turn(omega * (self.table.dt[s] * _STAGES[k]))

    @ti.func
    def acting(self, s):
        """(K + i w C) y0 is turned by the present phase."""
        circle, y0, per_mass = (
            self.clock.circle[s],
            self.table.base_amplitude[s],
            1.0 / self._mass(s),
        )
        stiffness, damping = self.stiffness[s][0] * per_mass, self.damping[s][0] * per_mass
        omega = 2.0 * ti.math.pi * self.table.frequency[s]
        by_spring, by_dashpot = stiffness * y0, damping * omega * y0
        return Turning(
            stiffness=stiffness,
            damping=damping,
            constant=self.by_filling(s) * per_mass,
            omega=omega,
            drive=by_spring * circle[0] + by_dashpot * circle[1],
            quadrature=by_spring * circle[1] - by_dashpot * circle[0],
        )

    @ti.func
    def change(self, load, t, y):
        """d(x, v)/dt of the container for y = (x, v)."""
        return self.change_at(load, small_turn(load.omega * t), y)

    @ti.func
    def change_at(self, load, turn, y):
        """The same for sine and cosine of omega t, which are the same in every step."""
        pushed = load.drive * turn[1] + load.quadrature * turn[0] + load.constant
        held = load.stiffness * y[0] + load.damping * y[1]
        return ti.Vector([y[1], pushed - held])

    @ti.func
    def slope_of(self, load, y):
        """Where the turn of the base is none."""
        return self.change_at(load, ti.Vector([0.0, 1.0]), y)

    @ti.func
    def integrated(self, s, load):
        """By the turns of the stages in a first attempt: the same bits, half the time."""
        turn = [self.phase[s, k] for k in ti.static(range(len(_STAGES)))]
        before, slope, dt, attempts = self.state[s], self.slope[s], self.table.dt[s], 1
        y, change, gap = rk45.stages(
            self.change_at,
            *(load, turn[0], turn[1], turn[2], turn[3], turn[4], before, slope, dt),
        )
        bounds = self.tolerance[0], self.tolerance[1]
        if not rk45.scaled_norm(gap, before, y, *bounds) <= 1.0:
            y, change, attempts = rk45.integrate(
                self.change, load, 0.0, dt, before, slope, dt, *bounds, MOST_ATTEMPTS
            )
        return y, change, attempts
