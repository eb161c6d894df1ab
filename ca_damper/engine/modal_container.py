"""Boxes at places of a structure given by its modes; interface as that of ``container.py``."""

import numpy as np
import taichi as ti

from ca_damper.engine import rk45
from ca_damper.engine.container import MOST_ATTEMPTS, Container
from ca_damper.engine.modal_mount import ModalMount
from ca_damper.engine.signals import DeviceExcitation
from ca_damper.filling import Action, Motion, Recoil
from ca_damper.scenes.scene_fields import SceneFields
from taichi_dem.kit.allocation import assign


@ti.data_oriented
class ModalContainer(Container):
    """Boxes of all groups, and their modes in metres as ``ModalMount`` counts them."""

    is_group = True

    def __init__(self, table: SceneFields, excitation: DeviceExcitation, modes: int):
        super().__init__(table)
        self.excitation, self.modes = excitation, modes
        for name in ("mass", "stiffness", "damping", "share", "pushed"):
            setattr(self, name, ti.field(ti.f64, shape=modes))
        self.group, self.boxed = ti.field(ti.i32, shape=()), ti.field(ti.i32, shape=())
        for name in ("shape", "lift", "constant", "lag", "pull", "gain"):
            setattr(self, name, table.field(ti.f64, modes))
        self.inverse, self.tried = table.field(ti.f64, modes, modes), table.field(ti.f64, 2 * modes)
        self.state, self.slope = table.vector(2 * modes, ti.f64), table.vector(2 * modes, ti.f64)
        self.residual, self.seen = table.field(ti.f64), table.vector(3, ti.f64)
        self.elapsed, self.changed = table.field(ti.i32), table.field(ti.i32)
        self.home = table.field(ti.i32)
        self.struck, self.rubbed = table.field(ti.f64), table.field(ti.f64)
        self.speed_gain, self.shared = table.field(ti.f64), table.field(ti.f64)

    def hang(self, mount: ModalMount) -> None:
        """Take over the structure of a batch and the places of its boxes."""
        modes = self.mass, self.stiffness, self.damping, self.share
        for field, row in zip((*modes, self.pushed), (*mount.of_modes(), mount.of_force())):
            assign(field, row)
        rows = mount.of_scenes()
        assign(self.boxed, len(mount.places))
        assign(self.group, len(rows))
        of_group = np.arange(self.table.scene_count) % len(rows)
        every = rows[of_group]
        homes = np.array([mount.scene_places.index(place) for place in mount.scene_places])
        assign(self.home, homes[of_group])
        assign(self.shape, every[:, : self.modes])
        assign(self.lift, every[:, self.modes : -1])
        assign(self.residual, every[:, -1])

    @ti.func
    def first(self, s):
        """First scene of the group of scene s."""
        return s - s % self.group[None]

    @ti.func
    def scenes(self):
        """Scenes of a group."""
        return self.group[None]

    @ti.func
    def start(self, s, x, v):
        """Add the motion of a place to the modes; in order, and then ``settle``."""
        first = self.first(s)
        if s == first:
            self.state[first], self.elapsed[first] = ti.Vector.zero(ti.f64, 2 * self.modes), 0
        for k in ti.static(range(self.modes)):
            self.state[first][k] = self.state[first][k] + self.lift[s, k] * x
            speed = self.state[first][self.modes + k] + self.lift[s, k] * v
            self.state[first][self.modes + k] = speed
        self.impulse[s], self.carried[s] = 0.0, 0.0

    @ti.func
    def complete_start(self, first):
        """Complete the start of a group."""
        self._renew_load(first)
        self._renew_slope(first)
        self._see(first, 0.0)

    @ti.func
    def recoil(self, s):
        """Of all modes together, with nothing carried."""
        speed = 0.0
        for k in range(self.modes):
            speed += self.shape[s, k] * self.shape[s, k] / self.mass[k]
        return speed

    @ti.func
    def base(self, s):
        """Displacement of the base at the beginning of the step [m]."""
        return self.excitation.base.at(s, self._time(self.first(s)), 0.0)[0]

    @ti.func
    def motion(self, s):
        """Of the place: displacement, velocity, and acceleration without impacts."""
        return Motion(self.seen[s][0], self.seen[s][1], self.seen[s][2])

    @ti.func
    def renew(self, s):
        """Note that the base has changed its motion."""
        if s == self.first(s):
            self.changed[s] = 1

    @ti.func
    def _note_action(self, s):
        """Slope and inverse of the group are out of date."""
        self.changed[self.first(s)] = 1

    @ti.func
    def set_blows(self, s, blows):
        """Take over blows of the filling of a scene that wait for those of the other boxes."""
        self.struck[s], self.rubbed[s] = blows.struck, blows.rubbed
        self.set_action(s, Action(blows.impulse, blows.carried))

    @ti.func
    def resolve(self, first):
        """Resolve the blows of all boxes of a group together."""
        some, end = 0.0, first + self.boxed[None]
        for s in range(first, end):
            some += self.struck[s] + self.rubbed[s]
            self.speed_gain[s], self.shared[s] = 0.0, 0.0
        if some > 0.0:
            self.changed[first] = 1
            self._renew_inverse(first)
            for s in range(first, end):
                if self.rubbed[s] > 0.0:
                    self._share(first, s)
            for s in range(first, end):
                self._carry(first, s, self.struck)
            self._strike(first)
            for s in range(first, end):
                self.speed_gain[s] = self.table.dt[first] * self._at_place(first, s)

    @ti.func
    def recoil_of(self, s):
        """How the box of a scene takes the blows of the step."""
        free = self.seen[s][1] + self.seen[s][2] * self.table.dt[s]
        return Recoil(free + self.speed_gain[s], self.shared[s])

    @ti.func
    def _share(self, first, s):
        """Add what is rubbed in a box to the shares of all boxes."""
        self._push(first, s)
        for other in range(first, first + self.boxed[None]):
            moved = self.rubbed[s] * ti.abs(self._at_place(first, other))
            self.shared[other] = self.shared[other] + moved

    @ti.func
    def _push(self, first, s):
        """Accelerations of the modes by a unit force at the place of a scene."""
        for k in range(self.modes):
            self.pull[first, k] = self.shape[s, k]
        self._set_gain(first)

    @ti.func
    def _at_place(self, first, s):
        """Acceleration of the place of a scene by those of the modes."""
        result = 0.0
        for k in range(self.modes):
            result += self.shape[s, k] * self.gain[first, k]
        return result

    @ti.func
    def advance(self, first):
        """Take the modes of a group over the step, and see where its places come to."""
        if self.changed[first] != 0:
            self._renew_load(first)
            self._renew_slope(first)
        dt, bounds = self.table.dt[first], (self.tolerance[0], self.tolerance[1], MOST_ATTEMPTS)
        y, change, attempts = rk45.integrate(
            self._change, first, 0.0, dt, self.state[first], self.slope[first], dt, *bounds
        )
        self.state[first], self.slope[first] = y, change
        self._see(first, dt)
        self.elapsed[first] = self.elapsed[first] + 1
        return attempts

    @ti.func
    def _time(self, first):
        return self.elapsed[first] * self.table.dt[first]

    @ti.func
    def _change(self, first, t, y):
        """d(q, q')/dt of a group's modes for y = (q, q'): the right-hand side of RK45."""
        # By fields and rolled loops: unrolled, eight modes take a minute to compile.
        for k in ti.static(range(2 * self.modes)):
            self.tried[first, k] = y[k]
        start = self._time(first)
        base = self.excitation.base.at(first, start, t)
        push = self.excitation.force.at(first, start, t)[0]
        for k in range(self.modes):
            spring = self.stiffness[k] * (self.share[k] * base[0] - self.tried[first, k])
            speed = self.share[k] * base[1] - self.tried[first, self.modes + k]
            by_filling = self.constant[first, k] - base[2] * self.lag[first, k]
            by_structure = spring + self.damping[k] * speed
            self.pull[first, k] = by_structure + self.pushed[k] * push + by_filling
        self._set_gain(first)
        change = y
        for k in ti.static(range(self.modes)):
            change[k], change[self.modes + k] = y[self.modes + k], self.gain[first, k]
        return change

    @ti.func
    def _set_gain(self, first):
        for i in range(self.modes):
            gain = 0.0
            for j in range(self.modes):
                gain += self.inverse[first, i, j] * self.pull[first, j]
            self.gain[first, i] = gain

    @ti.func
    def _renew_slope(self, first):
        self.slope[first] = self._change(first, 0.0, self.state[first])

    @ti.func
    def _renew_inverse(self, first):
        """Inverse of m + sum carried shape shape^T."""
        # With g = inverse shape, place by place: inverse - c g g^T / (1 + c shape.g) (Sherman and
        # Morrison, Ann. Math. Stat. 21 (1950) 124).
        for i in range(self.modes):
            for j in range(self.modes):
                self.inverse[first, i, j] = 0.0
            self.inverse[first, i, i] = 1.0 / self.mass[i]
        for s in range(first, first + self.boxed[None]):
            self._carry(first, s, self.carried)

    @ti.func
    def _renew_load(self, first):
        self._renew_inverse(first)
        for i in range(self.modes):
            self.constant[first, i], self.lag[first, i] = 0.0, 0.0
        for s in range(first, first + self.boxed[None]):
            c, dt = self.carried[s], self.table.dt[first]
            force = self.impulse[s] / dt - c * self.table.gravity[s]
            for k in range(self.modes):
                shape = self.shape[s, k]
                self.constant[first, k] = self.constant[first, k] + force * shape
                self.lag[first, k] = self.lag[first, k] + c * self.residual[s] * shape
        self.changed[first] = 0

    @ti.func
    def _carry(self, first, s, masses: ti.template()):
        """Add the masses of all boxes at a place to the modal masses, at the first of its boxes."""
        c = 0.0
        for other in range(s, first + self.boxed[None]):
            if self.home[other] == s - first:
                c += masses[other]
        if c > 0.0:
            self._push(first, s)
            more = 1.0
            for k in range(self.modes):
                more += c * self.shape[s, k] * self.gain[first, k]
            for i in range(self.modes):
                for j in range(self.modes):
                    less = c / more * self.gain[first, i] * self.gain[first, j]
                    self.inverse[first, i, j] = self.inverse[first, i, j] - less

    @ti.func
    def _strike(self, first):
        """Accelerations of the modes by the impacts of the step."""
        for k in range(self.modes):
            struck = 0.0
            for s in range(first, first + self.boxed[None]):
                struck += self.impulse[s] / self.table.dt[first] * self.shape[s, k]
            self.pull[first, k] = struck
        self._set_gain(first)

    @ti.func
    def _see(self, first, t):
        """Motion of all places at t in the step; its impacts are left out of the acceleration."""
        base = self.excitation.base.at(first, self._time(first), t)
        self._strike(first)
        for k in ti.static(range(self.modes)):
            self.gain[first, k] = self.slope[first][self.modes + k] - self.gain[first, k]
            self.tried[first, k] = self.state[first][k]
            self.tried[first, self.modes + k] = self.state[first][self.modes + k]
        for s in range(first, first + self.group[None]):
            seen = self.residual[s] * base
            for k in range(self.modes):
                x, v = self.tried[first, k], self.tried[first, self.modes + k]
                seen += self.shape[s, k] * ti.Vector([x, v, self.gain[first, k]])
            self.seen[s] = seen
