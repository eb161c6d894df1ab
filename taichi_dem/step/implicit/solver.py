"""The step with all dashpots solved together: predict, sweep over bonds and contacts, move on."""

import taichi as ti

from taichi_dem.step.implicit.bonds import BondDashpots
from taichi_dem.step.implicit.motion import Motion
from taichi_dem.step.implicit.pairs import PairDashpots
from taichi_dem.types import real


@ti.data_oriented
class Solver:
    """Sweeps of Gauss-Seidel over blocks of bonds and of touching pairs."""

    def __init__(self, model, state, schedule, contacts, method):
        self.model, self.state, self.schedule, self.contacts = model, state, schedule, contacts
        self.method, self.theta = method, method.theta
        self.motion = Motion(model, state)
        self.bonds = BondDashpots(model, state, schedule, self.motion, method)
        self.pairs = None
        self.has_contact = contacts is not None
        if self.has_contact:
            self.pairs = PairDashpots(model, state, schedule, contacts, self.motion, method)
        self.sweeps = ti.field(ti.i32, shape=())
        self.residual = ti.field(real, shape=())

    @ti.func
    def solve(self, one):
        for s in range(self.method.sweeps):
            self.residual[None] = 0.0
            for k in range(self.model.bond_count):
                self.visit_bond(k)
            if ti.static(self.has_contact):
                for p in range(self.contacts.pair_count[None]):
                    self.pairs.visit(p)
            self.sweeps[None] += 1

    @ti.func
    def visit_bond(self, k):
        """Solve one bond against the present motion of its bodies."""
        bodies = self.bonds.bodies[k]
        i, j = bodies[0], bodies[1]
        if i >= 0:
            branch, last = self.bonds.branch[k], self.bonds.last[k]
            linear, angular = self.motion.apart(i, j, branch)
            linear -= last[0:3]
            angular -= last[3:6]
            force = self.bonds.a[k] @ linear + self.bonds.b[k] @ angular
            moment = self.bonds.b[k].transpose() @ linear + self.bonds.c[k] @ angular
            self.residual[None] = ti.max(self.residual[None], linear.norm_sqr())
            self.motion.pull(i, j, branch, force, moment)
            linear, angular = self.motion.apart(i, j, branch)
            for q in ti.static(range(3)):
                self.bonds.last[k][q] = linear[q]
                self.bonds.last[k][3 + q] = angular[q]
