"""Dashpots of bonds: one 6x6 block each, visited in the order of a fixed edge colouring."""

from typing import TYPE_CHECKING

import numpy as np
import taichi as ti

from taichi_dem.kit.allocation import assign
from taichi_dem.kit.types import real, vec3, vec6
from taichi_dem.methods import ImplicitDashpots
from taichi_dem.physics.wrench import inverse, mobility, plus, point_block, zero_block
from taichi_dem.step.implicit.velocities import Velocities
from taichi_dem.timeline import MACRO_TICKS

if TYPE_CHECKING:
    from taichi_dem.engine.model import Model
    from taichi_dem.engine.state import State
    from taichi_dem.engine.tables import Tables
    from taichi_dem.step.schedule import Schedule

#: Colours that links of at most four a body can need: a link meets six others at most.
BOND_COLOURS = 7


@ti.data_oriented
class BondDashpots:
    """Per-bond data used in sweeps, packed in the order of visits.

    A bond answers the twist in a step (slave against master, at the slave's centre) with the
    wrench impulse y = C (theta s1 + (1 - theta) s0), s0 and s1 at both ends of the step. The sum
    s1 + s0 (1 - theta) / theta carries over from step to step: it is the warm start, and y itself
    need not be stored.

    theta: where in the step dashpots take their velocity, and (1 - theta) / theta. refresh_every:
    steps between two renewals of the blocks. colour_first: first place of each colour. index: of a
    bond in the order. bodies: master and slave, -1 once released. branch: from the master's centre
    to the slave's [m].
    a, b, c: the block (C'^-1 + G)^-1, C' = theta C, G the mobility of the pair. start: s0. last:
    the s1 that the present y satisfies. Velocities in m/s, spins in rad/s, world.
    """

    constant_fields = ("theta", "refresh_every", "index", "colour_first")

    def __init__(
        self, tables: "Tables", state: "State", schedule: "Schedule", velocities: Velocities
    ):
        self.tables, self.state = tables, state
        self.schedule, self.velocities = schedule, velocities
        bonds = tables.capacity.bonds
        self.theta = ti.field(real, shape=2)
        self.refresh_every = ti.field(ti.i64, shape=())
        self.index = ti.field(ti.i32, shape=bonds)
        self.bodies = ti.Vector.field(2, ti.i32, shape=bonds)
        self.branch = ti.Vector.field(3, real, shape=bonds)
        self.a, self.b, self.c = (ti.Matrix.field(3, 3, real, shape=bonds) for _ in range(3))
        self.start = ti.Vector.field(6, real, shape=bonds)
        self.last = ti.Vector.field(6, real, shape=bonds)
        self.colour_first = ti.field(ti.i32, shape=BOND_COLOURS + 1)

    def load(self, model: "Model", method: ImplicitDashpots) -> None:
        """Colour the bonds of a model and take the numbers of a method."""
        assign(self.theta, np.array([method.theta, (1.0 - method.theta) / method.theta]))
        assign(self.refresh_every, max(1, round(method.refresh / method.dt)))
        colours = model.bond_colours
        place = np.empty(model.bond_count, dtype=np.int32)
        place[np.argsort(colours, kind="stable")] = np.arange(model.bond_count, dtype=np.int32)
        assign(self.index, place)
        assign(self.bodies, np.full((model.bond_count, 2), -1))
        counts = np.bincount(colours, minlength=BOND_COLOURS)
        assign(self.colour_first, np.cumsum([0, *counts]))

    @ti.func
    def mean(self, b, motion):
        """A bond's motion with the twist that its dashpots answered in the step before."""
        k = self.index[b]
        twist = self.theta[0] * (self.last[k] + self.theta[1] * self.start[k])
        motion.velocity = motion.axes @ twist[0:3]
        motion.spin = motion.axes @ twist[3:6]
        return motion

    @ti.func
    def begin(self, b, i, j, branch):
        """Load the present twist of an intact bond and, at intervals, its block."""
        k = self.index[b]
        self.bodies[k], self.branch[k] = [i, j], branch
        now = self._twist(i, j, branch)
        self.last[k] = self.last[k] + self.theta[1] * (self.start[k] - now)
        self.start[k] = now
        if (self.state.tick[None] // MACRO_TICKS) % self.refresh_every[None] == 0:
            self._refresh(b, k, i, j)

    @ti.func
    def first(self, b):
        """Set the first guess of a run: a constant twist in the first step."""
        slots, k = self.tables.bond_slots[b], self.index[b]
        i, j = slots[0] >> 2, slots[1] >> 2
        if self.state.broken_tick[b] < 0:
            branch = self.state.position[j] - self.state.position[i]
            self.start[k] = self._twist(i, j, branch)
            self.last[k] = self.start[k]

    @ti.func
    def _twist(self, i, j, branch):
        """Twist of a bond at the present time, slave against master."""
        spin = self.state.spin[i]
        linear = self.state.velocity[j] - self.state.velocity[i] - spin.cross(branch)
        angular = self.state.spin[j] - spin
        return vec6(linear[0], linear[1], linear[2], angular[0], angular[1], angular[2])

    @ti.func
    def end(self, b):
        """Remove a released bond from the sweeps."""
        self.bodies[self.index[b]] = [-1, -1]

    @ti.func
    def visit(self, k):
        """Solve the bond at place k against its bodies; square of the velocity it changed."""
        change2 = 0.0
        i, j = self.bodies[k][0], self.bodies[k][1]
        if i >= 0:
            branch, last = self.branch[k], self.last[k]
            linear, angular = self.velocities.apart(i, j, branch)
            linear -= last[0:3]
            angular -= last[3:6]
            change2 = linear.norm_sqr()
            force = self.a[k] @ linear + self.b[k] @ angular
            moment = self.b[k].transpose() @ linear + self.c[k] @ angular
            self.velocities.pull(i, j, branch, force, moment)
            linear, angular = self.velocities.apart(i, j, branch)
            for q in ti.static(range(3)):
                self.last[k][q], self.last[k][3 + q] = linear[q], angular[q]
        return change2

    @ti.func
    def _refresh(self, b, k, i, j):
        dt = self.schedule.step_seconds[0]
        axes = self.tables.bond_frame[b] @ self.state.rotation[i].transpose()
        along = self.tables.dashpot.traction(b, vec3(1.0, 1.0, 1.0))
        # A trace of the springs keeps the block invertible where a coefficient is zero.
        stiffness = self.tables.bond_stiffness[b]
        along += 1e-9 * dt * vec3(stiffness[0], stiffness[1], stiffness[1])
        scaled = axes
        for r in ti.static(range(3)):
            for c in ti.static(range(3)):
                scaled[r, c] = axes[r, c] * along[r]
        law = (self.theta[0] * dt * self.tables.unit_area[b]) * (axes.transpose() @ scaled)
        block = zero_block()
        for q in range(3):
            arm = self.state.rotation[j] @ self.tables.vertex_slave[3 * b + q]
            block = plus(block, point_block(arm, law))
        free = mobility(
            self.velocities.slack(i),
            self.velocities.turn[i],
            self.velocities.slack(j),
            self.velocities.turn[j],
            self.branch[k],
        )
        solved = inverse(plus(inverse(block), free))
        self.a[k], self.b[k], self.c[k] = solved.a, solved.b, solved.c
