"""Wake bodies from sleep: when that is decided, and how they come on the lists."""

import taichi as ti

from taichi_dem.kit.types import vec2
from taichi_dem.step.advance import Advance
from taichi_dem.step.multirate.lists import Places
from taichi_dem.step.multirate.schedule import Schedule


@ti.data_oriented
class Chunks(Places):
    """List of the chunks of bodies, at the ticks at which their momenta are summed."""

    def __init__(self, schedule: Schedule):
        self.sleeping, self.schedule = schedule.sleeping, schedule

    @ti.func
    def count(self, low):
        """Number of chunks now."""
        count = 0
        if self.sleeping.is_due():
            count = self.sleeping.chunk_count[None]
        return count

    @ti.func
    def end(self, one):
        """Set the bound, and bring bodies woken of late into the order of the others.

        Visits in the order of waking take up to 40 % longer.
        """
        if self.sleeping.is_due():
            self.sleeping.renew_bound()
            if self.sleeping.unsorted[None] > 0:
                self.sleeping.unsorted[None] = 0
                self.schedule.list_members(0)


@ti.data_oriented
class WokenLists:
    """Puts woken bodies and their bonds on the lists of a schedule; books what they left out."""

    def __init__(self, schedule: Schedule, advance: Advance):
        self.sleeping, self.schedule, self.advance = schedule.sleeping, schedule, advance
        self.tables, self.state = schedule.tables, schedule.state

    @ti.func
    def admit(self, moved: ti.template()):
        """List the bodies woken since the last call, and the bonds that now act.

        moved: whether bodies have moved since bonds were evaluated.
        """
        for a in range(self.sleeping.woken_count[None]):
            i = self.sleeping.woken[a]
            self.schedule.bodies.insert(i, self.schedule.body_key(i))
            for f in range(4):
                b = self.tables.face_bond[4 * i + f]
                if b >= 0:
                    key = self.schedule.bond_key(b)
                    if key >= 0 and self.schedule.bonds.key[b] < 0:
                        self.schedule.bonds.insert(b, key)
                        self.sleeping.left_out[b] = self.left_out(b, moved)
        self.sleeping.unsorted[None] = (
            self.sleeping.unsorted[None] + self.sleeping.woken_count[None]
        )
        self.sleeping.woken_count[None] = 0

    @ti.func
    def left_out(self, b, moved: ti.template()):
        """Bound of the impulse [N s] and the energy [J] that a bond has left out so far.

        One body moved while the other slept, since it woke. moved: whether it has gone on since the
        bond would last have been evaluated, as it does in the step in which it wakes others.
        """
        slots = self.tables.bond_slots[b]
        i, j = slots[0] >> 2, slots[1] >> 2
        if self.sleeping.since[i] < 0 or (
            self.sleeping.since[j] >= 0 and self.sleeping.since[j] < self.sleeping.since[i]
        ):
            i = j
        first, last, found = self.sleeping.since[i], 0.0, vec2(0.0, 0.0)
        if ti.static(moved):
            last = self.sleeping.stride[i]
        if 0 <= first and first < self.state.tick[None]:
            elapsed = self.schedule.seconds(self.state.tick[None] - first)
            rounding = self.sleeping.rounding(i)
            found = self.sleeping.withheld(b, elapsed, last, rounding, self.advance)
        return found
