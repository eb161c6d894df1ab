"""Motion of the container: on its spring, driven by base and filling, or fixed to the base.

Both have ``load`` for the numbers of a batch, and the ti.funcs ``start(s, x, v)``, ``motion(s)`` at
the beginning of a step, with ``base(s)``, the base's displacement [m], ``recoil(s)``, the speed
that a unit impulse gives it [1/kg], and ``advance(s, action)`` over the step, which returns the
attempts of the integration, or -1. Those under any other excitation than a single sine of the base
are in ``excited_container.py``.
"""

import taichi as ti

from ca_damper.engine import rk45
from ca_damper.filling import Action, Motion
from ca_damper.oscillator import Forcing, sine_and_cosine, slope, slope_at_phase
from ca_damper.scenes.clock import Clock
from ca_damper.scenes.scene_fields import SceneFields
from taichi_dem.kit.allocation import assign

#: Attempts within one step of the filling after which the container counts as lost.
MOST_ATTEMPTS = 1000
#: Times of the stages of RK45 at which the forcing is needed, as shares of the step.
_STAGES = (1 / 5, 3 / 10, 4 / 5, 8 / 9, 1.0)


@ti.data_oriented
class IntegratedContainer:
    """Base of containers that RK45 moves on under the action of the filling.

    impulse [N s] and carried [kg] in the present step. gravity [m/s^2]. tolerance: local error
    allowed, rtol and atol, the latter in m and m/s.
    """

    def __init__(self, table: SceneFields):
        self.table = table
        self.impulse, self.carried = table.field(ti.f64), table.field(ti.f64)
        self.gravity = ti.field(ti.f64, shape=())
        self.tolerance = ti.field(ti.f64, shape=2)

    def load(self, gravity: float, rtol: float, atol: float) -> None:
        """Take over the numbers of a batch."""
        assign(self.gravity, gravity)
        assign(self.tolerance, [rtol, atol])


@ti.data_oriented
class SpringContainer(IntegratedContainer):
    """Base of integrated containers with one spring and dashpot each.

    state, slope: displacement and speed, and their change. impulse_velocity: share of the present
    acceleration that is due to impacts [m/s^2].
    """

    def __init__(self, table: SceneFields):
        super().__init__(table)
        self.state, self.slope = table.vector(2, ti.f64), table.vector(2, ti.f64)
        self.impulse_velocity = table.field(ti.f64)

    @ti.func
    def recoil(self, s):
        """Of the mass alone: spring and dashpot take no part in an impulse."""
        return 1.0 / self.table.mass[s]

    @ti.func
    def motion(self, s):
        """Displacement, velocity, and acceleration without the impacts of the step before."""
        return Motion(
            self.state[s][0], self.state[s][1], self.slope[s][1] - self.impulse_velocity[s]
        )


