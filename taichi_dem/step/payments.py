"""What bonds and pairs have given ahead, where bodies may be woken between their own times."""

import taichi as ti

from taichi_dem.timeline import device_ticks_of


@ti.data_oriented
class Payments:
    """Until when each bond and pair has given its impulse.

    A bond gives it for the coming step of the finer body at once. When that body is woken and
    takes a shorter step, the bond is due again while it has still paid: it gives no more until
    the tick that it paid up to.
    bond: that tick for every bond; those of the pairs are in ``Near``, which keeps them through a
    search. schedule: gives seconds to ticks.
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
        """Seconds that bond b is to give for now; they count as given."""
        paid = self.bond[b]
        self.bond[b] = self._until(i, j)
        return self._seconds(paid, i, j)

    @ti.func
    def take_pair(self, p, i, j):
        """The same for a pair in contact, which may also have paid for longer than it has now."""
        paid = self.near.paid[p]
        self.near.paid[p] = ti.max(paid, self._until(i, j))
        return self._seconds(paid, i, j)

    @ti.func
    def _until(self, i, j):
        """Tick at which two bodies are looked at again."""
        finer = ti.max(self.state.level[i], self.state.level[j])
        return self.state.tick[None] + device_ticks_of(finer)

    @ti.func
    def _seconds(self, paid, i, j):
        start = ti.max(paid, self.state.tick[None])
        return self.schedule.seconds(ti.max(0, self._until(i, j) - start))
