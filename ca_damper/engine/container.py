"""Motion of the container: on its spring, driven by base and filling, or fixed to the base.

All have ``load`` for the numbers of a batch, and the ti.funcs ``start``, ``motion`` and ``base`` at
the beginning of a step, ``recoil``, the speed that a unit impulse gives it [1/kg], ``renew`` where
the base changes its frequency, and ``advance``, which returns the attempts of the integration, or
-1.
"""

from typing import Any

import taichi as ti

from ca_damper.engine import rk45
from ca_damper.engine.signals import DeviceExcitation
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
class Container:
    """Base of all containers; by itself it takes over nothing."""

    def load(self, rtol: float, atol: float) -> None:
        """Take over the numbers of a batch."""

    @ti.func
    def renew(self, s):
        """Nothing to do."""


@ti.data_oriented
class IntegratedContainer(Container):
    """Base of containers that RK45 moves on under the action of the filling."""

    def __init__(self, table: SceneFields):
        self.table = table
        self.impulse, self.carried = table.field(ti.f64), table.field(ti.f64)
        self.tolerance = ti.field(ti.f64, shape=2)

    def load(self, rtol: float, atol: float) -> None:
        """Take over the numbers of a batch."""
        assign(self.tolerance, [rtol, atol])


@ti.data_oriented
class SpringContainer(IntegratedContainer):
    """Base of integrated containers with one spring and dashpot each.

    They have ``_begin(s)``, ``_load(s, action)`` over a step, ``_slope(s, load)`` at its beginning
    and ``_integrated(s, load)``: state and slope at its end, and attempts. impulse_velocity: share
    of the acceleration that is due to impacts [m/s^2].
    """

    def __init__(self, table: SceneFields):
        super().__init__(table)
        self.state, self.slope = table.vector(2, ti.f64), table.vector(2, ti.f64)
        self.impulse_velocity = table.field(ti.f64)

    @ti.func
    def start(self, s, x, v):
        """Place the container; nothing acts on it but spring, dashpot and excitation."""
        self.state[s], self.impulse_velocity[s] = ti.Vector([x, v]), 0.0
        self._begin(s)
        self._set_action(s, Action(0.0, 0.0))

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

    @ti.func
    def _set_action(self, s, action):
        self.impulse[s], self.carried[s] = action.impulse, action.carried
        self.slope[s] = self._slope(s, self._load(s, action))

    @ti.func
    def advance(self, s, action):
        """Take the container over the step; the last slope serves again unless the load changed."""
        if action.impulse != self.impulse[s] or action.carried != self.carried[s]:
            self._set_action(s, action)
        y, change, attempts = self._integrated(s, self._load(s, action))
        self.state[s], self.slope[s] = y, change
        mass = self.table.mass[s] + action.carried
        self.impulse_velocity[s] = action.impulse / (self.table.dt[s] * mass)
        return attempts


@ti.data_oriented
class SprungContainer(SpringContainer):
    """The container on its spring, its base moving by a single sine.

    phase: sine and cosine of the base's turn up to each stage of a step, the same in all steps.
    """

    def __init__(self, table: SceneFields, clock: Clock):
        super().__init__(table)
        self.clock, self.phase = clock, table.vector(2, ti.f64, len(_STAGES))

    @ti.func
    def base(self, s):
        """Displacement of the base [m]."""
        return self.table.base_amplitude[s] * self.clock.circle[s][0]

    @ti.func
    def renew(self, s):
        """Take over the turn of the base at another frequency."""
        self._begin(s)
        self._set_action(s, Action(self.impulse[s], self.carried[s]))

    @ti.func
    def _begin(self, s):
        omega = 2.0 * ti.math.pi * self.table.frequency[s]
        for k in ti.static(range(len(_STAGES))):
            sine, cosine = sine_and_cosine(omega * (self.table.dt[s] * _STAGES[k]))
            self.phase[s, k] = ti.Vector([sine, cosine])

    @ti.func
    def _slope(self, s, forcing):
        """At the beginning of a step, where the turn of the base is none."""
        return slope_at_phase(forcing, ti.Vector([0.0, 1.0]), self.state[s])

    @ti.func
    def _load(self, s, action):
        """Forcing over the step that begins now; (K + i w C) y0 turned by the present phase."""
        table, circle = self.table, self.clock.circle[s]
        per_mass = 1.0 / (table.mass[s] + action.carried)
        omega = 2.0 * ti.math.pi * table.frequency[s]
        stiffness, damping = table.stiffness[s] * per_mass, table.damping[s] * per_mass
        by_spring = stiffness * table.base_amplitude[s]
        by_dashpot = damping * omega * table.base_amplitude[s]
        force = action.impulse / table.dt[s] - action.carried * self.table.gravity[s]
        return Forcing(
            stiffness=stiffness,
            damping=damping,
            omega=omega,
            drive=by_spring * circle[0] + by_dashpot * circle[1],
            quadrature=by_spring * circle[1] - by_dashpot * circle[0],
            constant=force * per_mass,
        )

    @ti.func
    def _integrated(self, s, forcing):
        """By the phases of the stages in a first attempt: the same bits, half the time."""
        phase = [self.phase[s, k] for k in ti.static(range(len(_STAGES)))]
        before, dt, attempts = self.state[s], self.table.dt[s], 1
        y, change, gap = rk45.stages(
            slope_at_phase,
            *(forcing, phase[0], phase[1], phase[2], phase[3], phase[4], before, self.slope[s], dt),
        )
        error = rk45.scaled_norm(gap, before, y, self.tolerance[0], self.tolerance[1])
        if not error <= 1.0:
            bounds = self.tolerance[0], self.tolerance[1], MOST_ATTEMPTS
            y, change, attempts = rk45.integrate(
                slope, forcing, 0.0, dt, before, self.slope[s], dt, *bounds
            )
        return y, change, attempts


