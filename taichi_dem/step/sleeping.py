"""Sleep: bodies that no wave has reached, and their bonds, are not evaluated.

A body wakes its neighbours once what a sleeping bond leaves out is more than a share of what counts
there: of the opening at which a law of that bond begins, or of the mean speed of the connected part
that the body belongs to. A bond acts, with its whole opening, once both of its bodies are awake:
the impulses that it left out are equal and opposite, and bounded and booked when it wakes.
"""

import numpy as np
import taichi as ti

from taichi_dem.kit.allocation import assign
from taichi_dem.kit.ordered import Places
from taichi_dem.kit.products import dot, norm, squared
from taichi_dem.kit.types import real, vec2, vec3
from taichi_dem.mesh.topology import parts_of
from taichi_dem.physics.bond import unit_arm, unit_opening, unit_velocity
from taichi_dem.state.model import Model
from taichi_dem.state.state import State
from taichi_dem.state.tables import Tables
from taichi_dem.state.timeline import MACRO_TICKS, NEVER

ASLEEP, AWAKE, STIRRED = range(3)
#: Bodies whose momenta are summed one after the other.
_CHUNK = 256
#: Largest steps between two sums of the momenta, once the run is as many steps old as the next one.
_EVERY, _EARLY = 16, 64
#: Roundings of a coordinate that the opening of a bond at rest may show.
ROUNDINGS = 16.0


@ti.func
def beyond(opening, rounding):
    """An opening [m], shorter by a rounding; zero where it is no longer."""
    size = norm(opening)
    return opening * (ti.max(0.0, size - rounding) / ti.max(size, 1e-300))


