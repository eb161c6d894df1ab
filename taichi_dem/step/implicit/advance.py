"""Advance a body in a step whose dashpots are solved together; bonds are as in ``Advance``."""

import taichi as ti

from taichi_dem.kit.allocation import raise_to
from taichi_dem.kit.products import squared
from taichi_dem.kit.types import vec3
from taichi_dem.step.advance import Advance


@ti.data_oriented
class SolvedAdvance(Advance):
    """``Advance`` with bodies that take their new velocities from a ``Solver``.

    Velocities at the end of the step are predicted with the impulses of springs and loads at its
    beginning and of the dashpots as in the step before; the sweeps correct them. Springs and loads
    act at the time of the positions, dashpots with the mean of the velocities before and after: the
    scheme is of second order, and the velocities are those in the middle of the next step.
    """

    @ti.func
    def predict(self, i):
        """Predict the velocities at the end of the step before it is solved."""
        elapsed = self.schedule.elapsed(i)
        linear, angular = self._gathered(i)
        linear, angular, kick = self.loaded(i, elapsed, linear, angular, self.load_times.of_step)
        if ti.static(self.ground.present):
            linear, angular, kick = self.ground.added(
                self.solver.ground.impulse[i], linear, angular, kick
            )
        self.solver.velocities.predict(i, self, linear, angular)
        raise_to(self.solver.speed2, squared(self.state.velocity[i]))

    @ti.func
    def body(self, i):
        """Bring a body to the present tick with the velocities found by the sweeps."""
        elapsed = self.schedule.elapsed(i)
        velocity, momentum = self.solver.velocities.found(i)
        linear, angular, kick = self.loaded(
            i, elapsed, vec3(0.0), vec3(0.0), self.load_times.of_step
        )
        if ti.static(self.ground.present):
            linear, angular, kick = self.ground.added(
                self.solver.ground.impulse[i], linear, angular, kick
            )
        velocity, momentum = self._supported(i, elapsed, kick, velocity, momentum)
        self._drift(i, elapsed, velocity, momentum, self.spin(i, momentum))
        self.state.velocity[i], self.state.angular_momentum[i] = velocity, momentum
        # The next step begins with the spin in the new orientation.
        self.state.spin[i] = self.spin(i, momentum)
        self.solver.velocities.update_inertia(i, self)
        self.schedule.choose_level(i, squared(velocity))

    @ti.func
    def forces_now(self, p):
        """Forces of a pair's contacts in the last step, a ``PairForces``."""
        return self.solver.pairs.last_forces(p)

    @ti.func
    def allowed_in_step(self, i, velocity, momentum):
        """Velocity and angular momentum that the supports of body i allow in the present step."""
        now, step = self.schedule.seconds(self.state.tick[None]), self.schedule.step_seconds[0]
        return self.allowed(i, now - 0.5 * step, step, velocity, momentum)
