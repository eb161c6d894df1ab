"""Sweeps over the dashpots of all bonds and contacts until their impulses agree."""

import numpy as np
import taichi as ti

from taichi_dem.kit.allocation import assign
from taichi_dem.kit.types import real, vec6
from taichi_dem.methods import ImplicitDashpots
from taichi_dem.state.model import Model
from taichi_dem.step.implicit.bonds import BondDashpots
from taichi_dem.step.implicit.pairs import PairDashpots
from taichi_dem.step.implicit.velocities import GroundSweeps, Velocities
from taichi_dem.step.multirate.schedule import Schedule


@ti.data_oriented
class Solver:
    """Gauss-Seidel over bonds with dashpots, touching pairs, by their colours, then the ground."""

    def __init__(self, schedule: Schedule):
        self.schedule, tables = schedule, schedule.tables
        self.bounds = ti.field(ti.i32, shape=2)
        self.tolerance = ti.field(real, shape=())
        self.velocities = Velocities(tables)
        self.has_bonds, self.has_ground = bool(tables.dashpot.name), bool(tables.ground)
        self.has_contact = schedule.has_contact
        self.bonds = BondDashpots(schedule, self.velocities) if self.has_bonds else None
        self.ground = GroundSweeps(schedule, self.velocities) if self.has_ground else None
        self.pairs = PairDashpots(schedule, self.velocities) if self.has_contact else None
        self.sweeps, self.unsolved = (ti.field(ti.i32, shape=()) for _ in range(2))
        self.total_sweeps, self.unconverged = (ti.field(ti.i64, shape=()) for _ in range(2))
        self.first_change2, self.residual2 = (ti.field(real, shape=()) for _ in range(2))
        self.speed2, self.worst = (ti.field(real, shape=()) for _ in range(2))

    def upload(self, model: Model, method: ImplicitDashpots) -> None:
        """Upload the numbers of a method, and the bonds of a model."""
        assign(self.bounds, np.array(method.sweeps))
        assign(self.tolerance, method.tolerance)
        if self.bonds is not None:
            self.bonds.upload(model, method)

    @ti.func
    def begin(self, item):
        """Reset the residual and the count of sweeps; the spare body is at rest."""
        self.sweeps[None] = 0
        self.unsolved[None] = 1
        self.velocities.change2[None], self.speed2[None] = 0.0, 0.0
        self.velocities.twist[self.velocities.spare] = vec6(0.0)

    @ti.func
    def check_convergence(self, item):
        """End a sweep, and decide whether another one is required."""
        self.sweeps[None] = self.sweeps[None] + 1
        self.total_sweeps[None] = self.total_sweeps[None] + 1
        self.residual2[None] = self.velocities.change2[None]
        self.velocities.change2[None] = 0.0
        bound = self.tolerance[None] * self.tolerance[None] * self.speed2[None]
        settled = self.sweeps[None] >= self.bounds[0] and self.residual2[None] <= bound
        if self.sweeps[None] == 1:
            self.first_change2[None] = self.residual2[None]
        if settled or self.sweeps[None] >= self.bounds[1]:
            self.unsolved[None] = 0
            self._note_residual()
        self.schedule.count_sweep(self.has_bonds)

    @ti.func
    def _note_residual(self):
        """Count a step whose last sweep changed more than the tolerance allows."""
        # From rest there is no speed yet to compare with.
        scale2 = ti.max(self.speed2[None], self.first_change2[None])
        if self.residual2[None] > self.tolerance[None] * self.tolerance[None] * scale2:
            self.unconverged[None] = self.unconverged[None] + 1
            self.worst[None] = ti.max(self.worst[None], ti.sqrt(self.residual2[None] / scale2))
