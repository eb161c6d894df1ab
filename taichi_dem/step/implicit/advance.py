"""Advance a body in a step whose dashpots are solved together; bonds are as in ``Advance``."""

import taichi as ti

from taichi_dem.kit.allocation import raise_to
from taichi_dem.kit.products import matvec, squared, stacked, transposed_matvec
from taichi_dem.kit.types import vec3
from taichi_dem.physics.rotation import unit3, world_tensor
from taichi_dem.step.advance import Advance
from taichi_dem.step.implicit.solver import Solver
from taichi_dem.step.multirate.schedule import Schedule


@ti.data_oriented
class SolvedAdvance(Advance):
    """``Advance`` with bodies that take their new velocities from a ``Solver``.

    Velocities at the end of the step are predicted with the impulses of springs and loads at its
    beginning and of the dashpots as in the step before; the sweeps correct them. Springs and loads
    act at the time of the positions, dashpots with the mean of the velocities before and after: the
    scheme is of second order, and the velocities are those in the middle of the next step.
    """

    def __init__(self, schedule: Schedule):
        super().__init__(schedule, Solver(schedule))

    @ti.func
    def predict(self, i):
        """Predict the velocities at the end of the step before it is solved."""
        velocities = self.solver.velocities
        linear, angular = self._gathered(i)
        linear, angular, _ = self._pushed(i, linear, angular)
        velocity = self.state.velocity[i] + self.tables.mass_inverse[i] * linear
        spin = self.state.spin[i] + matvec(velocities.turn[i], angular)
        if ti.static(velocities.has_supports):
            momentum = self.state.angular_momentum[i] + angular
            velocities.given[i] = stacked(linear, angular)
            velocity, momentum = self._allowed_in_step(i, velocity, momentum)
            spin = self.spin(i, momentum)
        velocities.twist[i] = stacked(velocity, spin)
        raise_to(self.solver.speed2, squared(self.state.velocity[i]))

    @ti.func
    def _pushed(self, i, linear, angular):
        """Impulse and moment with those of loads and ground, and a row for each of ``drives``."""
        elapsed = self.schedule.elapsed(i)
        linear, angular, kick = self.loaded(i, elapsed, linear, angular, self.load_of_step)
        if ti.static(self.has_ground):
            rows = self.solver.ground.impulse[i]
            linear, angular, kick = self.with_ground(rows, linear, angular, kick)
        return linear, angular, kick

    @ti.func
    def body(self, i):
        """Bring a body to the present tick with the velocities found by the sweeps."""
        elapsed = self.schedule.elapsed(i)
        velocity, momentum = self._found(i)
        _linear, _angular, kick = self._pushed(i, vec3(0.0), vec3(0.0))
        velocity, momentum = self._supported(i, elapsed, kick, velocity, momentum)
        self._drift(i, elapsed, velocity, momentum, self.spin(i, momentum))
        self.state.velocity[i], self.state.angular_momentum[i] = velocity, momentum
        # The next step begins with the spin in the new orientation.
        self.state.spin[i] = self.spin(i, momentum)
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
            _, momentum = self._allowed_in_step(i, 0.0 * axis, axis)
            spin = matvec(turn, momentum - rest_turn)
            for r in ti.static(range(3)):
                velocities.hold[i][r, k] = velocity[r] - rest[r]
                velocities.turn[i][r, k] = spin[r]

    @ti.func
    def forces_now(self, p):
        """Forces of a pair's contacts in the last step, a ``PairForces``."""
        return self.solver.pairs.last_forces(p)

    @ti.func
    def _allowed_in_step(self, i, velocity, momentum):
        """Velocity and angular momentum that the supports of body i allow in the present step."""
        now, step = self.schedule.seconds(self.state.tick[None]), self.schedule.step_seconds[0]
        return self.allowed(i, now - 0.5 * step, step, velocity, momentum)
