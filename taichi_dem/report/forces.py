"""Forces that loads, ground and supports exert on the bodies at the present time."""

import numpy as np
import taichi as ti

from taichi_dem.kit.allocation import values
from taichi_dem.kit.launch import Launch
from taichi_dem.kit.types import vec3
from taichi_dem.report.readings import Readings
from taichi_dem.state.model import Model, column_of, names_of

#: Roles of what acts on single bodies, in the order of all arrays here.
_ROLES = ("load", "ground", "support")
_F64 = ti.types.ndarray(dtype=ti.f64, ndim=2)


def force_names(model: Model) -> list[str]:
    """Name of the force of each load, each ground and each support, in this order."""
    named = list(zip(names_of(model.effects), model.effects))
    return [
        f"{column_of(name)}_force"
        for role in _ROLES
        for name, effect in named
        if effect.role == role
    ]


@ti.data_oriented
class Forces:
    """Reads what acts on single bodies; nothing changes in the run."""

    def __init__(self, readings: Readings):
        self.readings, self.loads = readings, readings.step.loads
        self.tables, self.state = readings.tables, readings.state
        self.schedule, self.small = readings.schedule, readings.small
        self.answers = bool(self.tables.ground or self.tables.supports)
        self.count = len(self.tables.drives) + len(self.tables.supports)
        self._launch = Launch(self._act)

    def sums(self) -> np.ndarray:
        """Force of each load, ground and support on all bodies [N], (count, 3)."""
        return self.on_bodies().sum(axis=1)

    def on_bodies(self) -> np.ndarray:
        """Force of each load, ground and support on every body [N], (count, bodies, 3)."""
        return self.readings.once("forces", self._found)

    def _found(self):
        bodies = int(values(self.tables.body_count))
        table = np.empty((bodies, 3 * self.count))
        if self.count:
            # Loads alone ask for no other forces.
            contacts = self.readings.contact_wrenches() if self.answers else np.zeros((1, 6))
            self._launch(contacts, table)
        return np.moveaxis(table.reshape(bodies, self.count, 3), 1, 0)

    @ti.kernel
    def _act(self, contacts: _F64, table: _F64):
        """Fill in the forces on every body, three columns each; contacts: wrenches of these."""
        ti.loop_config(serialize=ti.static(self.small))
        for i in range(self.tables.body_count[None]):
            # Of an array that a kernel only writes, a card has no copy of what was in it.
            for k in range(ti.static(3 * self.count)):
                table[i, k] = 0.0
            now, step = self.schedule.seconds(self.state.tick[None]), self.schedule.own_step(i)
            force, moment = vec3(0.0), vec3(0.0)
            if ti.static(self.answers):
                force, moment = self._of_bonds(i)
                for k in ti.static(range(3)):
                    force[k], moment[k] = force[k] + contacts[i, k], moment[k] + contacts[i, 3 + k]
            force, moment = self._load(table, i, now, step, force, moment)
            if ti.static(self.loads.has_ground):
                force, moment = self._brake(table, i, step, force, moment)
            if ti.static(len(self.tables.supports) > 0):
                self._hold(table, i, now, step, force, moment)

    @ti.func
    def _of_bonds(self, i):
        """Force [N] and moment [N m] of its bonds on body i, of the impulses for their steps."""
        force, moment = vec3(0.0), vec3(0.0)
        for f in range(4):
            j = self.tables.neighbour[4 * i + f]
            if j >= 0:
                taken = self.state.slot[4 * i + f] / self.schedule.pair_step(i, j)
                force += taken[0:3]
                moment += taken[3:6]
        return force, moment

    @ti.func
    def _load(self, table: ti.template(), i, now, step, force, moment):
        """Note the loads on body i; the force [N] and moment [N m] on it with theirs."""
        for e in ti.static(range(len(self.tables.loads))):
            if self.tables.loads[e].acts_on(i):
                since, until = now - 0.5 * step, now + 0.5 * step
                motion = self.state.body_motion(i, now, step, since, until)
                push, twist = self.tables.loads[e].wrench(i, motion)
                self._note(table, i, e, push)
                force += push
                moment += twist
        return force, moment

    @ti.func
    def _brake(self, table: ti.template(), i, step, force, moment):
        """Likewise the ground."""
        rows = self.loads.ground_impulses(i, step, step * force, step * moment)
        for e in ti.static(range(len(self.tables.ground))):
            push = vec3(rows[e, 0], rows[e, 1], rows[e, 2]) / step
            self._note(table, i, ti.static(len(self.tables.loads) + e), push)
            force += push
            moment += vec3(rows[e, 3], rows[e, 4], rows[e, 5]) / step
        return force, moment

    @ti.func
    def _hold(self, table: ti.template(), i, now, step, force, moment):
        """Note the supports of body i: what they take of the motion that the rest would give."""
        velocity = self.state.velocity[i] + step * self.tables.mass_inverse[i] * force
        momentum = self.state.angular_momentum[i] + step * moment
        for k, effect in ti.static(enumerate(self.tables.supports)):
            if effect.acts_on(i):
                before, middle = velocity, now + 0.5 * step
                velocity, momentum = effect.held(
                    i, middle, step, self.state.rotation(i), velocity, momentum
                )
                push = self.tables.mass[i] / step * (velocity - before)
                self._note(table, i, ti.static(len(self.tables.drives) + k), push)

    @ti.func
    def _note(self, table: ti.template(), i, place: ti.template(), push):
        for k in ti.static(range(3)):
            table[i, 3 * place + k] = push[k]
