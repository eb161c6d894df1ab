"""The one evaluation of the contacts of a pair of bodies; springs of friction."""

import taichi as ti

from taichi_dem.kit.products import cross, dot, matvec, norm, transposed_matvec
from taichi_dem.kit.types import mat3, real, vec3, vec4
from taichi_dem.laws.contact_contracts import Touch
from taichi_dem.physics.rotation import place_in
from taichi_dem.physics.sphere_pair import active_bits, add_within
from taichi_dem.step.multirate.schedule import Schedule


@ti.data_oriented
class TangentialSprings:
    """Calls a friction law with memory, in the axes of the first body."""

    def __init__(self, schedule: Schedule):
        self.friction, self.schedule = schedule.tables.friction, schedule
        self.present = schedule.has_contact and schedule.tables.friction.remembers
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
    def follow(self, k, rotation, normal, slip):
        """Stretch the spring of sphere pair k by ``slip`` [m]."""
        across = transposed_matvec(rotation, normal)
        self.friction.follow(k, across, transposed_matvec(rotation, slip))

    @ti.func
    def slip(self, m, k, rotation, bound, moved):
        """Shorten the spring of sphere pair k to a bound [N] after ``moved`` [m]; energy [J]."""
        return self.friction.slip(m, k, bound, transposed_matvec(rotation, moved))

    @ti.func
    def force(self, m, k, rotation):
        """Force of the spring of sphere pair k on the second sphere [N]."""
        return matvec(rotation, self.friction.spring(m, k))


@ti.dataclass
class PairForces:
    """Forces between two bodies in contact, in world axes; spent: by the law of contact [J]."""

    force: vec3
    moment_i: vec3
    moment_j: vec3
    dragged: real
    rubbed: real
    slipped: real
    spent: real
    rub: real
    bound: real
    stored: real
    leverage: mat3
    deepest: real
    near_count: ti.i32
    active: ti.i64


@ti.dataclass
class ContactAnswer:
    """Force of one contact on the second body [N], its normal part, its friction; powers [W].

    slipped: energy that a spring of friction lost [J].
    """

    force: vec3
    pressed: real
    rub: vec3
    rubbed: real
    slipped: real


