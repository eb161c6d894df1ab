"""A step of bodies, bonds and contacts by their present forces, each for its own time.

A bond or pair evaluated at a tick applies the impulse F * (smaller of their steps) to both bodies,
with opposite signs; a body takes the sum at its own time (Konno et al., 3.1, eq. 3): v += S / m,
L += T, then x += dt v and q = exp(dt w) q, with the spin w in the middle of the turn.
"""

from typing import Any

import taichi as ti

from taichi_dem.contact.search import BroadPhase
from taichi_dem.kit.ordered import Once
from taichi_dem.kit.products import squared
from taichi_dem.stability.body_limits import HIT
from taichi_dem.step.contact_force import ContactForces
from taichi_dem.step.multirate.schedule import Schedule
from taichi_dem.step.phases import (
    ABSENT,
    ALWAYS,
    START,
    STARTED,
    STEP,
    Step,
    given,
)
from taichi_dem.step.sleeping import ASLEEP


@ti.data_oriented
class ExplicitStep(Step):
    """The leapfrog, for one step or steps that differ by body."""

    def __init__(self, schedule: Schedule, search: BroadPhase | None):
        super().__init__(schedule, search)
        self.pairs: Any = ContactForces(schedule) if self.has_contact else None

    def phases(self) -> tuple:
        """The phases in order."""
        schedule, lists = self.schedule, self.schedule.lists
        once, everyone, controlled = Once(), lists.bodies.everyone, schedule.controlled
        limits, limit = schedule.limits or ABSENT, schedule.level_limit or ABSENT
        sleep, waking = schedule.sleeping or ABSENT, schedule.waking or ABSENT
        return (
            # Stable steps of all bodies, who sleeps, first levels; then all lists.
            (START, everyone, limits.refresh),
            (START, everyone, sleep.begin),
            (START, everyone, sleep.begin_beside),
            (START, everyone, self.first_level),
            (START, once, given(schedule.uniform, schedule.level_all)),
            (START, once, waking.begin),
            (START, everyone, limit.note),
            (START, lists.filling()),
            (START, once, schedule.end_listing),
            # Bodies whose bonds or contacts changed find their stable steps anew, and a controlled
            # one that needs a shorter step now is brought to the present and takes it.
            (STEP, limits, given(not controlled, limits.refresh_last)),
            (STEP, limits, given(controlled, limits.refresh)),
            (STEP, limits, given(controlled, self.wake_up)),
            (STEP, schedule.applying()),
            # Contacts that are due give their impulse for the smaller of the bodies' two steps.
            (STEP, lists.pairs, given(self.has_contact, self.contact)),
            # The clock moves to the next tick at which a body is due.
            (STEP, once, schedule.advance_clock),
            # The speed from which on a body wakes those that sleep beside it.
            (STEP, sleep, sleep.chunk),
            (STEP, once, waking.sort),
            # Bodies that are due take their impulses, move, and choose their next level.
            (STEP, lists.bodies, self.body),
            # Members of another level, and bonds that broke, move in the lists.
            (STEP, schedule.reordering()),
            # Bonds that are due give their impulse, and break where a unit fails.
            (ALWAYS, lists.bonds, self.bond),
            # At the start bonds that sleep have acted once.
            (STARTED, waking.leaving),
        )

    @ti.func
    def body(self, i):
        """Bring a body to the present tick and choose its next step."""
        elapsed = self.schedule.elapsed(i)
        linear, angular = self.motion.gathered(i)
        velocity, momentum = self.kicked(i, elapsed, linear, angular)
        spin = self.loads.spin(i, momentum)
        self.motion.drift(i, elapsed, velocity, momentum, spin)
        self.state.velocity[i], self.state.angular_momentum[i] = velocity, momentum
        self.state.spin[i] = spin
        self.schedule.choose_level(i, squared(velocity))

    @ti.func
    def kicked(self, i, elapsed, linear, angular):
        """Velocity and angular momentum after all impulses, as the supports allow; books work."""
        loads = self.loads
        linear, angular, kick = loads.loaded(i, elapsed, linear, angular, loads.load_of_step)
        if ti.static(loads.has_ground):
            rows = loads.ground_impulses(i, elapsed, linear, angular)
            linear, angular, kick = loads.with_ground(rows, linear, angular, kick)
        velocity = self.state.velocity[i] + linear * self.tables.mass_inverse[i]
        momentum = self.state.angular_momentum[i] + angular
        return loads.supported(i, elapsed, kick, velocity, momentum)

    @ti.func
    def wake_up(self, i):
        """Bring body i to the present tick when it wants a shorter step because of an event."""
        limits = self.schedule.limits
        noticed = limits.events[i] != 0
        limits.events[i] = 0
        if ti.static(self.schedule.sleeps):
            noticed = noticed and self.schedule.sleeping.awake[i] != ASLEEP
        if noticed:
            wanted, bound = self.schedule.controlled_level(i)
            if ti.static(self.schedule.uniform):
                ti.atomic_max(self.schedule.wanted[None], wanted)
                self.state.bound[i] = bound
            elif wanted > self.state.level[i]:
                ti.atomic_add(limits.woken[None], 1)
                # The present is a time of level low and finer levels only.
                self.state.level[i] = ti.max(self.state.level[i], self.schedule.low[None])
                self.schedule.lists.note_change(i)
                if self.state.last_tick[i] < self.state.tick[None]:
                    self.body(i)
                else:
                    self.schedule.choose_level(i, 0.0)

    @ti.func
    def bond(self, b):
        """Evaluate the three contact units of a bond; release it when one of them fails."""
        if self.bonds.is_pending(b):
            slots, motion = self.tables.bond_slots[b], self.state.bond_motion(b)
            i, j = slots[0] >> 2, slots[1] >> 2
            dt = self.schedule.pair_step(i, j)
            answer = self.bonds.answer(b, dt, motion, motion)
            if ti.static(self.schedule.controlled):
                self.schedule.applied_until.bond[b] = self.schedule.applied_until.until(i, j)
            if answer.failed == 0:
                self.bonds.pull(b, dt, motion, answer)
            else:
                self.bonds.release(b, motion, answer)

    @ti.func
    def contact(self, p):
        """Evaluate the contacts of a pair of bodies: repulsion and friction."""
        pair = self.pairs.store.body[p]
        i, j = pair[0], pair[1]
        elapsed, margin = 0.0, 0.0
        if ti.static(self.pairs.springs.present):
            elapsed = self.pairs.springs.elapsed(p)
        if ti.static(self.schedule.has_limits):
            margin = self.schedule.limits.contact_limits.margin(i, j)
        forces = self.pairs.forces_of(p, elapsed, margin, True)
        if forces.deepest > 0.0:
            self.pairs.push(p, self.pairs.pair_step(p, i, j), forces)
        self.pairs.book(p, forces)
        if ti.static(self.schedule.has_limits):
            self.schedule.limits.notice_pair(p, forces.near_count, HIT)

    @ti.func
    def bond_power(self, b, motion):
        """Power that the dashpots of an intact bond take at a motion [W]."""
        return self.bonds.power(b, motion)

    @ti.func
    def forces_now(self, p):
        """Forces of a pair's contacts at the present time, a ``PairForces``; nothing changes."""
        return self.pairs.forces_of(p, 0.0, 0.0, False)
