"""Dashpots of bonds: one 6x6 block each, visited in the order of a fixed edge colouring."""

import numpy as np
import taichi as ti

from taichi_dem.kit import products
from taichi_dem.kit.allocation import assign, raise_to
from taichi_dem.kit.lanes import LANES, access, cross, dot, product, transposed_product
from taichi_dem.kit.products import matmul_transposed, matvec, stacked, transposed_matmul
from taichi_dem.kit.types import real, vec3, vec6
from taichi_dem.methods import ImplicitDashpots
from taichi_dem.physics.wrench import inverse, plus, point_block, zero_block
from taichi_dem.state.model import Model
from taichi_dem.state.timeline import MACRO_TICKS
from taichi_dem.step.implicit.velocities import Velocities
from taichi_dem.step.multirate.lists import Coloured
from taichi_dem.step.multirate.schedule import Schedule

#: Colours that links of at most four a body can need: a link meets six others at most.
BOND_COLOURS = 7


@ti.data_oriented
class BondDashpots:
    """Per-bond data used in sweeps, packed in the order of visits.

    A bond answers the twist in a step (slave against master, at the slave's centre) with the
    wrench impulse y = C (theta s1 + (1 - theta) s0), s0 and s1 at both ends of the step. The sum
    s1 + s0 (1 - theta) / theta carries over to the next step: the warm start; y is not stored.

    theta: where in the step dashpots take their velocity, and (1 - theta) / theta. refresh_every:
    steps between two renewals of the blocks. colour_first: first group of each colour. index: place
    of a bond in the order. masters, slaves: its bodies. branch: from the master's centre to the
    slave's [m].
    a, b, c: the block (C'^-1 + G)^-1, C' = theta C, G the mobility of the pair. start: s0. last:
    the s1 that the present y satisfies. Velocities in m/s, spins in rad/s, world.
    Bonds are visited by fours of one colour, one a lane (``kit.lanes``): place k is lane k % LANES
    of group k // LANES. Lanes without a bond that holds belong to the spare body.
    """

    constant_fields = ("theta", "refresh_every", "index", "colour_first")

    def __init__(self, schedule: Schedule, velocities: Velocities):
        self.tables, self.state = schedule.tables, schedule.state
        self.schedule, self.velocities = schedule, velocities
        bonds = self.tables.capacity.bonds
        self.put, self.put_number, self.entry = access()
        self.theta = ti.field(real, shape=2)
        self.refresh_every = ti.field(ti.i64, shape=())
        self.index = ti.field(ti.i32, shape=bonds)
        self.colour_first = ti.field(ti.i32, shape=BOND_COLOURS + 1)
        self.masters, self.slaves = (ti.Vector.field(LANES, ti.i32) for _ in range(2))
        self.branch = ti.Matrix.field(3, LANES, real)
        self.start, self.last = (ti.Matrix.field(6, LANES, real) for _ in range(2))
        self.a, self.b, self.c = (
            tuple(ti.Matrix.field(3, LANES, real) for _ in range(3)) for _ in range(3)
        )
        visited = self.masters, self.slaves, self.branch, self.last, *self.a, *self.b, *self.c
        self.groups = bonds // LANES + BOND_COLOURS
        groups = ti.root.dense(ti.i, self.groups)
        groups.place(*visited)
        groups.place(self.start)
        self.by_colour = Coloured(self.colour_first, BOND_COLOURS, self.groups)

    def upload(self, model: Model, method: ImplicitDashpots) -> None:
        """Colour the bonds of a model and take the numbers of a method."""
        assign(self.theta, np.array([method.theta, (1.0 - method.theta) / method.theta]))
        assign(self.refresh_every, max(1, round(method.refresh / method.dt)))
        colours = model.bond_colours
        counts = np.bincount(colours, minlength=BOND_COLOURS)
        first = np.cumsum([0, *-(-counts // LANES)])
        # Places of a colour begin with a group, whatever the colour before has left over.
        begin = LANES * first[:-1] - np.cumsum([0, *counts[:-1]])
        order = np.argsort(colours, kind="stable")
        place = np.empty(model.bond_count, dtype=np.int32)
        place[order] = np.arange(model.bond_count) + begin[colours[order]]
        assign(self.index, place)
        # Of silent dashpots, none is visited: what they change would decide about further sweeps.
        assign(self.colour_first, 0 * first if self.tables.dashpot.stands_silent else first)
        for bodies in (self.masters, self.slaves):
            assign(bodies, self.velocities.spare)

    @ti.func
    def mean(self, b, motion):
        """A bond's motion with the twist that its dashpots answered in the step before."""
        g, n = self._group_and_lane(b)
        twist = vec6(0.0)
        for k in ti.static(range(6)):
            before = self.theta[1] * self.entry(self.start, g, k, n)
            twist[k] = self.theta[0] * (self.entry(self.last, g, k, n) + before)
        motion.velocity = matvec(motion.axes, twist[0:3])
        motion.spin = matvec(motion.axes, twist[3:6])
        return motion

    @ti.func
    def begin(self, b, i, j, branch):
        """Load the present twist of an intact bond and, at intervals, its block."""
        g, n = self._group_and_lane(b)
        self.put_number(self.masters, g, n, i)
        self.put_number(self.slaves, g, n, j)
        now = self._twist(i, j, branch)
        for k in ti.static(range(3)):
            self.put(self.branch, g, k, n, branch[k])
        for k in ti.static(range(6)):
            change = self.theta[1] * (self.entry(self.start, g, k, n) - now[k])
            self.put(self.last, g, k, n, self.entry(self.last, g, k, n) + change)
            self.put(self.start, g, k, n, now[k])
        if (self.state.tick[None] // MACRO_TICKS) % self.refresh_every[None] == 0:
            self._refresh(b, g, n, i, j, branch)

    @ti.func
    def first(self, b):
        """Set the first guess of a run: a constant twist in the first step."""
        slots = self.tables.bond_slots[b]
        i, j = slots[0] >> 2, slots[1] >> 2
        if self.state.broken_tick[b] < 0:
            g, n = self._group_and_lane(b)
            now = self._twist(i, j, self.state.position[j] - self.state.position[i])
            for k in ti.static(range(6)):
                self.put(self.start, g, k, n, now[k])
                self.put(self.last, g, k, n, now[k])

    @ti.func
    def _group_and_lane(self, b):
        """Group and lane of a bond."""
        return self.index[b] // LANES, self.index[b] % LANES

    @ti.func
    def _twist(self, i, j, branch):
        """Twist of a bond at the present time, slave against master."""
        spin = self.state.spin[i]
        linear = self.state.velocity[j] - self.state.velocity[i] - products.cross(spin, branch)
        angular = self.state.spin[j] - spin
        return stacked(linear, angular)

    @ti.func
    def end(self, b):
        """Remove a released bond from the sweeps."""
        g, n = self._group_and_lane(b)
        self.put_number(self.masters, g, n, self.velocities.spare)
        self.put_number(self.slaves, g, n, self.velocities.spare)
        for k in ti.static(range(6)):
            self.put(self.last, g, k, n, 0.0)

    @ti.func
    def visit(self, g):
        """Solve the bonds of group g against their bodies."""
        i, j, branch = self.masters[g], self.slaves[g], self.branch[g]
        velocity_i, spin_i = self.velocities.of_lanes(i)
        velocity_j, spin_j = self.velocities.of_lanes(j)
        last = self.last[g]
        linear = velocity_j - velocity_i - cross(spin_i, branch) - last[0:3, :]
        angular = spin_j - spin_i - last[3:6, :]
        change2 = dot(linear, linear).max()
        force = product(self.a, g, linear) + product(self.b, g, angular)
        moment = transposed_product(self.b, g, linear) + product(self.c, g, angular)
        around = moment + cross(branch, force)
        velocity_i, spin_i = self.velocities.pushed_lanes(i, velocity_i, spin_i, force, around)
        velocity_j, spin_j = self.velocities.pushed_lanes(j, velocity_j, spin_j, -force, -moment)
        linear = velocity_j - velocity_i - cross(spin_i, branch)
        angular = spin_j - spin_i
        for k, n in ti.static(ti.ndrange(3, LANES)):
            last[k, n], last[3 + k, n] = linear[k, n], angular[k, n]
        # Before what goes to bodies: the compiler makes vectors from the first row that it finds.
        self.last[g] = last
        self.velocities.assign_lanes(i, velocity_i, spin_i, force, around)
        self.velocities.assign_lanes(j, velocity_j, spin_j, -force, -moment)
        raise_to(self.velocities.change2, change2)

    @ti.func
    def _refresh(self, b, g, n, i, j, branch):
        dt = self.schedule.step_seconds[0]
        axes = matmul_transposed(self.tables.bond_frame[b], self.state.rotation(i))
        m = self.tables.bond_pair[b]
        along = self.tables.dashpot.traction(m, b, vec3(1.0, 1.0, 1.0))
        # A trace of the springs keeps the block invertible where a coefficient is zero.
        stiffness = self.tables.bond_stiffness[b]
        along += 1e-9 * dt * vec3(stiffness[0], stiffness[1], stiffness[1])
        scaled = axes
        for r, c in ti.static(ti.ndrange(3, 3)):
            scaled[r, c] = axes[r, c] * along[r]
        law = (self.theta[0] * dt * self.tables.unit_area[b]) * transposed_matmul(axes, scaled)
        block, rotation = zero_block(), self.state.rotation(j)
        for q in range(3):
            arm = matvec(rotation, self.tables.vertex_slave[3 * b + q])
            block = plus(block, point_block(arm, law))
        solved = inverse(plus(inverse(block), self.velocities.mobility(i, j, branch)))
        for r, c in ti.static(ti.ndrange(3, 3)):
            self.put(self.a[r], g, c, n, solved.a[r, c])
            self.put(self.b[r], g, c, n, solved.b[r, c])
            self.put(self.c[r], g, c, n, solved.c[r, c])
