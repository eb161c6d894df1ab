"""The start of a run: first levels, full lists, bonds of the first tick."""

from collections.abc import Callable
from typing import Any

import taichi as ti

from taichi_dem.kit.products import squared
from taichi_dem.step.active_list import Everyone, Once
from taichi_dem.step.advance import Advance
from taichi_dem.step.schedule import Schedule

#: Pairs of a list and the function that is called with each member that is active.
Phases = tuple[tuple[Any, Callable[..., Any]], ...]


@ti.data_oriented
class Begin:
    """Phases of the start of a run, pairs as those of a ``Step``; advance.bond is in both."""

    def __init__(self, advance: Advance, schedule: Schedule):
        self.advance, self.schedule, self.state = advance, schedule, advance.state
        self.bodies = Everyone(advance.tables.body_count)
        self.bonds = Everyone(advance.tables.bond_count)

    def phases(self) -> Phases:
        """All of them, in their order."""
        schedule = self.schedule
        asleep: Phases = ()
        limited: Phases = ()
        if schedule.has_limits:
            limited = ((self.bodies, schedule.limits.refresh),)
        if schedule.sleeps:
            asleep = (self.bodies, self.stir), (self.bodies, self.schedule.sleeping.begin_beside)
        return (
            (Once(), self.reset),
            *limited,
            *asleep,
            (self.bodies, self.choose_level),
            (Once(), self.fill_lists),
            # Those that sleep act once, and are listed later.
            (self.bonds if schedule.sleeps else schedule.bonds, self.advance.bond),
        )

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
        """Fill all lists."""
        self.schedule.start_all()


@ti.data_oriented
class SolvedBegin(Begin):
    """The same where all dashpots are solved together: with their first guesses."""

    def phases(self) -> Phases:
        """All of them, in their order."""
        *before, bonds = super().phases()
        guessed: Phases = ()
        if self.advance.solver.has_bonds:
            guessed = ((self.bonds, self.advance.solver.bonds.first),)
        inertia = self.bodies, self.update_inertia
        return (*before, inertia, *guessed, bonds, (self.bonds, self.undo))

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


@ti.data_oriented
class Members:
    """Members of a phase at the start and in a substep; None where it has none.

    begin in its functions: 1 at the start, 0 in a substep.
    """

    def __init__(self, first: Any, active: Any):
        self.first, self.active = first, active
        self.at_start, self.in_substeps = first is not None, active is not None
        self.alike = first is active

    @ti.func
    def count(self, begin, low):
        """Number of members."""
        count = 0
        if ti.static(self.alike):
            count = self.first.count(low)
        else:
            if ti.static(self.at_start):
                count += begin * self.first.count(low)
            if ti.static(self.in_substeps):
                count += (1 - begin) * self.active.count(low)
        return count

    @ti.func
    def pick(self, begin, a):
        """Member at place a."""
        member = 0
        if ti.static(self.alike or not self.in_substeps):
            member = self.first.pick(a)
        elif ti.static(not self.at_start):
            member = self.active.pick(a)
        else:
            member = begin * self.first.pick(a) + (1 - begin) * self.active.pick(a)
        return member


def joined(first: Phases, phases: Phases, common: Callable[..., Any]) -> Phases:
    """Phases of the start and of a substep in a row, for one kernel; a function of both is once.

    So the bonds, which take longest to compile, are compiled once. common: that function; what is
    before and after it keeps its order.
    """
    (place,) = (k for k, (_, item) in enumerate(first) if item == common)
    alone = [(Members(members, None), item) for members, item in first]
    steps = (
        (Members(first[place][0] if item == common else None, active), item)
        for active, item in phases
    )
    return (*alone[:place], *steps, *alone[place + 1 :])
