"""Time up to which each bond or pair has applied its impulse."""

from typing import Optional

import taichi as ti

from taichi_dem.contact.contacts import Contacts
from taichi_dem.state.state import State
from taichi_dem.state.tables import Tables
from taichi_dem.state.timeline import device_ticks_of


@ti.data_oriented
class AppliedUntil:
    """Tick up to which each bond and pair has applied its impulse, where bodies may be woken early.

    A bond applies its impulse for the coming step of the finer body at once. When that body is
    woken and takes a shorter step, the bond becomes active although its impulse reaches ahead of
    the clock: it applies no more until that tick. This is a time of the coarser step and so of any
    finer one: no impulse is ever applied in part.
    bond, pair: that tick for every bond, and for every slot of the pair store. step_seconds: step
    of each level [s].
    """

    def __init__(
        self, tables: Tables, state: State, step_seconds: ti.Field, contacts: Optional[Contacts]
    ):
        self.state, self.step_seconds = state, step_seconds
        self.bond = ti.field(ti.i64, shape=tables.capacity.bonds)
        if contacts is not None:
            self.pair = contacts.store.column("applied_until", ti.i64)

    @ti.func
    def is_pending(self, b, i, j):
        """Whether bond b has yet to apply its impulse for the coming step of its two bodies."""
        return self.bond[b] < self._until(i, j)

    @ti.func
    def apply_bond(self, b, i, j):
        """Seconds for which a pending bond applies its force now; records them as applied."""
        self.bond[b] = self._until(i, j)
        return self._step(i, j)

    @ti.func
    def apply_pair(self, p, i, j):
        """The same for a pair in contact; 0 where it has applied its impulse already."""
        dt, until = 0.0, self._until(i, j)
        if self.pair[p] < until:
            dt = self._step(i, j)
            self.pair[p] = until
        return dt

    @ti.func
    def _step(self, i, j):
        return self.step_seconds[ti.max(self.state.level[i], self.state.level[j])]

    @ti.func
    def _until(self, i, j):
        """Tick at which a pair of bodies is evaluated again."""
        finer = ti.max(self.state.level[i], self.state.level[j])
        return self.state.tick[None] + device_ticks_of(finer)
