"""Contact forces of a pair of bodies; springs of friction."""

import taichi as ti

from taichi_dem.kit.products import cross, dot, matvec, norm, transposed_matvec
from taichi_dem.kit.types import mat3, real, vec3
from taichi_dem.physics.rotation import place_in
from taichi_dem.physics.sphere_pair import active_bits, add_within
from taichi_dem.step.multirate.schedule import Schedule


@ti.data_oriented
class TangentialSprings:
    """Calls a friction law with memory, in the axes of the first body."""

    def __init__(self, schedule: Schedule):
        self.friction, self.schedule = schedule.tables.friction, schedule
        self.present = schedule.has_contact and schedule.contacts.remembers
        if self.present:
            self.evaluated = schedule.store.column("evaluated", ti.i64)

    @ti.func
    def elapsed(self, p):
        """Seconds since pair p was last evaluated, 0 for never; it is evaluated now."""
        elapsed, present = 0.0, self.schedule.state.tick[None] + 1
        if self.evaluated[p] > 0:
            elapsed = self.schedule.seconds(present - self.evaluated[p])
        self.evaluated[p] = present
        return elapsed

    @ti.func
    def follow(self, k, rotation, normal, way):
        """Stretch the spring of sphere pair k by ``way`` [m]."""
        across = transposed_matvec(rotation, normal)
        self.friction.follow(k, across, transposed_matvec(rotation, way))

    @ti.func
    def slip(self, m, k, rotation, bound, way):
        """Shorten the spring of sphere pair k to a bound [N] after ``way`` [m]; energy [J]."""
        return self.friction.slip(m, k, bound, transposed_matvec(rotation, way))

    @ti.func
    def force(self, m, k, rotation):
        """Force of the spring of sphere pair k on the second sphere [N]."""
        return matvec(rotation, self.friction.spring(m, k))

    @ti.func
    def part(self, m, k):
        """Energy [J] that is lost as the spheres of a pair no longer touch; 0 without springs."""
        energy = 0.0
        if ti.static(self.present):
            energy = self.friction.part(m, k)
        return energy

    @ti.func
    def stored(self, m, k):
        """Energy of the spring of sphere pair k [J]; 0 without springs."""
        energy = 0.0
        if ti.static(self.present):
            energy = self.friction.stored(m, k)
        return energy


@ti.dataclass
class PairForces:
    """Forces between two bodies in contact, in world axes."""

    force: vec3
    moment_i: vec3
    moment_j: vec3
    dragged: real
    rubbed: real
    slipped: real
    rub: real
    bound: real
    stored: real
    leverage: mat3
    deepest: real
    near_count: ti.i32
    active: ti.i64