@ti.data_oriented
class ContactForces:
    """Evaluates the contacts of a pair of bodies, and what it gives in a step."""

    def __init__(self, schedule: Schedule):
        self.schedule, self.tables, self.state = schedule, schedule.tables, schedule.state
        self.contacts, self.store = schedule.contacts, schedule.store
        self.law, self.geometry = self.contacts.law, self.contacts.geometry
        self.friction, self.springs = self.tables.friction, TangentialSprings(schedule)
        self.limits, self.has_limits = schedule.limits, schedule.has_limits
        self.limited = self.has_limits and schedule.limits.limited

    @ti.func
    def push(self, p, dt, forces):
        """Add the impulses of a pair's forces in a time [s] to both bodies, and their heat."""
        self.contacts.add_impulse(p, 0, -forces.force * dt, forces.moment_i * dt)
        self.contacts.add_impulse(p, 1, forces.force * dt, forces.moment_j * dt)
        heat = dt * vec4(forces.dragged, forces.rubbed, 0.0, 0.0)
        self.store.heat[p] = self.store.heat[p] + heat

    @ti.func
    def book(self, p, forces):
        """Note what acted in a pair, its depth, and what springs and law took for good."""
        pair = self.store.body[p]
        if forces.active != 0:
            for side in ti.static(range(2)):
                self.state.note_active(pair[side], forces.active)
        self.book_taken(p, forces.slipped, forces.spent)
        self.contacts.note_depth(p, forces.deepest)

    @ti.func
    def book_taken(self, p, slipped, spent):
        """Book energy [J] that friction and the law of contact took beside an impulse."""
        if ti.static(self.springs.present or self.law.has_memory):
            if slipped != 0.0 or spent != 0.0:
                self.store.heat[p] = self.store.heat[p] + vec4(0.0, slipped, 0.0, spent)
                self.store.waiting[p][0] = 1

    @ti.func
    def frame(self, i, j):
        """Way from body i to j [m], rotation of i, rotation and place of j in the frame of i."""
        branch = self.state.position[j] - self.state.position[i]
        rotation = self.state.rotation(i)
        turn, offset = place_in(rotation, self.state.rotation(j), branch)
        return branch, rotation, turn, offset

    @ti.func
    def touch(self, k, i, j, near, rotation, branch):
        """The ``Meeting`` of entry k, its ``Touch``, and the second body's velocity there [m/s]."""
        met = self.geometry.meeting(near, k, rotation)
        velocity = self.velocity_at(j, met.arm - branch) - self.velocity_at(i, met.arm)
        rate = dot(velocity, met.normal)
        if ti.static(not self.geometry.by_face):
            rate += dot(met.couple, self.state.spin[j] - self.state.spin[i])
        return met, Touch(overlap=ti.max(met.overlap, 0.0), rate=rate, area=met.area), velocity

    @ti.func
    def forces_of(self, p, elapsed, margin, stepping: ti.template()):
        """Forces of a pair's contacts now; stepping: a step takes note of them."""
        pair = self.store.body[p]
        i, j = pair[0], pair[1]
        # Most candidates do not touch: tested in the first body's frame, at half the cost.
        branch, rotation, turn, offset = self.frame(i, j)
        forces, scale, m = PairForces(), 1.0, self.tables.pair(i, j)
        if ti.static(self.limited):
            scale = self.share(i, j)
        for k in range(self.store.first[p], self.store.last[p]):
            near = self.contacts.look(k, i, j, turn, offset, margin, stepping)
            if ti.static(self.has_limits):
                forces.near_count += ti.cast(self.geometry.is_within(near, margin), ti.i32)
            if self.geometry.is_within(near, 0.0) or self.holds(k):
                met, touch, velocity = self.touch(k, i, j, near, rotation, branch)
                push, arm = self.law.push(m, k, touch), met.arm
                given = self.answer(m, k, i, met, touch, push, velocity, scale, elapsed, stepping)
                forces.active |= active_bits(given.pressed, given.rub)
                forces.force += given.force
                forces.moment_i -= cross(arm, given.force)
                forces.moment_j += cross(arm - branch, given.force)
                if ti.static(not self.geometry.by_face):
                    forces.moment_i -= given.pressed * met.couple
                    forces.moment_j += given.pressed * met.couple
                forces.dragged += (met.area * push.elastic - given.pressed) * touch.rate
                forces.rubbed += given.rubbed
                forces.slipped += given.slipped
                forces.spent += met.area * push.spent
                forces.rub += norm(given.rub)
                forces.bound += self.friction.limit(m, given.pressed)
                forces.deepest = ti.max(forces.deepest, self.geometry.depth(near, met.overlap))
                if ti.static(not stepping):
                    forces.stored += met.area * self.law.stored(m, k, touch)
                    forces.leverage += self._leverage(met, given.force, given.pressed)
                elif ti.static(self.law.has_memory):
                    self.law.keep(m, k, touch)
            elif ti.static(stepping):
                forces.slipped += self.part(m, k)
            if ti.static(not stepping):
                forces.stored += self.friction.stored(m, k)
        return forces

    @ti.func
    def _leverage(self, met, pushed, push):
        """Forces on the second body times their arms from the first [N m], where bodies meet."""
        # A pressed face also has a couple; its part along the normal changes no stress.
        leverage = pushed.outer_product(met.arm)
        if ti.static(not self.geometry.by_face):
            leverage += met.normal.outer_product(cross(met.normal, push * met.couple))
        return leverage

    @ti.func
    def holds(self, k):
        """Whether entry k acts, though its surfaces are apart."""
        return False

    @ti.func
    def part(self, m, k):
        """Forget entry k, whose surfaces have parted; energy of its spring of friction [J]."""
        if ti.static(self.law.has_memory):
            self.law.part(m, k)
        return self.friction.part(m, k)

    @ti.func
    def answer(self, m, k, i, met, touch, push, velocity, scale, elapsed, stepping: ti.template()):
        """The ``ContactAnswer`` of the laws to a touch."""
        damping = self.law.damping_at(self.law.row(m), touch.overlap)
        weighted = self._limited(met.weight * touch.rate, scale)
        drag = met.area * self._limited(met.weight * damping, scale)
        pressed = met.area * ti.max(0.0, push.elastic - damping * weighted)
        slide = velocity - dot(velocity, met.normal) * met.normal
        rub, stuck, spent = self._rub(m, k, i, met.normal, pressed, drag, slide, elapsed, stepping)
        return ContactAnswer(
            force=pressed * met.normal + rub,
            pressed=pressed,
            rub=rub,
            rubbed=-dot(rub - stuck, slide),
            slipped=spent,
        )

    @ti.func
    def _rub(self, m, k, i, normal, push, drag, slide, elapsed, stepping: ti.template()):
        """Friction on the second body and the spring's part of it [N]; energy of slipping [J]."""
        rub, stuck, spent = vec3(0.0), vec3(0.0), 0.0
        if ti.static(self.springs.present):
            rotation, bound = self.state.rotation(i), self.friction.limit(m, push)
            if ti.static(stepping):
                self.springs.follow(k, rotation, normal, elapsed * slide)
                spent = self.springs.slip(m, k, rotation, bound, elapsed * slide)
            stuck = self.springs.force(m, k, rotation)
            rub = add_within(stuck, -drag * slide, bound)
        else:
            rub = self.friction.force(m, drag, push, slide)
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
    def velocity_at(self, i, arm):
        """Velocity of body i at an arm from its centre [m/s]."""
        return self.state.velocity[i] + cross(self.state.spin[i], arm)

    @ti.func
    def share(self, i, j):
        """Share of its coefficient that a limited dashpot of a pair in contact keeps."""
        first = self.limits.contact_share(i, self.schedule.own_step(i))
        return ti.min(first, self.limits.contact_share(j, self.schedule.own_step(j)))