@ti.dataclass
class Load:
    """Numbers of scene s over a step from ``start`` [s], per mass of all it moves."""

    scene: ti.i32
    start: ti.f64
    stiffness: ti.f64
    damping: ti.f64
    per_mass: ti.f64
    constant: ti.f64


@ti.data_oriented
class ExcitedContainer(SpringContainer):
    """The container on its spring, its base and a force moving as an Excitation says.

    lifts: whether it lies on the base by its weight, and spring and dashpot push but never pull.
    """

    def __init__(self, table: SceneFields, excitation: DeviceExcitation, lifts: bool):
        super().__init__(table)
        self.excitation, self.lifts, self.elapsed = excitation, lifts, table.field(ti.i32)

    @ti.func
    def base(self, s):
        """Displacement of the base at the beginning of the step [m]."""
        return self.excitation.base.at(s, self.elapsed[s] * self.table.dt[s], 0.0)[0]

    @ti.func
    def _begin(self, s):
        self.elapsed[s] = 0

    @ti.func
    def _slope(self, s, load):
        return self._change(load, 0.0, self.state[s])

    @ti.func
    def _load(self, s, action):
        per_mass = 1.0 / (self.table.mass[s] + action.carried)
        heavy = action.carried
        if ti.static(self.lifts):
            # On a spring the weight of the container itself is in x = 0.
            heavy += self.table.mass[s]
        force = action.impulse / self.table.dt[s] - heavy * self.table.gravity[s]
        return Load(
            scene=s,
            start=self.elapsed[s] * self.table.dt[s],
            stiffness=self.table.stiffness[s] * per_mass,
            damping=self.table.damping[s] * per_mass,
            per_mass=per_mass,
            constant=force * per_mass,
        )

    @ti.func
    def _change(self, load, t, y):
        """d(x, v)/dt for y = (x, v): the right-hand side that RK45 integrates."""
        base = self.excitation.base.at(load.scene, load.start, t)
        pull = load.stiffness * (base[0] - y[0]) + load.damping * (base[1] - y[1])
        if ti.static(self.lifts):
            # Nothing at a distance, where a dashpot alone would already act.
            pull = ti.select(y[0] < base[0], ti.max(0.0, pull), 0.0)
        push = self.excitation.force.at(load.scene, load.start, t)[0] * load.per_mass
        return ti.Vector([y[1], pull + push + load.constant])

    @ti.func
    def _integrated(self, s, load):
        dt, bounds = self.table.dt[s], (self.tolerance[0], self.tolerance[1], MOST_ATTEMPTS)
        y, change, attempts = rk45.integrate(
            self._change, load, 0.0, dt, self.state[s], self.slope[s], dt, *bounds
        )
        self.elapsed[s] = self.elapsed[s] + 1
        return y, change, attempts


@ti.data_oriented
class PrescribedContainer(Container):
    """The container fixed to the base, whose motion is prescribed, whatever fills it."""

    def __init__(self, table: SceneFields, excitation: DeviceExcitation):
        self.table, self.moved_by = table, excitation.base
        self.elapsed = table.field(ti.i32)

    @ti.func
    def start(self, s, x, v):
        """Time zero; x and v are not used."""
        self.elapsed[s] = 0

    @ti.func
    def recoil(self, s):
        """None: no impulse changes the motion of the base."""
        return 0.0

    @ti.func
    def base(self, s):
        """Displacement of the base at the beginning of the step [m]."""
        return self.motion(s).x

    @ti.func
    def motion(self, s):
        """Of the base."""
        now = self.moved_by.now(s, self.elapsed[s] * self.table.dt[s])
        return Motion(now[0], now[1], now[2])

    @ti.func
    def advance(self, s, action):
        """Nothing to integrate: time moves the base."""
        self.elapsed[s] = self.elapsed[s] + 1
        return 1


def container_of(
    mount: str, table: SceneFields, clock: Clock, excitation: DeviceExcitation, is_sine: bool
) -> Any:
    """Container on a mount under an excitation; is_sine: which is a single sine of the base."""
    if mount == "base":
        return PrescribedContainer(table, excitation)
    if mount == "spring" and is_sine:
        return SprungContainer(table, clock)
    return ExcitedContainer(table, excitation, lifts=mount == "floor")
