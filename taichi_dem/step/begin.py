"""The start of a run: first levels and full lists, then the bonds of the first tick."""

from collections.abc import Callable
from typing import Any

import taichi as ti

from taichi_dem.kit.products import squared
from taichi_dem.step.advance import Advance
from taichi_dem.step.multirate.lists import Everyone, Once
from taichi_dem.step.multirate.schedule import Schedule

#: Pairs of a list and the function that is called with each member that is active.
Phases = tuple[tuple[Any, Callable[..., Any]], ...]


@ti.data_oriented
class Begin:
    """Phases before and after the bonds of the first tick, which the step's kernel evaluates."""

    def __init__(self, advance: Advance, schedule: Schedule):
        self.advance, self.schedule, self.state = advance, schedule, advance.state
        self.bodies = Everyone(advance.tables.body_count)
        self.bonds = Everyone(advance.tables.bond_count)

    def before(self) -> Phases:
        """Those before the bonds."""
        schedule = self.schedule
        asleep: Phases = ()
        limited: Phases = ()
        if schedule.has_limits:
            limited = ((self.bodies, schedule.limits.refresh),)
        if schedule.sleeps:
            asleep = (self.bodies, self.stir), (self.bodies, schedule.sleeping.begin_beside)
        return (
            (Once(), self.reset),
            *limited,
            *asleep,
            (self.bodies, self.choose_level),
            (Once(), self.fill_lists),
        )

    def after(self) -> Phases:
        """Those after them: bonds that sleep have acted once, and leave the list."""
        return ((Once(), self.fill_lists_again),) if self.schedule.sleeps else ()

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

    @ti.func
    def fill_lists(self, one):
        """Fill all lists; that of bonds with all of them."""
        self.schedule.start_all()

    @ti.func
    def fill_lists_again(self, one):
        """Fill the list of bonds with those that are awake."""
        self.schedule.list_members()


@ti.data_oriented
class SolvedBegin(Begin):
    """The same where all dashpots are solved together: with their first guesses."""

    def before(self) -> Phases:
        """Those before the bonds."""
        guessed: Phases = ()
        if self.advance.solver.has_bonds:
            guessed = ((self.bonds, self.advance.solver.bonds.first),)
        return (*super().before(), (self.bodies, self.update_inertia), *guessed)

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
