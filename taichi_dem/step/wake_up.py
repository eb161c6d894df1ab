"""Wake bodies between their scheduled updates when an event requires a shorter step."""

import taichi as ti

from taichi_dem.step.advance import Advance
from taichi_dem.step.schedule import Schedule
from taichi_dem.step.sleeping import ASLEEP


@ti.data_oriented
class WakeUp:
    """Updates the bodies that ``StabilityLimits`` has listed, at the start of a substep.

    A body waits for its own time with a step chosen before a contact came near, a bond broke or a
    neighbour refined its step. Bonds that have applied their impulse ahead apply no more until
    then.
    """

    def __init__(self, advance: Advance, schedule: Schedule):
        self.advance, self.schedule, self.limits = advance, schedule, schedule.limits
        self.state = schedule.state

    @ti.func
    def _is_awake(self, i):
        awake = True
        if ti.static(self.schedule.sleeps):
            awake = self.state.sleeping.awake[i] != ASLEEP
        return awake

    @ti.func
    def wake_up(self, i):
        """Bring body i to the present tick when it wants a shorter step because of an event."""
        if self.limits.events[i] & self.limits.wakes != 0 and self._is_awake(i):
            wanted, bound = self.schedule.controlled_level(i)
            if ti.static(self.schedule.uniform):
                ti.atomic_max(self.schedule.wanted[None], wanted)
                self.state.bound[i] = bound
            elif wanted > self.state.level[i]:
                ti.atomic_add(self.limits.woken[None], 1)
                # The present is a time of level low and finer levels only.
                self.state.level[i] = ti.max(self.state.level[i], self.schedule.low[None])
                self.schedule.note_change(i)
                if self.state.last_tick[i] < self.state.tick[None]:
                    self.advance.body(i)
                else:
                    self.schedule.choose_level(i, 0.0)
