"""What acts on a body itself: loads, and dashpots between it and the ground; their account.

Times from and up to which each load acts on a body leave no gap, so that no pulse is lost: each
begins where the last one of its body ended. A load that changes acts up to the middle of the step,
where the leapfrog has the new velocity: of second order without dashpots. One that does not acts
for the step itself, as springs do: it balances them also where steps change, and may be behind or
ahead until it changes. The ground is solved in the body's own update.
"""

import taichi as ti

from taichi_dem.kit.products import cross, dot, norm, squared, stacked
from taichi_dem.kit.types import real, vec2, vec3
from taichi_dem.physics.ground import braked_twist, twist_of
from taichi_dem.physics.rotation import world_tensor
from taichi_dem.physics.wrench import plus, zero_block


@ti.data_oriented
class BodyLoads:
    """Base of ``Advance``, which owns all that is used here."""

    @ti.func
    def loaded(self, i, step, linear, angular, times: ti.template()):
        """Impulse and moment with those of the loads added, and a row for each of ``drives``.

        times: ``load_of_step`` or ``load_up_to``, with the step [s] that it takes.
        """
        kick = ti.Matrix.zero(real, ti.static(max(1, len(self.tables.drives))), 6)
        now = self.schedule.seconds(self.state.tick[None])
        for e in ti.static(range(len(self.tables.loads))):
            if self.tables.loads[e].acts_on(i):
                motion, length = times(i, e, now, step)
                force, torque = self.tables.loads[e].wrench(i, motion)
                linear += force * length
                angular += torque * length
                for k in ti.static(range(3)):
                    kick[e, k], kick[e, 3 + k] = force[k] * length, torque[k] * length
        return linear, angular, kick

    @ti.func
    def start_loads(self, i, half):
        """Begin all loads half a step [s] before the present, as velocities do."""
        for e in ti.static(range(len(self.tables.loads))):
            self.state.lag[i][e] = half

    @ti.func
    def load_of_step(self, i, e: ti.template(), now, elapsed):
        """Motion of body i for load e in the step up to a time, and how long it acts [s]."""
        begin = now - elapsed
        since = begin - self.state.lag[i][e]
        until, length = since + elapsed, elapsed
        if ti.static(self.tables.loads[e].varies):
            middle = begin + 0.5 * elapsed
            if self.tables.loads[e].changes(since, ti.max(until, middle)):
                until, length = middle, middle - since
                self.state.lag[i][e] = 0.5 * elapsed
        return self.state.body_motion(i, begin, elapsed, since, until), length

    @ti.func
    def load_up_to(self, i, e: ti.template(), now, step):
        """The same from there to the present, half of the coming step [s]; nothing changes."""
        since, length = now - self.state.lag[i][e], 0.5 * step
        if ti.static(self.tables.loads[e].varies):
            if self.tables.loads[e].changes(since, now):
                length = self.state.lag[i][e]
        return self.state.body_motion(i, now, step, since, now), length

    @ti.func
    def with_ground(self, rows, linear, angular, kick):
        """Impulse, moment and rows of ``loaded`` with those of the ground added."""
        pushed, turned = vec3(0.0), vec3(0.0)
        for e, k in ti.static(ti.ndrange(len(self.tables.ground), 3)):
            pushed[k] += rows[e, k]
            turned[k] += rows[e, 3 + k]
        for e, k in ti.static(ti.ndrange(len(self.tables.ground), 6)):
            kick[ti.static(len(self.tables.loads)) + e, k] = rows[e, k]
        return linear + pushed, angular + turned, kick

    @ti.func
    def ground_impulses(self, i, elapsed, linear, angular):
        """Impulse and moment of each ground on body i in a step of elapsed [s], a row each.

        linear [N s], angular [N m s]: what the body gathers in the step besides.
        """
        rows = ti.Matrix.zero(real, ti.static(len(self.tables.ground)), 6)
        total, joined = zero_block(), 0
        for effect in ti.static(self.tables.ground):
            if effect.acts_on(i):
                total, joined = plus(total, effect.resistance(i)), 1
        if joined == 1:
            rotation, mass = self.state.rotation[i], self.tables.mass[i]
            velocity, spin = braked_twist(
                mass,
                world_tensor(rotation, self.tables.inertia[i]),
                total,
                mass * self.state.velocity[i] + 0.5 * linear,
                self.state.angular_momentum[i] + 0.5 * angular,
                elapsed,
            )
            rows = self.ground_shares(i, elapsed, velocity, spin)
        return rows

    @ti.func
    def ground_shares(self, i, elapsed, velocity, spin):
        """Impulse and moment of each ground at a mean velocity and spin, a row each."""
        rows = ti.Matrix.zero(real, ti.static(len(self.tables.ground)), 6)
        for e in ti.static(range(len(self.tables.ground))):
            if self.tables.ground[e].acts_on(i):
                force, moment = twist_of(self.tables.ground[e].resistance(i), velocity, spin)
                for k in ti.static(range(3)):
                    rows[e, k], rows[e, 3 + k] = -elapsed * force[k], -elapsed * moment[k]
        return rows

    @ti.func
    def _book_loads(self, i, kick, velocity, momentum):
        """Book loads and ground of body i at a mean velocity and angular momentum."""
        for effect, e, account, bit in ti.static(self.tables.drives):
            if effect.acts_on(i):
                push = vec3(kick[e, 0], kick[e, 1], kick[e, 2])
                twist = vec3(kick[e, 3], kick[e, 4], kick[e, 5])
                if squared(push) + squared(twist) > 0.0:
                    self.state.note_active(i, ti.i64(1 << bit))
                work = dot(push, velocity) + dot(twist, self.spin(i, momentum))
                self._book(i, account, work, push, twist)

    @ti.func
    def _book(self, i, account, work, push, twist):
        """Book work [J] to an account, and impulse and moment about the origin to body i."""
        self.state.load_work[i][account] = self.state.load_work[i][account] + work
        twist += cross(self.state.position[i], push)
        self.state.load_impulse[i] = self.state.load_impulse[i] + stacked(push, twist)
        self.state.impulse_sizes[i] = self.state.impulse_sizes[i] + vec2(norm(push), norm(twist))
