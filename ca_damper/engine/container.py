"""Motion of the containers on one structure: a group of scenes that begins with ``first(s)``.

A structure of n modes carries the boxes of a group; an oscillator has one mode, the base none.
A run calls ``start(s, x, v)`` of every scene, then ``complete_start(first)``; in a step
``motion(s)``, ``set_action(s, action)`` of every filling, and ``advance(first)``, which returns the
attempts of the integration, or -1. ``renew(s)`` follows a change of the base's motion.
"""

import numpy as np
import taichi as ti

from ca_damper.engine import rk45
from ca_damper.engine.mount import Mount, MountKind
from ca_damper.engine.signals import DeviceExcitation
from ca_damper.filling import Action, Motion, Recoil
from ca_damper.scenes.clock import CycleClock
from ca_damper.scenes.scene_fields import SceneFields
from taichi_dem.kit.allocation import assign

#: Attempts within one step of the filling after which the container counts as lost.
MOST_ATTEMPTS = 1000


@ti.data_oriented
class Container:
    """Modes of all groups, and their places, in metres as a ``Mount`` counts them.

    state, slope: coordinates and speeds of the modes, and their change. struck: share of the
    present accelerations that is due to impacts [m/s^2]. impulse [N s] and carried [kg]: action of
    the filling of each scene in the present step. tolerance: local error allowed, rtol, atol.
    """

    def __init__(
        self, table: SceneFields, clock: CycleClock, excitation: DeviceExcitation, kind: MountKind
    ):
        self.table, self.clock, self.excitation = table, clock, excitation
        n, vector = kind.modes, ti.types.vector(kind.modes, ti.f64)
        self.modes, self.is_group = n, kind.word == "structure"
        self.moves, self.lifts = kind.word != "base", kind.word == "floor"
        for name in ("mass", "stiffness", "damping", "share", "pushed", "shape", "lift"):
            setattr(self, name, table.vector(n, ti.f64))
        self.residual, self.home = table.field(ti.f64), table.field(ti.i32)
        self.group, self.boxed = ti.field(ti.i32, shape=()), ti.field(ti.i32, shape=())
        self.tolerance = ti.field(ti.f64, shape=2)
        self.impulse, self.carried = table.field(ti.f64), table.field(ti.f64)
        self.state, self.slope = table.vector(2 * n, ti.f64), table.vector(2 * n, ti.f64)
        self.struck = table.vector(n, ti.f64)
        self.elapsed, self.changed = table.field(ti.i32), table.field(ti.i32)
        if self.is_group:
            self.inverse = table.field(ti.f64, n, n)
            self.hit, self.rubbed = table.field(ti.f64), table.field(ti.f64)
            self.speed_gain, self.shared = table.field(ti.f64), table.field(ti.f64)
        per_mode = ("stiffness", "damping", "share", "pushed", "lag", "constant")
        self.Load = ti.types.struct(scene=ti.i32, start=ti.f64, **dict.fromkeys(per_mode, vector))

    def upload(
        self, mount: Mount, numbers: dict[str, np.ndarray], rtol: float, atol: float
    ) -> None:
        """Take over the numbers of a batch: of its mount by name, and its tolerances."""
        assign(self.tolerance, [rtol, atol])
        assign(self.group, mount.group)
        assign(self.boxed, mount.boxes)
        for name, rows in numbers.items():
            assign(getattr(self, name), rows)

    @ti.func
    def first(self, s):
        """First scene of the group of scene s."""
        result = s
        if ti.static(self.is_group):
            result = s - s % self.group[None]
        return result

    @ti.func
    def scenes(self):
        """Scenes of a group."""
        count = 1
        if ti.static(self.is_group):
            count = self.group[None]
        return count

    @ti.func
    def boxes(self):
        """Scenes of a group that have a box: its first."""
        count = 1
        if ti.static(self.is_group):
            count = self.boxed[None]
        return count

    @ti.func
    def start(self, s, x, v):
        """Add the motion of a place to the modes; in order, and then ``complete_start``."""
        first = self.first(s)
        n = ti.static(self.modes)
        if s == first:
            self.state[first], self.elapsed[first] = ti.Vector.zero(ti.f64, 2 * n), 0
        y, lift = self.state[first], self.lift[s]
        for k in ti.static(range(n)):
            y[k], y[n + k] = y[k] + lift[k] * x, y[n + k] + lift[k] * v
        self.state[first] = y
        self.impulse[s], self.carried[s] = 0.0, 0.0

    @ti.func
    def complete_start(self, first):
        """Nothing acts on a group but springs, dashpots and excitation."""
        self.struck[first] = ti.Vector.zero(ti.f64, self.modes)
        self.renew(first)

    @ti.func
    def renew(self, s):
        """Take over another motion of the base."""
        first = self.first(s)
        if ti.static(self.moves):
            if s == first:
                self.changed[first] = 1
                self.begin(first)
                self._load_of_step(first)

    @ti.func
    def begin(self, first):
        """Prepare for a motion of the base: nothing to do."""

    @ti.func
    def recoil(self, s):
        """Speed that a unit impulse gives [1/kg], of all modes together, with nothing carried."""
        # Springs and dashpots take no part in an impulse.
        shape = self.shape[s]
        return (shape * shape / self.mass[s]).sum()

    @ti.func
    def base(self, s):
        """Displacement of the base at the beginning of the step [m]."""
        return self._base(self.first(s))[0]

    @ti.func
    def _base(self, first):
        return self.excitation.base.now(first, self.elapsed[first] * self.table.dt[first])

    @ti.func
    def motion(self, s):
        """Displacement, velocity, and acceleration without the impacts of the step before."""
        first = self.first(s)
        n = ti.static(self.modes)
        y, pulled = self.state[first], self.slope[first][n:] - self.struck[first]
        seen = ti.Vector([y[0], y[n], pulled[0]])
        if ti.static(not self.moves):
            seen = self._base(first)
        elif ti.static(self.is_group):
            seen, shape = self.residual[s] * self._base(first), self.shape[s]
            for k in ti.static(range(n)):
                seen += shape[k] * ti.Vector([y[k], y[n + k], pulled[k]])
        return Motion(seen[0], seen[1], seen[2])

    @ti.func
    def set_action(self, s, action):
        """Take over the action of the filling of a scene over the step."""
        if action.impulse != self.impulse[s] or action.carried != self.carried[s]:
            self.impulse[s], self.carried[s] = action.impulse, action.carried
            self.changed[self.first(s)] = 1

    @ti.func
    def advance(self, first):
        """Take a group over the step."""
        attempts = 1
        if ti.static(self.moves):
            load = self._load_of_step(first)
            y, change, tried = self.integrated(first, load)
            self.state[first], self.slope[first] = y, change
            self.struck[first] = self._struck(first)
            attempts = tried
        self.elapsed[first] = self.elapsed[first] + 1
        return attempts

    @ti.func
    def _load_of_step(self, first):
        """Load over the step that begins now, and the slope there, which serves again as it was."""
        changed = self.changed[first] != 0
        if ti.static(self.is_group):
            if changed:
                self._invert(first)
        load = self.acting(first)
        if changed:
            self.slope[first] = self.slope_of(load, self.state[first])
            self.changed[first] = 0
        return load

    @ti.func
    def _mass(self, s):
        """Mass of a container of its own and of what it carries."""
        return self.mass[s][0] + self.carried[s]

    @ti.func
    def acting(self, first):
        """What acts over the step, for ``change``."""
        return self.load_of(first)

    @ti.func
    def by_filling(self, s):
        """Force of the filling of a scene, with the weight of what moves with it [N]."""
        heavy = self.carried[s]
        if ti.static(self.lifts):
            # On a spring the weight of the container itself is in x = 0.
            heavy += self.mass[s][0]
        return self.impulse[s] / self.table.dt[s] - heavy * self.table.gravity[s]

    @ti.func
    def load_of(self, first):
        """Load over the step; that of a single mode is per mass of all it moves."""
        per_mass = 1.0
        if ti.static(not self.is_group):
            per_mass = 1.0 / self._mass(first)
        constant, lag = ti.Vector.zero(ti.f64, self.modes), ti.Vector.zero(ti.f64, self.modes)
        for k in range(self.boxes()):
            s = first + k
            constant += self.by_filling(s) * self.shape[s]
            if ti.static(self.is_group):
                lag += self.carried[s] * self.residual[s] * self.shape[s]
        return self.Load(
            scene=first,
            start=self.elapsed[first] * self.table.dt[first],
            stiffness=self.stiffness[first] * per_mass,
            damping=self.damping[first] * per_mass,
            share=self.share[first],
            pushed=self.pushed[first] * per_mass,
            lag=lag,
            constant=constant * per_mass,
        )

    @ti.func
    def slope_of(self, load, y):
        """At the beginning of the step."""
        return self.change(load, 0.0, y)

    @ti.func
    def change(self, load, t, y):
        """d(q, q')/dt of a group's modes for y = (q, q'): the right-hand side of RK45."""
        n = ti.static(self.modes)
        base = self.excitation.base.at(load.scene, load.start, t)
        push = self.excitation.force.at(load.scene, load.start, t)[0]
        spring = load.stiffness * (load.share * base[0] - y[:n])
        pull = spring + load.damping * (load.share * base[1] - y[n:])
        if ti.static(self.lifts):
            # Nothing at a distance, where a dashpot alone would already act.
            pull[0] = ti.select(y[0] < base[0], ti.max(0.0, pull[0]), 0.0)
        by_filling = load.constant
        if ti.static(self.is_group):
            by_filling -= base[2] * load.lag
        return self._changed(load.scene, y, pull + load.pushed * push + by_filling)

    @ti.func
    def _changed(self, first, y, pull):
        """Speeds, and accelerations by the pull on each mode."""
        n = ti.static(self.modes)
        change = y
        if ti.static(self.is_group):
            pull = self._gain(first, pull)
        for k in ti.static(range(n)):
            change[k], change[n + k] = y[n + k], pull[k]
        return change

    @ti.func
    def integrated(self, first, load):
        """State and slope at the end of the step, and attempts."""
        dt, bounds = self.table.dt[first], (self.tolerance[0], self.tolerance[1], MOST_ATTEMPTS)
        return rk45.integrate(
            self.change, load, 0.0, dt, self.state[first], self.slope[first], dt, *bounds
        )

    @ti.func
    def _struck(self, first):
        """Accelerations of the modes by the impacts of the step."""
        dt, struck = self.table.dt[first], ti.Vector.zero(ti.f64, self.modes)
        if ti.static(self.is_group):
            for s in range(first, first + self.boxes()):
                struck += self.impulse[s] / dt * self.shape[s]
            struck = self._gain(first, struck)
        else:
            struck = self.shape[first] * (self.impulse[first] / (dt * self._mass(first)))
        return struck

    @ti.func
    def _gain(self, first, pull):
        """Accelerations of the modes of a group by forces on them."""
        # In rolled loops: unrolled, eight modes take a minute to compile.
        gain = pull
        for i in range(self.modes):
            total = 0.0
            for j in range(self.modes):
                total += self.inverse[first, i, j] * pull[j]
            gain[i] = total
        return gain

    @ti.func
    def _invert(self, first):
        """Inverse of m + sum carried shape shape^T."""
        # With g = inverse shape, place by place: inverse - c g g^T / (1 + c shape.g) (Sherman and
        # Morrison, Ann. Math. Stat. 21 (1950) 124).
        mass = self.mass[first]
        for i in range(self.modes):
            for j in range(self.modes):
                self.inverse[first, i, j] = 0.0
            self.inverse[first, i, i] = 1.0 / mass[i]
        for s in range(first, first + self.boxes()):
            self._carry(first, s, self.carried)

    @ti.func
    def _carry(self, first, s, masses: ti.template()):
        """Add the masses of all boxes at a place to the modal masses, at the first of its boxes."""
        c = 0.0
        for other in range(s, first + self.boxes()):
            if self.home[other] == s - first:
                c += masses[other]
        if c > 0.0:
            shape, more = self.shape[s], 1.0
            gain = self._gain(first, shape)
            for k in ti.static(range(self.modes)):
                more += c * shape[k] * gain[k]
            for i in range(self.modes):
                for j in range(self.modes):
                    less = c / more * gain[i] * gain[j]
                    self.inverse[first, i, j] = self.inverse[first, i, j] - less

    @ti.func
    def set_blows(self, s, blows):
        """Take over blows of the filling of a scene that wait for those of the other boxes."""
        self.hit[s], self.rubbed[s] = blows.struck, blows.rubbed
        self.set_action(s, Action(blows.impulse, blows.carried))

    @ti.func
    def resolve(self, first):
        """Resolve the blows of all boxes of a group together."""
        some, end = 0.0, first + self.boxes()
        for s in range(first, end):
            some += self.hit[s] + self.rubbed[s]
            self.speed_gain[s], self.shared[s] = 0.0, 0.0
        if some > 0.0:
            self.changed[first] = 1
            self._invert(first)
            for s in range(first, end):
                if self.rubbed[s] > 0.0:
                    self._share(first, s)
            for s in range(first, end):
                self._carry(first, s, self.hit)
            struck = self._struck(first)
            for s in range(first, end):
                self.speed_gain[s] = self.table.dt[first] * self.shape[s].dot(struck)

    @ti.func
    def _share(self, first, s):
        """Add what is rubbed in a box to the shares of all boxes."""
        gain = self._gain(first, self.shape[s])
        for other in range(first, first + self.boxes()):
            moved = self.rubbed[s] * ti.abs(self.shape[other].dot(gain))
            self.shared[other] = self.shared[other] + moved

    @ti.func
    def recoil_of(self, s):
        """How the box of a scene takes the blows of the step."""
        motion = self.motion(s)
        free = motion.v + motion.a * self.table.dt[s]
        return Recoil(free + self.speed_gain[s], self.shared[s])
