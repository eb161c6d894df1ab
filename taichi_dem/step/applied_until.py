"""What bonds and pairs have given ahead, where bodies may be woken between their own times."""

import taichi as ti

from taichi_dem.timeline import device_ticks_of


@ti.data_oriented
class AppliedUntil:
    """Until when each bond and pair has given its impulse.

    A bond gives it for the coming step of the finer body at once. When that body is woken and
    takes a shorter step, the bond is due again while it has still paid: it gives no more until
    the tick that it paid up to. That is a time of the coarser step, so of any finer
    one: nothing is ever paid in part.
    bond: that tick for every bond; those of the pairs are in ``ContactLimits``, which keeps them
    through a search. schedule: knows their steps.
    """

    def __init__(self, model, state, schedule, rates):
        self.state, self.schedule, self.near = state, schedule, rates.near
        self.bond = ti.field(ti.i64, shape=max(1, model.bond_count))

    @ti.func
    def owes(self, b, i, j):
        """Whether bond b of two bodies has something left to give for their coming step."""
        return self.bond[b] < self._until(i, j)

    @ti.func
    def take_bond(self, b, i, j):
        """Seconds that bond b, which owes, is to give for now; they count as given."""
        self.bond[b] = self._until(i, j)
        return self.schedule.pair_step(i, j)

    @ti.func
    def take_pair(self, p, i, j):
        """The same for a pair in contact; 0 where it has given them."""
        dt, until = 0.0, self._until(i, j)
        if self.near.paid[p] < until:
            dt = self.schedule.pair_step(i, j)
            self.near.paid[p] = until
        return dt

    @ti.func
    def _until(self, i, j):
        """Tick at which two bodies are looked at again."""
        finer = ti.max(self.state.level[i], self.state.level[j])
        return self.state.tick[None] + device_ticks_of(finer)
