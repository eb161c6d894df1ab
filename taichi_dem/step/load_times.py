"""Times from and up to which each load acts on a body: without a gap, so that no pulse is lost."""

import taichi as ti

from taichi_dem.state.state import State
from taichi_dem.state.tables import Tables


@ti.data_oriented
class LoadTimes:
    """Intervals of the loads, of which each begins where the last one of its body ended.

    A load that changes acts up to the middle of the step, where the leapfrog has the new velocity:
    of second order without dashpots. One that does not acts for the step itself, as springs do: it
    balances them also where steps change, and may be behind or ahead until it changes.
    """

    def __init__(self, tables: Tables, state: State):
        self.tables, self.state = tables, state

    @ti.func
    def start(self, i, half):
        """Begin half a step [s] before the present, as velocities do."""
        for e in ti.static(range(len(self.tables.loads))):
            self.state.lag[i][e] = half

    @ti.func
    def of_step(self, i, e: ti.template(), now, elapsed):
        """Motion of body i for load e in the step up to a time, and how long it acts [s]."""
        begin = now - elapsed
        since = begin - self.state.lag[i][e]
        until, length = since + elapsed, elapsed
        if ti.static(self.tables.loads[e].varies):
            middle = begin + 0.5 * elapsed
            if self.tables.loads[e].changes(since, ti.max(until, middle)):
                until, length = middle, middle - since
                self.state.lag[i][e] = 0.5 * elapsed
        return self.state.body_motion(i, begin, elapsed, since, until), length

    @ti.func
    def up_to(self, i, e: ti.template(), now, step):
        """The same from there to the present, half of the coming step [s]; nothing changes."""
        since, length = now - self.state.lag[i][e], 0.5 * step
        if ti.static(self.tables.loads[e].varies):
            if self.tables.loads[e].changes(since, now):
                length = self.state.lag[i][e]
        return self.state.body_motion(i, now, step, since, now), length
