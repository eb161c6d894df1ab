"""Bodies that sleep through an event are brought to the present and take their new step at once."""

import taichi as ti


@ti.data_oriented
class WakeUp:
    """What happens at the start of a substep to the bodies that ``StabilityLimits`` has listed.

    A body waits for its own time with a step chosen before a contact came near, a bond broke or a
    neighbour went to shorter steps. Bonds that paid it their impulse ahead pay no more until then.
    """

    def __init__(self, advance, schedule):
        self.advance, self.schedule, self.rates = advance, schedule, schedule.rates
        self.state = schedule.state

    @ti.func
    def rouse(self, i):
        """Bring body i to the present tick when it wants a shorter step because of an event."""
        if self.rates.events[i] & self.rates.wakes != 0:
            wanted, bound = self.schedule.controlled_level(i)
            if ti.static(self.schedule.uniform):
                ti.atomic_max(self.schedule.wanted[None], wanted)
                self.state.bound[i] = bound
            elif wanted > self.state.level[i]:
                ti.atomic_add(self.rates.woken[None], 1)
                # The present belongs to the grid of level low and finer: such a level it takes.
                self.state.level[i] = ti.max(self.state.level[i], self.schedule.low[None])
                self.schedule.note_change(i)
                if self.state.last_tick[i] < self.state.tick[None]:
                    self.advance.body(i)
                else:
                    self.schedule.choose_level(i, 0.0)
