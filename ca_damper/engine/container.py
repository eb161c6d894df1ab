"""Motion of the container: on its spring, driven by base and filling, or fixed to the base.

A container moves one scene, or a group of ``scenes()`` that begins with scene ``first(s)``. All
have ``load`` for the numbers of a batch, and the ti.funcs ``start(s, x, v)`` of every scene, then
``complete_start(first)``; ``motion(s)`` at the beginning of a step, with ``base(s)``, the base's
displacement [m]; ``recoil(s)``, the speed that a unit impulse gives it [1/kg]; ``renew(s)`` where
the base has changed its motion, between two frequencies of a sweep; ``set_action(s, action)`` of
every filling over the step, and then ``advance(first)``, which returns the attempts of the
integration, or -1.
"""

from typing import Any

import taichi as ti

from ca_damper.engine import rk45
from ca_damper.engine.signals import DeviceExcitation
from ca_damper.filling import Motion
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
    """Base of all containers: what acts on the container of each scene in the present step.

    impulse [N s] and carried [kg]. tolerance: local error allowed, rtol and atol, the latter in m
    and m/s. is_group: whether it may move several scenes.
    """

    is_group = False

    def __init__(self, table: SceneFields):
        self.table = table
        self.impulse, self.carried = table.field(ti.f64), table.field(ti.f64)
        self.tolerance = ti.field(ti.f64, shape=2)

    def load(self, rtol: float, atol: float) -> None:
        """Take over the numbers of a batch."""
        assign(self.tolerance, [rtol, atol])

    @ti.func
    def first(self, s):
        """First scene of the group of scene s."""
        return s

    @ti.func
    def scenes(self):
        """Scenes of a group."""
        return 1

    @ti.func
    def complete_start(self, first):
        """Nothing to do."""

    @ti.func
    def renew(self, s):
        """Nothing to do."""

    @ti.func
    def set_action(self, s, action):
        """Take over the action of the filling of a scene over the step."""
        if action.impulse != self.impulse[s] or action.carried != self.carried[s]:
            self.impulse[s], self.carried[s] = action.impulse, action.carried
            self._note_action(s)

    @ti.func
    def _note_action(self, s):
        """Nothing that depends on it is kept."""


@ti.data_oriented
class SpringContainer(Container):
    """Base of containers with one spring and dashpot each, that RK45 moves on.

    They have ``_begin(s)``, ``_load(s)`` over a step, ``_slope(s, load)`` at its beginning and
    ``_integrated(s, load)``: state and slope at its end, and attempts.

    state, slope: displacement and speed, and their change. impulse_velocity: share of the present
    acceleration that is due to impacts [m/s^2].
    """

    def __init__(self, table: SceneFields):
        super().__init__(table)
        self.state, self.slope = table.vector(2, ti.f64), table.vector(2, ti.f64)
        self.impulse_velocity = table.field(ti.f64)

    @ti.func
    def start(self, s, x, v):
        """Place the container; nothing acts on it but spring, dashpot and excitation."""
        self.state[s], self.impulse_velocity[s] = ti.Vector([x, v]), 0.0
        self.impulse[s], self.carried[s] = 0.0, 0.0
        self._begin(s)
        self._note_action(s)

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
    def _note_action(self, s):
        """The slope at the beginning of the step; the last one serves again where none is new."""
        self.slope[s] = self._slope(s, self._load(s))

    @ti.func
    def advance(self, s):
        """Take the container over the step."""
        y, change, attempts = self._integrated(s, self._load(s))
        self.state[s], self.slope[s] = y, change
        mass = self.table.mass[s] + self.carried[s]
        self.impulse_velocity[s] = self.impulse[s] / (self.table.dt[s] * mass)
        return attempts


@ti.data_oriented
class SprungContainer(SpringContainer):
    """The container on its spring, its base moving by a single sine."""

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
        self._note_action(s)

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
    def _load(self, s):
        """Forcing over the step that begins now; (K + i w C) y0 turned by the present phase."""
        table, circle, carried = self.table, self.clock.circle[s], self.carried[s]
        per_mass = 1.0 / (table.mass[s] + carried)
        omega = 2.0 * ti.math.pi * table.frequency[s]
        stiffness, damping = table.stiffness[s] * per_mass, table.damping[s] * per_mass
        by_spring = stiffness * table.base_amplitude[s]
        by_dashpot = damping * omega * table.base_amplitude[s]
        force = self.impulse[s] / table.dt[s] - carried * table.gravity[s]
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
    """The container on its spring, its base and a force moving as an Excitation says."""

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
    def _load(self, s):
        """Load over the step that begins now."""
        heavy = self.carried[s]
        per_mass = 1.0 / (self.table.mass[s] + heavy)
        if ti.static(self.lifts):
            # On a spring the weight of the container itself is in x = 0.
            heavy += self.table.mass[s]
        force = self.impulse[s] / self.table.dt[s] - heavy * self.table.gravity[s]
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
        super().__init__(table)
        self.moved_by, self.elapsed = excitation.base, table.field(ti.i32)

    @ti.func
    def start(self, s, x, v):
        """Time zero; x and v are not used."""
        self.elapsed[s], self.impulse[s], self.carried[s] = 0, 0.0, 0.0

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
    def advance(self, s):
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
