"""Containers under any excitation but a single sine of the base; as those of ``container.py``.

They count the steps since the start, as an excitation is a function of time.
"""

from functools import partial
from typing import Any

import taichi as ti

from ca_damper.engine import rk45
from ca_damper.engine.container import MOST_ATTEMPTS, PrescribedContainer, SpringContainer
from ca_damper.engine.signals import BASES, FORCES
from ca_damper.excitation.excitation import Excitation, ExcitationKind
from ca_damper.filling import Action, Motion
from ca_damper.scenes.clock import Clock
from ca_damper.scenes.scene_fields import SceneFields


@ti.dataclass
class Load:
    """Numbers of scene s over a step that begins at ``start`` [s], per mass [1/kg] of all it moves.

    stiffness [1/s^2], damping [1/s]; constant [m/s^2]: by impacts and the weight carried.
    """

    scene: ti.i32
    start: ti.f64
    stiffness: ti.f64
    damping: ti.f64
    per_mass: ti.f64
    constant: ti.f64


@ti.data_oriented
class ExcitedContainer(SpringContainer):
    """The container on its spring, its base and a force moving as an Excitation says.

    elapsed: steps since the start. lifts: whether it lies on the base by its weight, and spring and
    dashpot push but never pull; x = 0 is where it just touches a base at rest.
    """

    def __init__(self, table: SceneFields, clock: Clock, kind: ExcitationKind, lifts: bool = False):
        super().__init__(table)
        self.lifts, self.elapsed = lifts, table.field(ti.i32)
        self.excited_base, self.force = BASES[kind.base](table, clock), FORCES[kind.force](table)

    def excite(self, excitation: Excitation, scenes: int) -> None:
        """Take over the excitation of a batch."""
        self.excited_base.load(excitation, scenes)
        self.force.load(excitation, scenes)

    @ti.func
    def start(self, s, x, v):
        """Place the container at time zero."""
        self.state[s], self.elapsed[s] = ti.Vector([x, v]), 0
        self.impulse_velocity[s] = 0.0
        self._set_action(s, Action(0.0, 0.0))

    @ti.func
    def base(self, s):
        """Displacement of the base at the beginning of the step [m]."""
        return self.excited_base.at(s, self._time(s), 0.0)[0]

    @ti.func
    def renew(self, s):
        """Nothing to do: the frequency of an excitation does not change in a run."""

    @ti.func
    def _time(self, s):
        return self.elapsed[s] * self.table.dt[s]

    @ti.func
    def _set_action(self, s, action):
        """Take over what acts from now on."""
        self.impulse[s], self.carried[s] = action.impulse, action.carried
        self.slope[s] = self._change(self._load(s, action), 0.0, self.state[s])

    @ti.func
    def _load(self, s, action):
        """Load over the step that begins now."""
        per_mass = 1.0 / (self.table.mass[s] + action.carried)
        heavy = action.carried
        if ti.static(self.lifts):
            # On a spring the weight of the container itself is in x = 0.
            heavy += self.table.mass[s]
        force = action.impulse / self.table.dt[s] - heavy * self.gravity[None]
        return Load(
            scene=s,
            start=self._time(s),
            stiffness=self.table.stiffness[s] * per_mass,
            damping=self.table.damping[s] * per_mass,
            per_mass=per_mass,
            constant=force * per_mass,
        )

    @ti.func
    def _change(self, load, t, y):
        """d(x, v)/dt for y = (x, v): the right-hand side that RK45 integrates."""
        base = self.excited_base.at(load.scene, load.start, t)
        pull = load.stiffness * (base[0] - y[0]) + load.damping * (base[1] - y[1])
        if ti.static(self.lifts):
            # Nothing at a distance, where a dashpot alone would already act.
            pull = ti.select(y[0] < base[0], ti.max(0.0, pull), 0.0)
        push = self.force.at(load.scene, load.start, t) * load.per_mass
        return ti.Vector([y[1], pull + push + load.constant])

    @ti.func
    def advance(self, s, action):
        """Take the container over the step; the last slope serves again unless the load changed."""
        if action.impulse != self.impulse[s] or action.carried != self.carried[s]:
            self._set_action(s, action)
        load, dt = self._load(s, action), self.table.dt[s]
        bounds = self.tolerance[0], self.tolerance[1], MOST_ATTEMPTS
        y, change, attempts = rk45.integrate(
            self._change, load, 0.0, dt, self.state[s], self.slope[s], dt, *bounds
        )
        self.state[s], self.slope[s] = y, change
        self.elapsed[s] = self.elapsed[s] + 1
        self.impulse_velocity[s] = action.impulse / (dt * (self.table.mass[s] + action.carried))
        return attempts


@ti.data_oriented
class ShakenContainer(PrescribedContainer):
    """The container fixed to a base that moves as an Excitation says."""

    def __init__(self, table: SceneFields, clock: Clock, kind: ExcitationKind):
        self.table, self.excited_base = table, BASES[kind.base](table, clock)
        self.elapsed = table.field(ti.i32)

    def excite(self, excitation: Excitation, scenes: int) -> None:
        """Take over the base motions of a batch."""
        self.excited_base.load(excitation, scenes)

    @ti.func
    def start(self, s, x, v):
        """Time zero; x and v are not used."""
        self.elapsed[s] = 0

    @ti.func
    def base(self, s):
        """Displacement of the base at the beginning of the step [m]."""
        return self.motion(s).x

    @ti.func
    def motion(self, s):
        """Of the base."""
        at = self.excited_base.at(s, self.elapsed[s] * self.table.dt[s], 0.0)
        return Motion(at[0], at[1], at[2])

    @ti.func
    def advance(self, s, action):
        """Nothing to integrate: time moves the base."""
        self.elapsed[s] = self.elapsed[s] + 1
        return 1


_EXCITED: dict[str, Any] = {
    "spring": ExcitedContainer,
    "base": ShakenContainer,
    "floor": partial(ExcitedContainer, lifts=True),
}


def excited_container(mount: str, table: SceneFields, clock: Clock, kind: ExcitationKind) -> Any:
    """Container on a mount under an excitation of some kind."""
    return _EXCITED[mount](table, clock, kind)
