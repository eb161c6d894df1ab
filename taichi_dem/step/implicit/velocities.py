"""Velocities while a step is being solved, their change per impulse, dashpots of the ground."""

import taichi as ti

from taichi_dem.kit.allocation import raise_to
from taichi_dem.kit.lanes import (
    LANES,
    gathered,
    gathered_numbers,
    gathered_product,
    row_of,
    scaled,
)
from taichi_dem.kit.products import cross, matvec, squared, stacked, transposed_matvec
from taichi_dem.kit.types import real
from taichi_dem.physics.ground import braked_twist, twist_of
from taichi_dem.physics.rotation import unit3, world_tensor
from taichi_dem.physics.wrench import coupled_mobility, mobility, plus
from taichi_dem.state.tables import Tables
from taichi_dem.step.multirate.schedule import Schedule


@ti.data_oriented
class Velocities:
    """Present estimate of velocity and spin of every body at the end of the step."""

    scratch_fields = ("twist", "given")

    def __init__(self, tables: Tables):
        self.tables, self.spare = tables, tables.capacity.bodies
        n = self.spare + 1
        self.twist, self.turn = ti.Vector.field(6, real), ti.Matrix.field(3, 3, real)
        self.lightness = ti.field(real)
        self.change2 = ti.field(real, shape=())
        ti.root.dense(ti.i, n).place(self.twist, self.turn, self.lightness)
        self.has_supports = bool(tables.supports)
        if self.has_supports:
            self.hold = ti.Matrix.field(3, 3, real, shape=n)
            self.given = ti.Vector.field(6, real, shape=n)
        # A body that is held at a point turns where it is pushed.
        self.couples = any(getattr(effect, "turns", False) for effect in tables.supports)
        if self.couples:
            self.coupling = ti.Matrix.field(3, 3, real, shape=n)

    @ti.func
    def slack(self, i):
        """Velocity of body i per impulse [1/kg], a 3x3 matrix."""
        slack = self.tables.mass_inverse[i] * unit3()
        if ti.static(self.has_supports):
            slack = self.hold[i]
        return slack

    @ti.func
    def mobility(self, i, j, branch):
        """Twist of body j against i per wrench between them at j's centre, a ``Block``."""
        total = mobility(self.slack(i), self.turn[i], self.slack(j), self.turn[j], branch)
        if ti.static(self.couples):
            more = coupled_mobility(self.coupling[i], self.coupling[j], branch)
            total = plus(total, more)
        return total

    @ti.func
    def coupled(self, i, velocity, spin, force, moment):
        """Velocity and spin that body i gains of an impulse and a moment, with its coupling."""
        if ti.static(self.couples):
            velocity += matvec(self.coupling[i], moment)
            spin += transposed_matvec(self.coupling[i], force)
        return velocity, spin

    @ti.func
    def apart(self, i, j, branch):
        """Velocity of body j against i at j's centre, and spin of j against i."""
        first, second = self.twist[i], self.twist[j]
        spin = first[3:6]
        return second[0:3] - first[0:3] - cross(spin, branch), second[3:6] - spin

    @ti.func
    def pull(self, i, j, branch, force, moment):
        """Apply an impulse and a moment at j's centre to body i, and the opposite to j."""
        around = moment + cross(branch, force)
        turned, back = matvec(self.turn[i], around), matvec(self.turn[j], moment)
        first, second = self.lightness[i] * force, self.lightness[j] * force
        if ti.static(self.has_supports):
            first, second = matvec(self.hold[i], force), matvec(self.hold[j], force)
            self.given[i] = self.given[i] + stacked(force, around)
            self.given[j] = self.given[j] + stacked(-force, -moment)
        first, turned = self.coupled(i, first, turned, force, around)
        second, back = self.coupled(j, second, back, force, moment)
        self.twist[i] = self.twist[i] + stacked(first, turned)
        self.twist[j] = self.twist[j] - stacked(second, back)

    @ti.func
    def of_lanes(self, i):
        """Velocity and spin of the body of each lane."""
        return gathered(self.twist, i, 0), gathered(self.twist, i, 3)

    @ti.func
    def pushed_lanes(self, i, linear, angular, force, moment):
        """Velocity and spin of the body of each lane after an impulse and a moment."""
        if ti.static(self.has_supports):
            linear += gathered_product(self.hold, i, force, False)
        else:
            linear += scaled(gathered_numbers(self.lightness, i), force)
        angular += gathered_product(self.turn, i, moment, False)
        if ti.static(self.couples):
            linear += gathered_product(self.coupling, i, moment, False)
            angular += gathered_product(self.coupling, i, force, True)
        return linear, angular

    @ti.func
    def assign_lanes(self, i, linear, angular, force, moment):
        """Set velocity and spin of the body of each lane, and note what has pushed it."""
        for n in ti.static(range(LANES)):
            self.twist[i[n]] = row_of(linear, angular, n)
        if ti.static(self.has_supports):
            for n in ti.static(range(LANES)):
                self.given[i[n]] = self.given[i[n]] + row_of(force, moment, n)

    @ti.func
    def push(self, i, force, moment):
        """Apply an impulse and a moment at its centre to body i."""
        velocity, spin = matvec(self.slack(i), force), matvec(self.turn[i], moment)
        if ti.static(self.has_supports):
            self.given[i] = self.given[i] + stacked(force, moment)
        velocity, spin = self.coupled(i, velocity, spin, force, moment)
        self.twist[i] = self.twist[i] + stacked(velocity, spin)


@ti.data_oriented
class GroundSweeps:
    """Impulses of the ground, one row of impulse and moment for each effect of a body."""

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
        """Change the impulse by what is missing, as far as the body then gives way."""
        dt, resistance = self.schedule.step_seconds[0], self.tables.ground[e].resistance(i)
        twist, mass = self.velocities.twist[i], self.tables.mass[i]
        rotation = self.state.rotation(i)
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
