"""A step of one length for all bodies, in which the dashpots of bonds and contacts are solved.

Velocities are predicted with the impulses of springs and loads at the beginning and of the dashpots
as in the step before; sweeps over all dashpots correct them. Dashpots act with the mean of the
velocities before and after: of second order, and velocities are of the middle of the next step.
"""

import taichi as ti

from taichi_dem.contact.search import BroadPhase
from taichi_dem.kit.allocation import raise_to
from taichi_dem.kit.ordered import Once
from taichi_dem.kit.products import matvec, squared, stacked, transposed_matvec
from taichi_dem.kit.types import vec3
from taichi_dem.physics.rotation import unit3, world_tensor
from taichi_dem.step.implicit.solver import Solver
from taichi_dem.step.multirate.schedule import Schedule
from taichi_dem.step.phases import (
    ABSENT,
    ALWAYS,
    START,
    STARTED,
    STEP,
    SWEEP,
    Step,
    given,
)


@ti.data_oriented
class SolvedStep(Step):
    """The leapfrog with solved dashpots."""

    solves = True

    def __init__(self, schedule: Schedule, search: BroadPhase | None):
        super().__init__(schedule, search)
        self.solver = Solver(schedule)

    def phases(self) -> tuple:
        """The phases in order."""
        schedule, lists, solver = self.schedule, self.schedule.lists, self.solver
        once, bodies, bonds = Once(), lists.bodies.everyone, lists.bonds.everyone
        sleep, waking = schedule.sleeping or ABSENT, schedule.waking or ABSENT
        dashpots, pairs = solver.bonds or ABSENT, solver.pairs or ABSENT
        ground = solver.ground or ABSENT
        return (
            # Who sleeps; all lists; how each body gives way; a first guess of the dashpots.
            (START, bodies, sleep.begin),
            (START, bodies, sleep.begin_beside),
            (START, bodies, self.first_level),
            (START, once, schedule.level_all),
            (START, once, waking.begin),
            (START, lists.filling()),
            (START, once, schedule.end_listing),
            (START, bodies, self.update_inertia),
            (START, bonds, dashpots.first),
            # Contacts that act, or may within the step, are found, and coloured: those of one
            # colour share no body.
            (STEP, lists.pairs, pairs.begin),
            (STEP, pairs.phases),
            # The clock moves on.
            (STEP, once, schedule.advance_clock),
            # The speed from which on a body wakes those that sleep beside it.
            (STEP, sleep, sleep.chunk),
            (STEP, once, waking.sort),
            # Velocities are predicted with springs, loads and the dashpots of the step before.
            (STEP, once, solver.begin),
            (STEP, lists.bodies, self.predict),
            # Sweeps correct them until no dashpot changes them further.
            (SWEEP, dashpots.by_colour, dashpots.visit),
            (SWEEP, pairs.by_colour, pairs.visit),
            (SWEEP, lists.bodies, ground.visit),
            (SWEEP, once, solver.check_convergence),
            # What contacts took is booked.
            (STEP, lists.pairs, pairs.book_sweeps),
            # Bodies take these velocities and move.
            (STEP, lists.bodies, self.body),
            # Bonds that broke leave the lists, bodies that were woken enter them.
            (STEP, schedule.reordering()),
            # Bonds give the impulse of their springs, and break where a unit fails.
            (ALWAYS, lists.bonds, self.bond),
            # At the start bonds have acted once, also those that sleep, and booked a step before.
            (STARTED, waking.leaving),
            (STARTED, given(self.solver.has_bonds, bonds), self.undo),
        )

    @ti.func
    def predict(self, i):
        """Predict the velocities at the end of the step before it is solved."""
        velocities = self.solver.velocities
        linear, angular = self.motion.gathered(i)
        linear, angular, _ = self._pushed(i, linear, angular)
        velocity = self.state.velocity[i] + self.tables.mass_inverse[i] * linear
        spin = self.state.spin[i] + matvec(velocities.turn[i], angular)
        if ti.static(velocities.has_supports):
            momentum = self.state.angular_momentum[i] + angular
            velocities.given[i] = stacked(linear, angular)
            velocity, momentum = self._allowed_in_step(i, velocity, momentum)
            spin = self.loads.spin(i, momentum)
        velocities.twist[i] = stacked(velocity, spin)
        raise_to(self.solver.speed2, squared(self.state.velocity[i]))

    @ti.func
    def _pushed(self, i, linear, angular):
        """Impulse and moment with those of loads and ground, and a row for each of ``drives``."""
        elapsed = self.schedule.elapsed(i)
        loads = self.loads
        linear, angular, kick = loads.loaded(i, elapsed, linear, angular, loads.load_of_step)
        if ti.static(loads.has_ground):
            rows = self.solver.ground.impulse[i]
            linear, angular, kick = loads.with_ground(rows, linear, angular, kick)
        return linear, angular, kick

    @ti.func
    def body(self, i):
        """Bring a body to the present tick with the velocities found by the sweeps."""
        elapsed = self.schedule.elapsed(i)
        velocity, momentum = self._found(i)
        _linear, _angular, kick = self._pushed(i, vec3(0.0), vec3(0.0))
        velocity, momentum = self.loads.supported(i, elapsed, kick, velocity, momentum)
        self.motion.drift(i, elapsed, velocity, momentum, self.loads.spin(i, momentum))
        self.state.velocity[i], self.state.angular_momentum[i] = velocity, momentum
        # The next step begins with the spin in the new orientation.
        self.state.spin[i] = self.loads.spin(i, momentum)
        self.update_inertia(i)
        self.schedule.choose_level(i, squared(velocity))

    @ti.func
    def _found(self, i):
        """Velocity and angular momentum at the end of the step, before supports act."""
        velocities, rotation = self.solver.velocities, self.state.rotation(i)
        twist = velocities.twist[i]
        velocity = twist[0:3]
        change = transposed_matvec(rotation, twist[3:6] - self.state.spin[i])
        momentum = self.state.angular_momentum[i] + matvec(
            rotation, matvec(self.tables.inertia[i], change)
        )
        if ti.static(velocities.has_supports):
            given = velocities.given[i]
            velocity = self.state.velocity[i] + self.tables.mass_inverse[i] * given[0:3]
            momentum = self.state.angular_momentum[i] + given[3:6]
        return velocity, momentum

    @ti.func
    def update_inertia(self, i):
        """Compute the velocity per impulse of body i in its present orientation."""
        velocities, inverse = self.solver.velocities, self.tables.inertia_inverse[i]
        velocities.lightness[i] = self.tables.mass_inverse[i]
        velocities.turn[i] = world_tensor(self.state.rotation(i), inverse)
        if ti.static(velocities.has_supports):
            self._support(i)

    @ti.func
    def _support(self, i):
        """Apply the supports, which are linear, to the unit impulses and moments."""
        velocities, unit = self.solver.velocities, unit3()
        turn = velocities.turn[i]
        rest, rest_turn = self._allowed_in_step(i, 0.0 * unit[0, :], 0.0 * unit[0, :])
        for k in ti.static(range(3)):
            axis = unit[:, k]
            velocity, _ = self._allowed_in_step(i, self.tables.mass_inverse[i] * axis, 0.0 * axis)
            moved, momentum = self._allowed_in_step(i, 0.0 * axis, axis)
            spin = matvec(turn, momentum - rest_turn)
            for r in ti.static(range(3)):
                velocities.hold[i][r, k] = velocity[r] - rest[r]
                velocities.turn[i][r, k] = spin[r]
                if ti.static(velocities.couples):
                    velocities.coupling[i][r, k] = moved[r] - rest[r]

    @ti.func
    def _allowed_in_step(self, i, velocity, momentum):
        """Velocity and angular momentum that the supports of body i allow in the present step."""
        now, step = self.schedule.seconds(self.state.tick[None]), self.schedule.step_seconds[0]
        return self.loads.allowed(i, now - 0.5 * step, step, velocity, momentum)

    @ti.func
    def bond(self, b):
        """Evaluate the three contact units of a bond; release it when one of them fails."""
        if self.bonds.is_pending(b):
            slots, moved, dt = (
                self.tables.bond_slots[b],
                self.state.bond_motion(b),
                self.schedule.step_seconds[0],
            )
            motion = self._answered(b, moved)
            answer = self.bonds.answer(b, dt, motion, moved)
            if answer.failed == 0:
                self.bonds.pull(b, dt, motion, answer)
                if ti.static(self.solver.has_bonds):
                    self.solver.bonds.begin(b, slots[0] >> 2, slots[1] >> 2, motion.branch)
            else:
                # Booked for the step before: it was full, though a unit fails now.
                self.bonds.book_drag(b, answer.dragged * (self.tables.unit_area[b] * dt))
                self.bonds.release(b, motion, answer)
                if ti.static(self.solver.has_bonds):
                    self.solver.bonds.end(b)

    @ti.func
    def _answered(self, b, motion):
        """A motion with the twist that the dashpots of a bond answered in the step before."""
        if ti.static(self.solver.has_bonds):
            motion = self.solver.bonds.mean(b, motion)
        return motion

    @ti.func
    def undo(self, b):
        """Take back the dashpot heat of bond b, and take it out of the sweeps if it sleeps."""
        self.state.bond_drag[b] = 0.0
        if ti.static(self.schedule.sleeps):
            if self.schedule.lists.bonds.key[b] < 0:
                self.solver.bonds.end(b)

    @ti.func
    def bond_power(self, b, motion):
        """Power that the dashpots of an intact bond take at a motion [W]."""
        return self.bonds.power(b, self._answered(b, motion))

    @ti.func
    def forces_now(self, p):
        """Forces of a pair's contacts in the last step, a ``PairForces``."""
        return self.solver.pairs.forces_of(p, 0.0, 0.0, False)