@ti.data_oriented
class SprungContainer(SpringContainer):
    """The container on its spring, integrated by RK45 within every step of the filling.

    phase: sine and cosine of the base's turn up to each stage of a step, the same in all steps.
    """

    def __init__(self, table: SceneFields, clock: Clock):
        super().__init__(table)
        self.clock = clock
        self.phase = table.vector(2, ti.f64, len(_STAGES))

    @ti.func
    def start(self, s, x, v):
        """Place the container; nothing acts on it but spring, dashpot and base."""
        self.state[s] = ti.Vector([x, v])
        self.impulse_velocity[s] = 0.0
        self._set_phases(s)
        self._set_action(s, Action(0.0, 0.0))

    @ti.func
    def base(self, s):
        """Displacement of the base [m]."""
        return self.table.base_amplitude[s] * self.clock.circle[s][0]

    @ti.func
    def renew(self, s):
        """Note that the base has changed its motion, between two frequencies of a sweep."""
        self._set_phases(s)
        self._set_action(s, Action(self.impulse[s], self.carried[s]))

    @ti.func
    def _set_phases(self, s):
        omega = 2.0 * ti.math.pi * self.table.frequency[s]
        for k in ti.static(range(len(_STAGES))):
            sine, cosine = sine_and_cosine(omega * (self.table.dt[s] * _STAGES[k]))
            self.phase[s, k] = ti.Vector([sine, cosine])

    @ti.func
    def _set_action(self, s, action):
        """Take over what acts from now on; at this moment the turn of the base is none."""
        self.impulse[s], self.carried[s] = action.impulse, action.carried
        forcing = self._forcing(s, action)
        self.slope[s] = slope_at_phase(forcing, ti.Vector([0.0, 1.0]), self.state[s])

    @ti.func
    def _forcing(self, s, action):
        """Forcing over the step that begins now; (K + i w C) y0 turned by the present phase."""
        table, circle = self.table, self.clock.circle[s]
        per_mass = 1.0 / (table.mass[s] + action.carried)
        omega = 2.0 * ti.math.pi * table.frequency[s]
        stiffness, damping = table.stiffness[s] * per_mass, table.damping[s] * per_mass
        by_spring = stiffness * table.base_amplitude[s]
        by_dashpot = damping * omega * table.base_amplitude[s]
        force = action.impulse / table.dt[s] - action.carried * self.gravity[None]
        return Forcing(
            stiffness=stiffness,
            damping=damping,
            omega=omega,
            drive=by_spring * circle[0] + by_dashpot * circle[1],
            quadrature=by_spring * circle[1] - by_dashpot * circle[0],
            constant=force * per_mass,
        )

    @ti.func
    def advance(self, s, action):
        """Take the container over the step; the last slope serves again unless the load changed."""
        if action.impulse != self.impulse[s] or action.carried != self.carried[s]:
            self._set_action(s, action)
        forcing, dt = self._forcing(s, action), self.table.dt[s]
        bounds = self.tolerance[0], self.tolerance[1], MOST_ATTEMPTS
        y, change, error = self._whole_step(s, forcing)
        attempts = 1
        if not error <= 1.0:
            y, change, attempts = rk45.integrate(
                slope, forcing, 0.0, dt, self.state[s], self.slope[s], dt, *bounds
            )
        self.state[s], self.slope[s] = y, change
        self.impulse_velocity[s] = action.impulse / (dt * (self.table.mass[s] + action.carried))
        return attempts

    @ti.func
    def _whole_step(self, s, forcing):
        """The first attempt of RK45, by the phases of its stages: the same bits, half the time."""
        phase = [self.phase[s, k] for k in ti.static(range(len(_STAGES)))]
        y, dt = self.state[s], self.table.dt[s]
        y_new, change, gap = rk45.stages(
            slope_at_phase,
            *(forcing, phase[0], phase[1], phase[2], phase[3], phase[4], y, self.slope[s], dt),
        )
        error = rk45.scaled_norm(gap, y, y_new, self.tolerance[0], self.tolerance[1])
        return y_new, change, error


@ti.data_oriented
class PrescribedContainer:
    """Base of containers fixed to the base, whose motion is prescribed, whatever fills them."""

    def load(self, gravity: float, rtol: float, atol: float) -> None:
        """Nothing to load: nothing is integrated."""

    @ti.func
    def recoil(self, s):
        """None: no impulse changes the motion of the base."""
        return 0.0

    @ti.func
    def renew(self, s):
        """Nothing to do: the motion is prescribed."""


@ti.data_oriented
class DrivenContainer(PrescribedContainer):
    """The container fixed to the base: x = y0 sin(2 pi f t)."""

    def __init__(self, table: SceneFields, clock: Clock):
        self.table, self.clock = table, clock

    @ti.func
    def start(self, s, x, v):
        """Position of the base; x and v are not used."""

    @ti.func
    def base(self, s):
        """Displacement of the base [m]."""
        return self.table.base_amplitude[s] * self.clock.circle[s][0]

    @ti.func
    def motion(self, s):
        """Of the base."""
        omega = 2.0 * ti.math.pi * self.table.frequency[s]
        y0, circle = self.table.base_amplitude[s], self.clock.circle[s]
        return Motion(y0 * circle[0], omega * y0 * circle[1], -omega * omega * y0 * circle[0])

    @ti.func
    def advance(self, s, action):
        """Nothing to integrate: the clock moves the base."""
        return 1


#: Containers under a single sine of the base, by the word for their mount.
CONTAINERS = {"spring": SprungContainer, "base": DrivenContainer}
