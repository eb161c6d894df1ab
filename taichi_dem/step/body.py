"""What a body takes in a step, from its neighbours and from outside, and how it moves.

Times over which each load acts on a body leave no gap, so no pulse is lost. A load that changes
acts up to the middle of the step, where the leapfrog has the new velocity: of second order without
dashpots. One that does not acts for the step itself, as springs do, and balances them.
"""

import taichi as ti

from taichi_dem.kit.products import cross, dot, norm, squared, stacked
from taichi_dem.kit.types import real, vec2, vec3
from taichi_dem.physics.ground import braked_twist, twist_of
from taichi_dem.physics.rotation import mean_spin, spin_of, turned, world_tensor
from taichi_dem.physics.wrench import plus, zero_block
from taichi_dem.step.multirate.schedule import Schedule


@ti.data_oriented
class BodyStep:
    """Impulses in the slots of a body, and its drift."""

    def __init__(self, schedule: Schedule):
        self.schedule, self.tables, self.state = schedule, schedule.tables, schedule.state
        self.contacts, self.has_contact = schedule.contacts, schedule.has_contact
        self.sleeps, self.sleeping = schedule.sleeps, schedule.sleeping

    @ti.func
    def gathered(self, i):
        """Collect the impulse and moment in the slots of a body, always summed in one order."""
        linear, angular = vec3(0.0), vec3(0.0)
        for f in range(4):
            taken = self.state.slot[4 * i + f]
            linear += taken[0:3]
            angular += taken[3:6]
            if ti.static(not self.schedule.every_bond_acts):
                self.state.slot[4 * i + f] = 0.0 * taken
        if ti.static(self.has_contact):
            pushed, twisted = self.contacts.gather(i)
            linear += pushed
            angular += twisted
        return linear, angular

    @ti.func
    def drift(self, i, elapsed, velocity, momentum, spin):
        """Move and turn body i from a spin; note its displacement, and a runaway; wake others."""
        turning = self._turning(i, elapsed, momentum, spin)
        self.state.orientation[i] = turned(self.state.orientation[i], turning, elapsed)
        self.state.position[i] = self.state.position[i] + elapsed * velocity
        self.state.last_tick[i] = self.state.tick[None]
        if ti.static(self.sleeps):
            self.sleeping.stir(i, elapsed, velocity, momentum)
        if ti.static(self.has_contact):
            self.contacts.moved(i, velocity, spin, elapsed)
        speed2 = squared(velocity)
        # One comparison finds runaway, infinity and NaN; "v != v" would be folded away.
        if not (speed2 + squared(spin) * self.tables.radius[i] ** 2 < self.state.max_speed2[None]):
            ti.atomic_min(self.state.bad_body[None], i)

    @ti.func
    def _turning(self, i, elapsed, momentum, spin):
        """World spin in the middle of the step [rad/s], as supports allow."""
        inverse = self.tables.inertia_inverse[i]
        turning = mean_spin(self.state.rotation(i), inverse, momentum, spin, elapsed)
        for effect in ti.static(self.tables.supports):
            if effect.acts_on(i):
                turning = spin
        return turning


@ti.data_oriented
class BodyLoads:
    """What acts on a body from outside."""

    def __init__(self, schedule: Schedule):
        self.schedule, self.tables, self.state = schedule, schedule.tables, schedule.state
        self.has_ground = bool(self.tables.ground)

    @ti.func
    def spin(self, i, momentum):
        """World spin of body i at an angular momentum, in its present orientation."""
        return spin_of(self.state.rotation(i), self.tables.inertia_inverse[i], momentum)

    @ti.func
    def loaded(self, i, step, linear, angular, times: ti.template()):
        """Impulse and moment with those of the loads added, and a row for each of ``drives``."""
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
        middle = begin + 0.5 * elapsed
        if self.tables.loads[e].changes(since, ti.max(until, middle)):
            until, length = middle, middle - since
            self.state.lag[i][e] = 0.5 * elapsed
        return self.state.body_motion(i, begin, elapsed, since, until), length

    @ti.func
    def load_up_to(self, i, e: ti.template(), now, step):
        """The same from there to the present, half of the coming step [s]; nothing changes."""
        since, length = now - self.state.lag[i][e], 0.5 * step
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
        """Impulse and moment of each ground on body i in a step of elapsed [s], a row each."""
        rows = ti.Matrix.zero(real, ti.static(len(self.tables.ground)), 6)
        total, joined = zero_block(), 0
        for effect in ti.static(self.tables.ground):
            if effect.acts_on(i):
                total, joined = plus(total, effect.resistance(i)), 1
        if joined == 1:
            rotation, mass = self.state.rotation(i), self.tables.mass[i]
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

    @ti.func
    def allowed(self, i, time, step, velocity, momentum):
        """Velocity and angular momentum that the supports of body i allow; nothing is booked."""
        for effect in ti.static(self.tables.supports):
            if effect.acts_on(i):
                velocity, momentum = effect.held(
                    i, time, step, self.state.rotation(i), velocity, momentum
                )
        return velocity, momentum

    @ti.func
    def supported(self, i, elapsed, kick, velocity, momentum):
        """Velocity and angular momentum that supports allow; books their work and the loads'."""
        free, free_momentum, held = velocity, momentum, 0
        half = self.schedule.seconds(self.state.tick[None]) - 0.5 * elapsed
        for k, effect in ti.static(enumerate(self.tables.supports)):
            if effect.acts_on(i):
                before, spun = velocity, momentum
                velocity, momentum = effect.held(
                    i, half, elapsed, self.state.rotation(i), velocity, momentum
                )
                held = 1
                if squared(velocity - before) + squared(momentum - spun) > 0.0:
                    self.state.note_active(i, ti.i64(ti.static(1 << len(self.tables.loads) + k)))
        mean = 0.5 * (self.state.velocity[i] + velocity)
        mean_momentum = 0.5 * (self.state.angular_momentum[i] + momentum)
        self._book_loads(i, kick, mean, mean_momentum)
        if ti.static(len(self.tables.supports) > 0):
            if held == 1:
                push, twist = self.tables.mass[i] * (velocity - free), momentum - free_momentum
                work = dot(push, mean) + dot(twist, self.spin(i, mean_momentum))
                self._book(i, ti.static(len(self.tables.loads)), work, push, twist)
        return velocity, momentum