@ti.data_oriented
class ContactForces:
    """Evaluates the contacts of a pair of bodies, and what it gives in a step."""

    def __init__(self, schedule: Schedule):
        self.schedule, self.tables, self.state = schedule, schedule.tables, schedule.state
        self.contacts, self.store = schedule.contacts, schedule.store
        self.springs = TangentialSprings(schedule)
        self.limits, self.has_limits = schedule.limits, schedule.has_limits
        self.limited = self.has_limits and schedule.limits.limited

    @ti.func
    def push(self, p, dt, found):
        """Add the impulses of a pair's forces in a time [s] to both bodies, and their heat."""
        self.contacts.add_impulse(p, 0, -found.force * dt, found.moment_i * dt)
        self.contacts.add_impulse(p, 1, found.force * dt, found.moment_j * dt)
        heat = dt * vec3(found.dragged, found.rubbed, 0.0)
        self.store.heat[p] = self.store.heat[p] + heat

    @ti.func
    def book(self, p, found):
        """Note what acted in a pair, its depth, and what its springs lost."""
        pair = self.store.body[p]
        if found.active != 0:
            for side in ti.static(range(2)):
                self.state.note_active(pair[side], found.active)
        if ti.static(self.springs.present):
            self.contacts.book_friction(p, found.slipped)
        self.contacts.note_depth(p, found.deepest)

    @ti.func
    def forces_of(self, p, elapsed, margin, stepping: ti.template()):
        """Forces of a pair's sphere contacts now, a ``PairForces``."""
        pair = self.store.body[p]
        i, j = pair[0], pair[1]
        branch = self.state.position[j] - self.state.position[i]
        # Most candidates do not touch: tested in the first body's frame, at half the cost.
        rotation = self.state.rotation(i)
        turn, offset = place_in(rotation, self.state.rotation(j), branch)
        found, scale, m = PairForces(), 1.0, self.tables.pair(i, j)
        if ti.static(self.limited):
            scale = self.share(i, j)
        for k in range(self.store.first[p], self.store.last[p]):
            near = self.contacts.look(k, i, j, turn, offset, margin, stepping)
            if ti.static(self.has_limits):
                found.near_count += ti.cast(self.contacts.law.is_within(near, margin), ti.i32)
            if self.contacts.law.is_within(near, 0.0):
                met = self.contacts.law.meeting(near, k, rotation)
                overlap, normal, arm = met.overlap, met.normal, met.arm
                velocity = self._velocity_at(j, arm - branch) - self._velocity_at(i, arm)
                rate = dot(velocity, normal)
                slide = velocity - rate * normal
                if ti.static(self.contacts.law.meets_bodies):
                    rate += dot(met.couple, self.state.spin[j] - self.state.spin[i])
                weighted = self._limited(met.weight * rate, scale)
                push = met.area * self.contacts.law.normal(m, overlap, weighted)
                drag = met.area * self._limited(met.weight * self.contacts.law.damping(m), scale)
                spring = met.area * self.contacts.law.elastic(m, overlap)
                rub, stuck, spent = self._rub(m, k, i, normal, push, drag, slide, elapsed, stepping)
                pushed = push * normal + rub
                found.active |= active_bits(push, rub)
                found.force += pushed
                found.moment_i -= cross(arm, pushed)
                found.moment_j += cross(arm - branch, pushed)
                if ti.static(self.contacts.law.meets_bodies):
                    found.moment_i -= push * met.couple
                    found.moment_j += push * met.couple
                found.dragged += (spring - push) * rate
                found.rubbed -= dot(rub - stuck, slide)
                found.slipped += spent
                found.rub += norm(rub)
                found.bound += self.tables.friction.limit(m, push)
                found.deepest = ti.max(found.deepest, self._depth(near, overlap))
                if ti.static(not stepping):
                    found.stored += self.contacts.overlap_energy(m, met)
                    found.leverage += self.contacts.leverage(met, pushed, push)
            elif ti.static(stepping):
                found.slipped += self.springs.part(m, k)
            if ti.static(not stepping):
                found.stored += self.springs.stored(m, k)
        return found

    @ti.func
    def _depth(self, near, overlap):
        """Depth of a contact as a share of its size; that of bodies counts what lies at rest."""
        if ti.static(self.contacts.law.meets_bodies):
            overlap = near.reach
        return overlap / near.size

    @ti.func
    def _rub(self, m, k, i, normal, push, drag, slide, elapsed, stepping: ti.template()):
        """Friction on the second sphere and the spring's part of it [N]; energy of slipping [J]."""
        rub, stuck, spent = vec3(0.0), vec3(0.0), 0.0
        if ti.static(self.springs.present):
            rotation, bound = self.state.rotation(i), self.tables.friction.limit(m, push)
            if ti.static(stepping):
                self.springs.follow(k, rotation, normal, elapsed * slide)
                spent = self.springs.slip(m, k, rotation, bound, elapsed * slide)
            stuck = self.springs.force(m, k, rotation)
            rub = add_within(stuck, -drag * slide, bound)
        else:
            rub = self.tables.friction.force(m, drag, push, slide)
        return rub, stuck, spent

    @ti.func
    def _limited(self, value, scale):
        """A dashpot's coefficient or rate times its share, where dashpots are limited."""
        if ti.static(self.limited):
            value *= scale
        return value

    @ti.func
    def pair_step(self, p, i, j):
        """Time [s] for which a touching pair applies its force now; 0 if done already."""
        dt = self.schedule.pair_step(i, j)
        if ti.static(self.schedule.controlled):
            until = self.schedule.applied_until.until(i, j)
            if self.schedule.applied_until.pair[p] < until:
                self.schedule.applied_until.pair[p] = until
            else:
                dt = 0.0
        return dt

    @ti.func
    def _velocity_at(self, i, arm):
        return self.state.velocity[i] + cross(self.state.spin[i], arm)

    @ti.func
    def share(self, i, j):
        """Share of its coefficient that a limited dashpot of a pair in contact keeps."""
        first = self.limits.contact_share(i, self.schedule.own_step(i))
        return ti.min(first, self.limits.contact_share(j, self.schedule.own_step(j)))
