"""Bodies that no wave has reached sleep: neither they nor their bonds are evaluated.

A body wakes its neighbours once its momentum exceeds a share of the mean momentum of all bodies. A
bond acts from the time at which both of its bodies are awake, with its whole opening: momentum is
exact, as the impulses that it left out before are equal and opposite. These are small, as neither
body had more than that share; they are bounded and booked when the bond wakes.
"""

from typing import TYPE_CHECKING

import numpy as np
import taichi as ti

from taichi_dem.kit.allocation import assign
from taichi_dem.kit.types import real, vec2
from taichi_dem.timeline import MACRO_TICKS, NEVER

if TYPE_CHECKING:
    from taichi_dem.engine.model import Model
    from taichi_dem.engine.tables import Tables
    from taichi_dem.step.advance import Advance
    from taichi_dem.step.schedule import Schedule

ASLEEP, AWAKE, STIRRED = range(3)
#: Bodies whose momenta are summed one after the other.
_CHUNK = 256
#: Largest steps between two sums of the momenta, once the run is as many steps old as the next one.
_EVERY, _EARLY = 16, 64
#: Roundings of a coordinate that the opening of a bond at rest may show.
_ROUNDINGS = 16.0


@ti.data_oriented
class Sleeping:
    """State of sleep of the bodies.

    awake: ASLEEP, AWAKE, or STIRRED once the body has woken its neighbours. since: tick at which it
    woke, NEVER while asleep. stride: step [s] in which it woke others. woken: bodies that wait to
    be listed, woken_count of them. unsorted: bodies listed out of order since. share: of the mean
    momentum, at which a body wakes its neighbours; 0 where none sleeps. bound2: square of that
    momentum now [(N s)^2]. mean: of the momenta of all bodies [N s]. rounding: opening that a bond
    at rest may show [m]. sums: of the momenta, a chunk of bodies each [N s]. left_out: bound of the
    impulse [N s] and the energy [J] that each bond left out before it woke.
    """

    def __init__(self, tables: "Tables"):
        n = tables.capacity.bodies
        self.tables, self.acting = tables, (*tables.loads, *tables.supports)
        self.awake = ti.field(ti.i32, shape=n)
        self.since = ti.field(ti.i64, shape=n)
        self.stride = ti.field(real, shape=n)
        self.woken = ti.field(ti.i32, shape=n)
        self.woken_count = ti.field(ti.i32, shape=())
        self.unsorted = ti.field(ti.i32, shape=())
        self.share = ti.field(real, shape=())
        self.bound2, self.mean = ti.field(real, shape=()), ti.field(real, shape=())
        self.rounding = ti.field(real, shape=())
        self.sums = ti.field(real, shape=n // _CHUNK + 1)
        self.left_out = ti.Vector.field(2, real, shape=tables.capacity.bonds)

    def load(self, model: "Model", share: float) -> None:
        """Begin with all bodies asleep; all fields are zero before."""
        assign(self.since, np.full(model.body_count, NEVER))
        assign(self.share, share)
        # A few roundings of the coordinates of its corners.
        assign(self.rounding, _ROUNDINGS * np.finfo(float).eps * np.abs(model.mesh.points).max())

    @ti.func
    def begin(self, i, advance):
        """Wake body i at the start where something acts on it or it moves, or none may sleep.

        Bodies may also be at rest with strained bonds, and these act at once.
        """
        state, stirred = advance.state, self.share[None] <= 0.0
        for f in range(4):
            b = self.tables.face_bond[4 * i + f]
            if b >= 0:
                if advance.is_strained(b, self.rounding[None]):
                    stirred = True
        for effect in ti.static(self.acting):
            if effect.acts_on(i) != 0:
                stirred = True
        moving = state.velocity[i].norm_sqr() + state.spin[i].norm_sqr()
        if stirred or moving > 0.0:
            self.awake[i] = STIRRED
            self.since[i] = 0

    @ti.func
    def begin_beside(self, i):
        """Wake the neighbours of a body that is stirred at the start."""
        if self.awake[i] == STIRRED:
            for f in range(4):
                j = self.tables.neighbour[4 * i + f]
                # Not in one condition: "and" evaluates both sides.
                if j >= 0:
                    if ti.atomic_max(self.awake[j], AWAKE) == ASLEEP:
                        self.since[j] = 0

    @ti.func
    def both_awake(self, i, j):
        """Whether the bond of two bodies is evaluated."""
        return self.awake[i] != ASLEEP and self.awake[j] != ASLEEP

    @ti.func
    def stir(self, i, state, elapsed, velocity, angular_momentum):
        """Wake the neighbours of a body once its momentum exceeds the bound; elapsed: step [s]."""
        if self.awake[i] == AWAKE:
            spin = angular_momentum.norm() / self.tables.radius[i]
            momentum2 = (self.tables.mass[i] ** 2) * velocity.norm_sqr() + spin * spin
            if momentum2 > self.bound2[None]:
                self.awake[i], self.stride[i] = STIRRED, elapsed
                for f in range(4):
                    b = self.tables.face_bond[4 * i + f]
                    if b >= 0:
                        if state.broken_tick[b] < 0:
                            self.awaken(self.tables.neighbour[4 * i + f], state)

    @ti.func
    def awaken(self, j, state):
        """Wake body j now, if it sleeps; it is listed at the end of this substep."""
        if ti.atomic_max(self.awake[j], AWAKE) == ASLEEP:
            self.since[j] = state.tick[None]
            state.last_tick[j] = state.tick[None]
            self.woken[ti.atomic_add(self.woken_count[None], 1)] = j

    @ti.func
    def is_due(self, tick):
        """Whether the mean momentum is found anew at a tick."""
        step = tick // MACRO_TICKS
        due = tick % MACRO_TICKS == 0 and (step < _EARLY or step % _EVERY == 0)
        return due and self.share[None] > 0.0

    @ti.func
    def chunk(self, c, state):
        """Sum the momenta of a chunk of bodies [N s]."""
        total, first = 0.0, c * _CHUNK
        for i in range(first, ti.min(first + _CHUNK, self.tables.body_count[None])):
            if self.awake[i] != ASLEEP:
                total += self.tables.mass[i] * state.velocity[i].norm()
        self.sums[c] = total

    @ti.func
    def chunks(self):
        """Number of chunks."""
        return (self.tables.body_count[None] + (_CHUNK - 1)) // _CHUNK

    @ti.func
    def renew_bound(self):
        """Set the bound from the sums of the chunks."""
        total = 0.0
        for c in range(self.chunks()):
            total += self.sums[c]
        self.mean[None] = total / self.tables.body_count[None]
        bound = self.share[None] * self.mean[None]
        self.bound2[None] = bound * bound


@ti.data_oriented
class Chunks:
    """List of the chunks of bodies, at the ticks at which their momenta are summed."""

    def __init__(self, sleeping: Sleeping, schedule: "Schedule"):
        self.sleeping, self.state, self.schedule = sleeping, schedule.state, schedule

    @ti.func
    def count(self, low):
        """Number of chunks now."""
        count = 0
        if self.sleeping.is_due(self.state.tick[None]):
            count = self.sleeping.chunks()
        return count

    @ti.func
    def pick(self, a):
        """One of them."""
        return a

    @ti.func
    def add(self, c):
        """Sum the momenta of one."""
        self.sleeping.chunk(c, self.state)

    @ti.func
    def end(self, one):
        """Set the bound, and bring bodies woken of late into the order of the others.

        Visits in the order of waking take up to 40 % longer.
        """
        if self.sleeping.is_due(self.state.tick[None]):
            self.sleeping.renew_bound()
            if self.sleeping.unsorted[None] > 0:
                self.sleeping.unsorted[None] = 0
                self.schedule.list_members()


@ti.data_oriented
class WokenLists:
    """Puts woken bodies and their bonds on the lists of a schedule; books what they left out."""

    def __init__(self, sleeping: Sleeping, schedule: "Schedule", advance: "Advance"):
        self.sleeping, self.schedule, self.advance = sleeping, schedule, advance
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
            found = self.advance.withheld(b, elapsed, last)
        return found