@ti.data_oriented
class Sleeping(Places):
    """State of sleep of the bodies, and the list of their chunks when momenta are summed.

    awake: ASLEEP, AWAKE, or STIRRED once the body has woken its neighbours. since: tick at which it
    woke, NEVER while asleep. stride: step [s] in which it woke others. woken: bodies that wait to
    be listed, woken_count of them. unsorted: bodies listed out of order since. starting: 1 at the
    start, when all bonds act once. share: of an opening or a speed, at which a body wakes its
    neighbours; 0 where none sleeps. part: connected part of each body. mass [kg], bound2: of each
    part; square of the speed that wakes now [(m/s)^2]. members: bodies by part; chunks of them in
    a row, chunk_count, begin at chunk_first; sums: of the momenta of each [N s]. left_out: bound of
    the impulse [N s] and the energy [J] that each bond left out before it woke.
    """

    def __init__(self, tables: Tables, state: State):
        n = self.most = tables.capacity.bodies
        self.tables, self.state, self.acting = tables, state, (*tables.loads, *tables.supports)
        self.awake, self.woken = (ti.field(ti.i32, shape=n) for _ in range(2))
        self.part, self.members = (ti.field(ti.i32, shape=n) for _ in range(2))
        self.mass, self.bound2 = (ti.field(real, shape=n) for _ in range(2))
        self.stride, self.sums = (ti.field(real, shape=n) for _ in range(2))
        self.since, self.share = ti.field(ti.i64, shape=n), ti.field(real, shape=())
        self.woken_count, self.unsorted, self.starting, self.chunk_count = (
            ti.field(ti.i32, shape=()) for _ in range(4)
        )
        self.chunk_first = ti.field(ti.i32, shape=n + 1)
        self.left_out = ti.Vector.field(2, real, shape=tables.capacity.bonds)

    def upload(self, model: Model, share: float) -> None:
        """Begin with all bodies asleep; all fields are zero before."""
        assign(self.since, np.full(model.body_count, NEVER))
        assign(self.share, share)
        if share:
            self._load_parts(parts_of(model.mesh), model.body_mass)

    def _load_parts(self, part, mass):
        """Lay the bodies out in chunks, each of bodies of one part."""
        members = np.argsort(part, kind="stable")
        ends = np.cumsum(np.bincount(part))
        begins = ends - np.bincount(part)
        first = np.concatenate([np.arange(a, b, _CHUNK) for a, b in zip(begins, ends)])
        for field, array in ((self.part, part), (self.members, members)):
            assign(field, array)
        assign(self.mass, np.bincount(part, mass))
        assign(self.chunk_count, len(first))
        assign(self.chunk_first, np.append(first, len(part)))

    @ti.func
    def at_rest(self, b, factor, rounding):
        """Energy that the springs of a bond hold [J], and nonzero where its law would begin."""
        stiffness, m = self.tables.bond_stiffness[b], self.tables.bond_pair[b]
        motion, energy, begins = self.state.bond_motion(b), 0.0, 0
        for u in range(3 * b, 3 * b + 3):
            arm = unit_arm(motion, self.tables.vertex_slave[u])
            opening = beyond(unit_opening(motion, arm, self.tables.vertex_master[u]), rounding)
            pull, sliding = ti.abs(opening[0]), vec2(opening[1], opening[2])
            energy += 0.5 * (stiffness[0] * pull * pull + stiffness[1] * squared(sliding))
            if ti.static(not self.tables.bond.is_null):
                jump = factor * vec3(pull, opening[1], opening[2])
                begins |= self.tables.bond.begins(m, stiffness, jump)
        return self.tables.unit_area[b] * energy, begins

    @ti.func
    def left_out_now(self, b, seconds, moved: ti.template()):
        """Bound of the impulse [N s] and the energy [J] that a bond has left out so far."""
        slots = self.tables.bond_slots[b]
        i, j = slots[0] >> 2, slots[1] >> 2
        if self.since[i] < 0 or (self.since[j] >= 0 and self.since[j] < self.since[i]):
            i = j
        last, left_out = 0.0, vec2(0.0, 0.0)
        if ti.static(moved):
            last = self.stride[i]
        ticks = self.state.tick[None] - self.since[i]
        if 0 <= self.since[i] and 0 < ticks:
            left_out = self._withheld(b, ti.cast(ticks, real) * seconds, last, self.rounding(i))
        return left_out

    @ti.func
    def _withheld(self, b, elapsed, last, rounding):
        """Impulse [N s] and energy [J] of a bond that was not evaluated for a time [s]."""
        stiffness, m = self.tables.bond_stiffness[b], self.tables.bond_pair[b]
        motion, force, energy = self.state.bond_motion(b), vec3(0.0), 0.0
        for u in range(3 * b, 3 * b + 3):
            arm = unit_arm(motion, self.tables.vertex_slave[u])
            opening = unit_opening(motion, arm, self.tables.vertex_master[u])
            before = beyond(opening - last * unit_velocity(motion, arm), rounding)
            pull = vec3(stiffness[0], stiffness[1], stiffness[1]) * before
            force += pull + self.tables.dashpot.traction(m, b, before / elapsed)
            energy += 0.5 * dot(pull, opening)
        return self.tables.unit_area[b] * vec2(elapsed * norm(force), ti.abs(energy))

    @ti.func
    def begin(self, i):
        """Wake body i at the start where something acts on it or it moves, or none may sleep."""
        stirred = self.share[None] <= 0.0
        for f in range(4):
            b = self.tables.face_bond[4 * i + f]
            if b >= 0:
                energy, _ = self.at_rest(b, 1.0, self.rounding(i))
                if energy > 0.0:
                    stirred = True
        for effect in ti.static(self.acting):
            if effect.acts_on(i) != 0:
                stirred = True
        moving = squared(self.state.velocity[i]) + squared(self.state.spin[i])
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
                    self.awaken(j)

    @ti.func
    def both_awake(self, i, j):
        """Whether the bond of two bodies is evaluated."""
        return self.awake[i] != ASLEEP and self.awake[j] != ASLEEP

    @ti.func
    def rounding(self, i):
        """Opening [m] that a bond of body i may show at rest: a few roundings of coordinates."""
        place = ti.abs(self.state.position[i]).max() + self.tables.radius[i]
        return ti.static(ROUNDINGS * np.finfo(float).eps) * place

    @ti.func
    def stir(self, i, elapsed, velocity, angular_momentum):
        """Wake the neighbours of a body that has moved by more than may be left out."""
        if self.awake[i] == AWAKE:
            spin = norm(angular_momentum) * self.tables.mass_inverse[i] / self.tables.radius[i]
            is_fast = squared(velocity) + spin * spin > self.bound2[self.part[i]]
            if self._opens(i, is_fast):
                self.awake[i], self.stride[i] = STIRRED, elapsed
                for f in range(4):
                    b = self.tables.face_bond[4 * i + f]
                    if b >= 0:
                        if self.state.broken_tick[b] < 0:
                            self.awaken(self.tables.neighbour[4 * i + f])

    @ti.func
    def _opens(self, i, is_fast):
        """Whether body i opens a bond to a body that slept until now by more than is allowed."""
        opens = False
        for f in range(4):
            b = self.tables.face_bond[4 * i + f]
            if b >= 0:
                j = self.tables.neighbour[4 * i + f]
                # Whether another thread has woken it in this substep must not matter.
                slept = self.since[j] < 0 or self.since[j] == self.state.tick[None]
                if slept and self.state.broken_tick[b] < 0:
                    energy, is_more = self._held(b, i, j, self.bound2[self.part[i]])
                    if is_more or (is_fast and energy > 0.0):
                        opens = True
        return opens

    @ti.func
    def _held(self, b, i, j, speed2):
        """Energy that the springs of a bond hold [J], and whether that is more than allowed."""
        rounding = self.rounding(i)
        energy, begins = self.at_rest(b, 1.0 / self.share[None], rounding)
        lighter = ti.min(self.tables.mass[i], self.tables.mass[j])
        return energy, begins != 0 or 2.0 * energy > lighter * speed2

    @ti.func
    def awaken(self, j):
        """Wake body j now, if it sleeps; it is listed at the end of this substep."""
        if ti.atomic_max(self.awake[j], AWAKE) == ASLEEP:
            self.since[j] = self.state.tick[None]
            self.state.last_tick[j] = self.state.tick[None]
            self.woken[ti.atomic_add(self.woken_count[None], 1)] = j

    @ti.func
    def is_due(self):
        """Whether the mean speeds are found anew at the present tick."""
        tick = self.state.tick[None]
        step = tick // MACRO_TICKS
        due = tick % MACRO_TICKS == 0 and (step < _EARLY or step % _EVERY == 0)
        return due and self.share[None] > 0.0

    @ti.func
    def count(self, low):
        """Number of chunks, at the ticks at which their momenta are summed."""
        count = 0
        if self.is_due():
            count = self.chunk_count[None]
        return count

    @ti.func
    def chunk(self, c):
        """Sum the momenta of a chunk of bodies [N s]."""
        total = 0.0
        for a in range(self.chunk_first[c], self.chunk_first[c + 1]):
            i = self.members[a]
            if self.awake[i] != ASLEEP:
                total += self.tables.mass[i] * norm(self.state.velocity[i])
        self.sums[c] = total

    @ti.func
    def renew_bound(self):
        """Set the bound of each part from the sums of its chunks: a share of its mean speed."""
        total = 0.0
        for c in range(self.chunk_count[None]):
            total += self.sums[c]
            end = self.chunk_first[c + 1]
            p = self.part[self.members[end - 1]]
            last = end == self.tables.body_count[None]
            if not last:
                last = self.part[self.members[end]] != p
            if last:
                bound = self.share[None] * (total / self.mass[p])
                self.bound2[p] = bound * bound
                total = 0.0
