"""Dashpots between bodies and the ground in the sweeps of a solved step."""

import taichi as ti

from taichi_dem.kit.allocation import raise_to
from taichi_dem.kit.products import matvec, squared, stacked
from taichi_dem.kit.types import real
from taichi_dem.physics.ground import braked_twist, twist_of
from taichi_dem.physics.rotation import world_tensor
from taichi_dem.step.implicit.velocities import Velocities
from taichi_dem.step.multirate.schedule import Schedule


@ti.data_oriented
class GroundSweeps:
    """Impulses of the ground, one row of impulse and moment for each effect of a body.

    impulse: [N s] and [N m s], that of the step before as a first guess. They are those of the mean
    of the velocities at both ends of the step, as of every ground.
    """

    def __init__(self, schedule: Schedule, velocities: Velocities):
        self.tables, self.state = schedule.tables, schedule.state
        self.schedule, self.velocities = schedule, velocities
        rows, n = len(self.tables.ground), self.tables.capacity.bodies
        self.impulse = ti.Matrix.field(rows, 6, real, shape=n)

    @ti.func
    def visit(self, i):
        """Solve the dashpots of body i."""
        for e in ti.static(range(len(self.tables.ground))):
            if self.tables.ground[e].acts_on(i):
                self._visit(i, e)

    @ti.func
    def _visit(self, i, e: ti.template()):
        """Change the impulse by what is missing, as far as the body then gives way.

        The mass of a free body bounds the change where supports hold it: it converges all the same.
        """
        dt, resistance = self.schedule.step_seconds[0], self.tables.ground[e].resistance(i)
        twist, mass = self.velocities.twist[i], self.tables.mass[i]
        rotation = self.state.rotation[i]
        inertia = world_tensor(rotation, self.tables.inertia[i])
        force, moment = twist_of(
            resistance,
            0.5 * (self.state.velocity[i] + twist[0:3]),
            0.5 * (self.state.spin[i] + twist[3:6]),
        )
        missing = -dt * stacked(force, moment)
        for k in ti.static(range(6)):
            missing[k] -= self.impulse[i][e, k]
        velocity, spin = braked_twist(mass, inertia, resistance, missing[0:3], missing[3:6], dt)
        change = stacked(mass * velocity, matvec(inertia, spin))
        self.velocities.push(i, change[0:3], change[3:6])
        for k in ti.static(range(6)):
            self.impulse[i][e, k] = self.impulse[i][e, k] + change[k]
        raise_to(self.velocities.change2, squared(velocity))
