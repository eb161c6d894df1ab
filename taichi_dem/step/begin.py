"""The start of a run: first levels and full lists, then the bonds of the first tick."""

from collections.abc import Callable
from typing import Any

import taichi as ti

from taichi_dem.kit.products import squared
from taichi_dem.step.advance import Advance
from taichi_dem.step.multirate.lists import Everyone, Once

#: Pairs of a list and the function that is called with each member that is active.
Phases = tuple[tuple[Any, Callable[..., Any]], ...]


@ti.data_oriented
class Begin:
    """Phases before and after the bonds of the first tick, which the step's kernel evaluates."""

    def __init__(self, advance: Advance):
        self.advance, self.schedule, self.state = advance, advance.schedule, advance.state
        self.bodies = Everyone(advance.tables.body_count)
        self.bonds = Everyone(advance.tables.bond_count)

    def before(self) -> Phases:
        """Those before the bonds."""
        schedule = self.schedule
        phases: Phases = ((Once(), self.reset),)
        if schedule.has_limits:
            phases += ((self.bodies, schedule.limits.refresh),)
        if schedule.sleeps:
            phases += (self.bodies, self.stir), (self.bodies, schedule.sleeping.begin_beside)
        return (*phases, (self.bodies, self.choose_level), (Once(), schedule.start_all))

    def after(self) -> Phases:
        """Those after them: bonds that sleep have acted once, and leave the list."""
        return ((Once(), self.schedule.list_members),) if self.schedule.sleeps else ()

    @ti.func
    def reset(self, one):
        """All levels are active, and none is wanted yet."""
        self.schedule.low[None] = 0
        self.schedule.wanted[None] = 0

    @ti.func
    def stir(self, i):
        """Wake body i where something acts on it."""
        self.schedule.sleeping.begin(i, self.advance)

    @ti.func
    def choose_level(self, i):
        """Choose the first level of body i."""
        self.schedule.choose_level(i, squared(self.state.velocity[i]))


@ti.data_oriented
class SolvedBegin(Begin):
    """The same where all dashpots are solved together: with their first guesses."""

    def before(self) -> Phases:
        """Those before the bonds."""
        phases: Phases = (*super().before(), (self.bodies, self.update_inertia))
        if self.advance.solver.has_bonds:
            phases += ((self.bonds, self.advance.solver.bonds.first),)
        return phases

    def after(self) -> Phases:
        """Those after them."""
        return (*super().after(), (self.bonds, self.undo))

    @ti.func
    def update_inertia(self, i):
        """Find the inertia of body i in the world frame."""
        self.advance.solver.velocities.update_inertia(i, self.advance)

    @ti.func
    def undo(self, b):
        """Book no heat of bond b, whose evaluation booked a step before the start."""
        if ti.static(self.advance.tables.has_bond_heat):
            self.state.bond_heat[b] = 0.0 * self.state.bond_heat[b]
        if ti.static(self.schedule.sleeps and self.advance.solver.has_bonds):
            if self.schedule.bonds.key[b] < 0:
                self.advance.solver.bonds.end(b)
