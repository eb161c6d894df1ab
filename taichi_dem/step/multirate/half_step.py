"""Motion and booked energies brought to the time of the positions."""

import taichi as ti

from taichi_dem.kit.products import dot
from taichi_dem.kit.types import real
from taichi_dem.step.phases import Step


@ti.data_oriented
class HalfStep:
    """Reads what the first half of the coming step does; nothing changes in the run."""

    def __init__(self, step: Step):
        self.step, self.tables, self.state = step, step.tables, step.state
        self.schedule, self.loads, self.staggered = step.schedule, step.loads, step.staggered

    @ti.func
    def is_due(self, i):
        """Whether the velocity of body i is half a step behind the present."""
        due = 0
        if ti.static(self.staggered):
            due = ti.cast(self.state.last_tick[i] == self.state.tick[None], ti.i32)
            for effect in ti.static(self.tables.supports):
                if self.state.tick[None] == 0 and effect.acts_on(i) != 0:
                    due = 0
        return due

    @ti.func
    def impulse(self, i, linear, angular, back):
        """Impulse and moment on body i by which it is behind, and a row for each of ``drives``."""
        for f in range(4):
            linear += 0.5 * self.state.slot[4 * i + f][0:3]
            angular += 0.5 * self.state.slot[4 * i + f][3:6]
        step = self.schedule.own_step(i)
        loads = self.loads
        linear, angular, kick = loads.loaded(i, step, linear, angular, loads.load_up_to)
        if ti.static(loads.has_ground):
            rows = 0.5 * loads.ground_impulses(i, step, 2.0 * linear, 2.0 * angular)
            if back == 1:
                # Of a step around the present: its mean motion is the present one.
                velocity, spin = self.state.velocity[i], self.state.spin[i]
                rows = loads.ground_shares(i, 0.5 * step, velocity, spin)
            linear, angular, kick = loads.with_ground(rows, linear, angular, kick)
        return linear, angular, kick

    @ti.func
    def visit(self, i, pushed, turned, back):
        """Velocity [m/s], angular momentum [kg m^2/s] of body i now, and works in half a step."""
        account = ti.Vector.zero(real, ti.static(len(self.tables.drives) + 1))
        before, spun = self.state.velocity[i], self.state.angular_momentum[i]
        velocity, momentum = before, spun
        if ti.static(self.staggered):
            if back == 1:
                self.loads.start_loads(i, 0.5 * self.schedule.own_step(i))
        if self.is_due(i) == 1:
            linear, angular, kick = self.impulse(i, pushed, turned, back)
            linear *= self.tables.mass_inverse[i]
            if back == 1:
                self.state.velocity[i] = before - linear
                self.state.angular_momentum[i] = spun - angular
                self.state.spin[i] = self.loads.spin(i, spun - angular)
            else:
                now = self.schedule.seconds(self.state.tick[None])
                velocity, momentum = self.loads.allowed(
                    i, now, 0.0, before + linear, spun + angular
                )
                mean = 0.5 * (before + velocity)
                turning = self.loads.spin(i, 0.5 * (spun + momentum))
                for _effect, e, place, _bit in ti.static(self.tables.drives):
                    for k in ti.static(range(3)):
                        work = kick[e, k] * mean[k] + kick[e, 3 + k] * turning[k]
                        account[place] = account[place] + work
                if ti.static(len(self.tables.supports) > 0):
                    push = self.tables.mass[i] * (velocity - (before + linear))
                    work = dot(push, mean) + dot(momentum - (spun + angular), turning)
                    account[ti.static(len(self.tables.loads))] = work
        return velocity, momentum, account

    @ti.func
    def bond_drag(self, b, motion):
        """Energy [J] by which the booked heat of a bond's dashpots is behind the present."""
        slots = self.tables.bond_slots[b]
        step = self.schedule.pair_step(slots[0] >> 2, slots[1] >> 2)
        # A solved dashpot is booked a step late, an explicit one ahead of its step.
        sign = ti.static(0.5 if self.step.solves else -0.5)
        return sign * step * self.step.bond_power(b, motion)

    @ti.func
    def pair_step(self, p):
        """Half of the coming step of a pair of bodies [s]; 0 where nothing is behind."""
        pair = self.schedule.store.body[p]
        return 0.5 * self.schedule.pair_step(pair[0], pair[1])
