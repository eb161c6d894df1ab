"""Advance one bond, one contact pair, one body: the only class that composes the physics.

Its bonds are in ``bond``, its pairs in ``contact_force``. Drivers choose the active members and
call these functions; nothing else applies a force or moves a body. A bond or pair evaluated at a
tick applies the impulse F * (smaller of their steps) to both bodies, with opposite signs; a body
takes the sum at its own time (Konno et al., 3.1, eq. 3): v += S / m, L += T, then x += dt v and
q = exp(dt w) q, with the spin w in the middle of the turn.

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
from taichi_dem.physics.rotation import mean_spin, spin_of, turned, world_tensor
from taichi_dem.physics.wrench import plus, zero_block
from taichi_dem.step.bond import BondStep
from taichi_dem.step.contact_force import ContactForce, TangentialSprings
from taichi_dem.step.implicit.solver import Solver
from taichi_dem.step.multirate.schedule import Schedule
from taichi_dem.step.sleeping import ASLEEP


@ti.data_oriented
class BodyLoads:
    """Base of ``Advance``, which owns all that is used here."""

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


@ti.data_oriented
class Advance(BondStep, ContactForce, BodyLoads):
    """The order in which physics and effects act; see the module.

    staggered: whether velocities are half a step behind positions, as the leapfrog's are. An order
    of one's own that keeps both at one time sets it to False.
    """

    staggered = True

    def __init__(self, schedule: Schedule, solver: Solver | None = None):
        self.schedule, self.tables, self.state = schedule, schedule.tables, schedule.state
        tables = self.tables
        self.on_demand = tables.on_demand and not tables.bond.is_null
        # Where no law is missing, no limit is to be watched for.
        self.notes_limits = not tables.bond.is_whole
        self.has_ground = bool(tables.ground)
        self.solver, self.solves = solver, solver is not None
        self.solves_bonds = self.solves and solver.has_bonds
        self.contacts, self.has_contact = schedule.contacts, schedule.has_contact
        if not self.solves:
            self.springs = TangentialSprings(schedule)
        # Without fast_math a product with zero is not folded: absent terms must not be written.
        self.has_dashpot = bool(tables.dashpot.name)
        self.limits, self.has_limits = schedule.limits, schedule.has_limits
        self.limited = self.has_limits and schedule.limits.limited

    @ti.func
    def body(self, i):
        """Bring a body to the present tick and choose its next step."""
        elapsed = self.schedule.elapsed(i)
        linear, angular = self._gathered(i)
        velocity, momentum = self._kicked(i, elapsed, linear, angular)
        spin = self.spin(i, momentum)
        self._drift(i, elapsed, velocity, momentum, spin)
        self.state.velocity[i], self.state.angular_momentum[i] = velocity, momentum
        self.state.spin[i] = spin
        self.schedule.choose_level(i, squared(velocity))

    @ti.func
    def wake_up(self, i):
        """Bring body i to the present tick when it wants a shorter step because of an event."""
        noticed = self.limits.events[i] != 0
        self.limits.events[i] = 0
        if ti.static(self.schedule.sleeps):
            noticed = noticed and self.schedule.sleeping.awake[i] != ASLEEP
        if noticed:
            wanted, bound = self.schedule.controlled_level(i)
            if ti.static(self.schedule.uniform):
                ti.atomic_max(self.schedule.wanted[None], wanted)
                self.state.bound[i] = bound
            elif wanted > self.state.level[i]:
                ti.atomic_add(self.limits.woken[None], 1)
                # The present is a time of level low and finer levels only.
                self.state.level[i] = ti.max(self.state.level[i], self.schedule.low[None])
                self.schedule.note_change(i)
                if self.state.last_tick[i] < self.state.tick[None]:
                    self.body(i)
                else:
                    self.schedule.choose_level(i, 0.0)

    @ti.func
    def _drift(self, i, elapsed, velocity, momentum, spin):
        """Move and turn body i from a spin; note its displacement, and a runaway; wake others."""
        turning = self._turning(i, elapsed, momentum, spin)
        self.state.orientation[i] = turned(self.state.orientation[i], turning, elapsed)
        self.state.position[i] = self.state.position[i] + elapsed * velocity
        self.state.last_tick[i] = self.state.tick[None]
        if ti.static(self.tables.on_demand):
            self.schedule.sleeping.stir(i, elapsed, velocity, momentum)
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

    @ti.func
    def _gathered(self, i):
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
    def _kicked(self, i, elapsed, linear, angular):
        """Velocity and angular momentum after all impulses, as the supports allow; books work."""
        linear, angular, kick = self.loaded(i, elapsed, linear, angular, self.load_of_step)
        if ti.static(self.has_ground):
            rows = self.ground_impulses(i, elapsed, linear, angular)
            linear, angular, kick = self.with_ground(rows, linear, angular, kick)
        velocity = self.state.velocity[i] + linear * self.tables.mass_inverse[i]
        momentum = self.state.angular_momentum[i] + angular
        return self._supported(i, elapsed, kick, velocity, momentum)

    @ti.func
    def spin(self, i, momentum):
        """World spin of body i at an angular momentum, in its present orientation."""
        return spin_of(self.state.rotation(i), self.tables.inertia_inverse[i], momentum)

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
    def _supported(self, i, elapsed, kick, velocity, momentum):
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
