"""What bodies that touch owe each other: how far levels differ, how far impulses reach."""

import taichi as ti

from taichi_dem.stability.body_limits import CLOSE
from taichi_dem.state.timeline import ticks_of
from taichi_dem.step.multirate.active_lists import ActiveLists
from taichi_dem.step.multirate.clock import Clock


@ti.data_oriented
class LevelLimit:
    """A body takes a level at most jump below the finest of the bodies that it touches."""

    def __init__(self, clock: Clock, lists: ActiveLists):
        self.tables, self.state, self.limits = clock.tables, clock.state, clock.limits
        self.store, self.beside = clock.store, lists.beside
        self.listed_level = ti.field(ti.i32, shape=self.tables.capacity.bodies)

    @ti.func
    def least(self, i):
        """Coarsest level that body i may have beside those it touches; negative for any."""
        return self.least_beside(self._visit(i, 0, False))

    @ti.func
    def least_beside(self, finest):
        """Coarsest level that a body may have beside one of a level."""
        return finest - self.limits.jump[None]

    @ti.func
    def spread(self, i):
        """Note the level of body i, and list those it touches that are too coarse."""
        self.note(i)
        self._visit(i, self.state.level[i], True)

    @ti.func
    def note(self, i):
        """Note the level of body i."""
        self.listed_level[i] = self.state.level[i]

    @ti.func
    def _visit(self, i, level, lists: ti.template()):
        """Finest listed level of the bodies that body i touches, -1 for none."""
        finest = -1
        for f in range(4):
            if self._bonded(4 * i + f):
                j = self.tables.neighbour[4 * i + f]
                finest = ti.max(finest, self._visit_one(j, level, lists))
        for first, slots, other in ti.static(self.beside):
            for k in range(first[i], first[i + 1]):
                if self.limits.contact_limits.count[slots[k]] > 0:
                    j = self.store.body[slots[k]][other]
                    finest = ti.max(finest, self._visit_one(j, level, lists))
        return finest

    @ti.func
    def _visit_one(self, j, level, lists: ti.template()):
        if ti.static(lists):
            if self.state.level[j] < self.least_beside(level):
                self.limits.notice(j, CLOSE)
        return self.listed_level[j]

    @ti.func
    def _bonded(self, face):
        bonded = False
        if self.tables.neighbour[face] >= 0:
            bonded = self.state.broken_tick[self.tables.face_bond[face]] < 0
        return bonded


@ti.data_oriented
class AppliedUntil:
    """Tick up to which each bond and pair slot has applied its impulse, where bodies may be woken.

    A bond applies its impulse for the coming step of the finer body at once. If that body is woken
    and takes shorter steps, the bond applies no more until that tick, a time of any finer step.
    """

    def __init__(self, clock: Clock):
        self.state = clock.state
        self.bond = ti.field(ti.i64, shape=clock.tables.capacity.bonds)
        if clock.has_contact:
            self.pair = clock.store.column("applied_until", ti.i64)

    @ti.func
    def until(self, i, j):
        """Tick at which a pair of bodies is evaluated again."""
        finer = ti.max(self.state.level[i], self.state.level[j])
        return self.state.tick[None] + ticks_of(finer)
