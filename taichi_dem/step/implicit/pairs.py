"""Dashpots and friction of contacts, sphere by sphere: they push, within the bound of friction."""

import taichi as ti

from taichi_dem.kit import backend
from taichi_dem.kit.allocation import raise_to
from taichi_dem.kit.ordered import CountingSort, Once, Phases, Some, is_serial
from taichi_dem.kit.products import cross, dot, matvec, squared
from taichi_dem.kit.types import real, vec3, vec4
from taichi_dem.physics.rotation import unit3
from taichi_dem.physics.sphere_pair import active_bits, add_within, cut_to
from taichi_dem.step.contact_force import ContactAnswer, ContactForces
from taichi_dem.step.implicit.velocities import Velocities
from taichi_dem.step.multirate.lists import Coloured
from taichi_dem.step.multirate.schedule import Schedule

#: Colours of pairs that share no body; pairs without a free one are visited last, in turn.
COLOURS = 16
#: Those visited side by side: rubble needs no more, and a loop costs a launch even if it is empty.
WIDE = 8
#: A pair that is not coloured, and its key while it touches.
NONE, LEFT = -1, COLOURS + 1
#: Rounds in which pairs are coloured side by side, on a CPU and on a GPU. Of 37,000 contacts in
#: rubble 1 % waits for more than six pairs before it, one for fourteen.
_ROUNDS = 2, 8


@ti.func
def _lowest_free(taken):
    """Lowest colour whose bit is not set; COLOURS where all are."""
    colour = 0
    while (taken >> colour) & 1 == 1 and colour < COLOURS:
        colour += 1
    return colour


@ti.data_oriented
class PairDashpots(ContactForces):
    """Contacts whose dashpots are solved. Data of touching spheres used in sweeps.

    Each sphere has its own impulse: with one block for all, a rocking pair would stick.

    touching: number of spheres of a pair that touch, or may within the step; they come first among
    the pair's candidates. entry: index of the candidate. normal: from first to second. arm: from
    the second's centre to the contact [m]. given: impulse of the spring, or of the remaining gap [N
    s]; of the dashpot per velocity [kg]; velocity per impulse along the normal, and largest across
    it [1/kg]. impulse: on the second, of spring, dashpot and friction [N s]; entries as in
    ``PairStore.sphere``. Where friction sticks, pull: impulse of the spring across the contact [N
    s]; elapsed: time since a pair was last evaluated [s].
    colour: of each pair that touches; order: those pairs by colour, those of colour c from
    colour_first[c] on, and without one from colour_first[COLOURS] to colour_first[LEFT].
    """

    scratch_fields = (
        *("elapsed", "pull"),
        *("touching", "entry", "normal", "arm", "given", "branch"),
        *("order", "colour", "colour_first"),
    )

    def __init__(self, schedule: Schedule, velocities: Velocities):
        super().__init__(schedule)
        self.velocities = velocities
        self.has_friction = bool(self.friction.name)
        if self.springs.present:
            self.elapsed = ti.field(real, shape=self.store.slots)
            self.pull = ti.Vector.field(3, real, shape=self.store.spheres)
        pairs, spheres = self.store.slots, self.store.spheres
        self.entry = ti.field(ti.i32, shape=spheres)
        self.normal, self.arm = (ti.Vector.field(3, real, shape=spheres) for _ in range(2))
        self.given = ti.Vector.field(4, real, shape=spheres)
        self.turns = not self.geometry.by_face
        if self.turns:
            self.couple = ti.Vector.field(3, real, shape=spheres)
        self.impulse = self.store.sphere_column("solved_impulse", real, 3)
        self.branch = ti.Vector.field(3, real, shape=pairs)
        self.touching, self.order, self.colour = (ti.field(ti.i32, shape=pairs) for _ in range(3))
        self.colour_first = ti.field(ti.i32, shape=LEFT + 2)
        most = schedule.lists.pairs.most
        self.by_colour = Coloured(self.colour_first, WIDE, most, LEFT, self.visit_last)
        keys = LEFT + 1, self._key, self._key, self._list, self._end_colour
        self.colouring = CountingSort(schedule.lists.pairs.everyone, *keys)

    @property
    def phases(self) -> Phases:
        """Phases that colour the pairs that touch, and list them by colour, in order."""
        near = Some(self.store.number, self.store.slots, light=True)
        tally, *begin, place = self.colouring.phases
        if is_serial(self.tables.capacity.bodies):
            return ((near, self._colour), tally, *begin, place)
        rounds = ((near, self._colour),) * _ROUNDS[not backend.is_cpu()]
        return (*rounds, tally, (Once(), self._colour_rest), *begin, place)

    @ti.func
    def _colour(self, a):
        """Colour the pair at a place, if it touches and all before it at both bodies have been."""
        p = self.store.near_slot[a]
        if self.touching[p] > 0 and self.colour[p] == NONE:
            taken = 0
            for side in range(2):
                pair = self.store.body[p]
                taken |= self._taken(ti.select(side == 0, pair[0], pair[1]), p)
            if taken >= 0:
                self.colour[p] = _lowest_free(taken)

    @ti.func
    def _taken(self, i, p):
        """Bits of the colours of the pairs of body i before pair p; negative where one has none."""
        taken, last = 0, self.store.body[p][0]
        for k in range(self.store.second_start[i], self.store.second_start[i + 1]):
            q = self.store.second_slot[k]
            if self.store.body[q][0] < last:
                taken |= self._bit(q)
        if i == last:
            for k in range(self.store.first_of[i], self.store.first_of[i + 1]):
                q = self.store.near_slot[k]
                if self.store.body[q][1] < self.store.body[p][1]:
                    taken |= self._bit(q)
        return taken

    @ti.func
    def _bit(self, q):
        """Bit of the colour of a pair; 0 for one that does not touch or has found none free."""
        bit, colour = 0, self.colour[q]
        if self.touching[q] > 0:
            if colour == NONE:
                bit = NONE
            elif colour < COLOURS:
                bit = 1 << colour
        return bit

    @ti.func
    def _colour_rest(self, item):
        """Colour what the rounds have left, one after the other."""
        for c in range(self.colouring.chunks.count(0)):
            if self.colouring.counts[self.colouring.at(c, LEFT)] > 0:
                first, last = self.colouring.chunks.span(c)
                for a in range(first, last):
                    self._colour(a)
                self.colouring.tally(c)

    @ti.func
    def _key(self, p):
        """Colour of a pair; LEFT for none yet, NONE where it does not touch."""
        key = NONE
        if self.touching[p] > 0:
            key = ti.select(self.colour[p] == NONE, LEFT, self.colour[p])
        return key

    @ti.func
    def _list(self, p, place):
        self.order[place] = p

    @ti.func
    def _end_colour(self, colour, last):
        self.colour_first[colour + 1] = last

    @ti.func
    def begin(self, p):
        """Find touching spheres and their spring impulses; start from the last impulses."""
        pair = self.store.body[p]
        i, j = pair[0], pair[1]
        dt = self.schedule.step_seconds[0]
        branch, rotation, turn, offset = self.frame(i, j)
        ahead, m = dt * self.contacts.approach(i, j), self.tables.pair(i, j)
        if ti.static(self.turns):
            # Bodies have no area of contact before they touch.
            ahead = 0.0
        force, moment, deepest, parted, spent = vec3(0.0), vec3(0.0), 0.0, 0.0, 0.0
        elapsed = 0.0
        if ti.static(self.springs.present):
            elapsed = self.springs.elapsed(p)
            self.elapsed[p] = elapsed
        start = self.store.first[p]
        end = start
        for k in range(start, self.store.last[p]):
            near = self.contacts.look(k, i, j, turn, offset, ahead, True)
            if self.geometry.is_within(near, ahead):
                met, touch, _velocity = self.touch(k, i, j, near, rotation, branch)
                push, normal, arm = self.law.push(m, k, touch), met.normal, met.arm - branch
                damping = self.law.damping_at(self.law.row(m), touch.overlap)
                self.entry[end], self.normal[end], self.arm[end] = k, normal, arm
                # Spheres still apart may approach until they touch, at the end of the step.
                spring = dt * push.elastic + damping * ti.min(met.overlap, 0.0)
                along, across = self._share(i, j, branch, arm, met)
                drag = dt * (damping * met.area * met.weight)
                self.given[end] = [met.area * spring, drag, along, across]
                force += self.impulse[k]
                moment += cross(arm, self.impulse[k])
                if ti.static(self.turns):
                    self.couple[end] = met.couple
                    moment += dot(self.impulse[k], normal) * met.couple
                depth = self.geometry.depth(near, met.overlap)
                deepest = ti.max(deepest, depth)
                if ti.static(self.law.has_memory):
                    spent += met.area * push.spent
                    self.law.keep(m, k, touch)
                if ti.static(self.springs.present):
                    self.pull[end] = vec3(0.0)
                    if depth > 0.0:
                        travel = self._way(i, j, branch, arm, normal, elapsed)
                        self.springs.follow(k, rotation, normal, travel)
                        self.pull[end] = dt * self.springs.force(m, k, rotation)
                end += 1
            else:
                self.impulse[k] = vec3(0.0)
            if not self.geometry.is_within(near, 0.0):
                parted += self.part(m, k)
        self.contacts.note_depth(p, deepest)
        self.touching[p], self.branch[p], self.colour[p] = end - start, branch, NONE
        if end > start:
            around = moment + cross(branch, force)
            self.contacts.add_impulse(p, 0, -force, -around)
            self.contacts.add_impulse(p, 1, force, moment)
        self.book_taken(p, parted, spent)

    @ti.func
    def _turned(self, c, angular):
        """Part of a contact's rate of opening that its couple makes of a spin [m/s]."""
        rate = 0.0
        if ti.static(self.turns):
            rate = dot(self.couple[c], angular)
        return rate

    @ti.func
    def _moment(self, c, impulse):
        """Moment of a contact's impulse about the second body's centre [N m s]."""
        moment = cross(self.arm[c], impulse)
        if ti.static(self.turns):
            moment += dot(impulse, self.normal[c]) * self.couple[c]
        return moment

    @ti.func
    def _way(self, i, j, branch, arm, normal, elapsed):
        """Tangential displacement of a contact's second sphere against the first in a time [m]."""
        velocity = self.velocity_at(j, arm) - self.velocity_at(i, arm + branch)
        return elapsed * (velocity - dot(velocity, normal) * normal)

    @ti.func
    def _share(self, i, j, branch, arm, met):
        """Velocity per impulse along the normal, and the largest across it [1/kg]."""
        other, normal = arm + branch, met.normal
        slack = self.velocities.slack(i) + self.velocities.slack(j)
        # trace([r]x^T A [r]x) and n [r]x^T A [r]x n, for both bodies.
        first, second = cross(other, normal), cross(arm, normal)
        along = dot(normal, matvec(slack, normal))
        turn_i, turn_j = self.velocities.turn[i], self.velocities.turn[j]
        along += dot(first, matvec(turn_i, first)) + dot(second, matvec(turn_j, second))
        if ti.static(self.velocities.couples):
            along += self._coupled(i, j, normal, first, second)
        first_along, second_along = first, second
        across = slack.trace()
        for c in ti.static(range(3)):
            axis = unit3()[:, c]
            first, second = cross(other, axis), cross(arm, axis)
            across += dot(first, matvec(turn_i, first))
            across += dot(second, matvec(turn_j, second))
            if ti.static(self.velocities.couples):
                across += self._coupled(i, j, axis, first, second)
        across -= along
        if ti.static(self.turns):
            first, second = first_along + met.couple, second_along + met.couple
            along = dot(normal, matvec(slack, normal))
            along += dot(first, matvec(turn_i, first)) + dot(second, matvec(turn_j, second))
            if ti.static(self.velocities.couples):
                along += self._coupled(i, j, normal, first, second)
        return along, across

    @ti.func
    def _coupled(self, i, j, axis, first, second):
        """What bodies that turn where they are pushed add to the velocity per impulse [1/kg]."""
        turned = matvec(self.velocities.coupling[i], first)
        turned += matvec(self.velocities.coupling[j], second)
        return 2.0 * dot(axis, turned)

    @ti.func
    def visit(self, a):
        """Solve the contacts of the pair at place a of the order, one after the other."""
        p, change2 = self.order[a], 0.0
        pair = self.store.body[p]
        m = self.tables.pair(pair[0], pair[1])
        start = self.store.first[p]
        for c in range(start, start + self.touching[p]):
            k, along = self.entry[c], self.given[c][2]
            linear, angular = self.velocities.apart(pair[0], pair[1], self.branch[p])
            answer = self._answer(m, c, linear, angular)
            step = self.impulse[k] - answer
            self.impulse[k] = answer
            self.velocities.pull(pair[0], pair[1], self.branch[p], step, self._moment(c, step))
            change2 = ti.max(change2, along * along * squared(step))
        raise_to(self.velocities.change2, change2)

    @ti.func
    def visit_last(self, item):
        """Visit the pairs of other colours and of none, one after the other."""
        for a in range(self.colour_first[WIDE], self.colour_first[LEFT]):
            self.visit(a)

    @ti.func
    def _answer(self, m, c, linear, angular):
        """Impulse of a contact by its laws [N s], with those of all others as they are."""
        normal, given, held = self.normal[c], self.given[c], self.impulse[self.entry[c]]
        push, damping, giving, across = given[0], given[1], given[2], given[3]
        velocity = linear + cross(angular, self.arm[c])
        pressed, along = dot(held, normal), dot(velocity, normal)
        rate = along + self._turned(c, angular)
        # The opening rate without this contact's own impulse, and the law solved for the impulse.
        free = rate - giving * pressed
        answer = ti.max(0.0, (push - damping * free) / (1.0 + damping * giving)) * normal
        if ti.static(self.has_friction):
            slide = velocity - along * normal - across * (held - pressed * normal)
            bound = self.friction.limit(m, dot(answer, normal))
            stick = -damping / (1.0 + damping * across)
            if ti.static(self.springs.present):
                pull = cut_to(self.pull[c], bound)
                answer += add_within(pull, stick * (slide + across * pull), bound)
            else:
                answer += cut_to(stick * slide, bound)
        return answer

    @ti.func
    def book_sweeps(self, p):
        """Book the energy taken by dashpots and friction of a pair, at its mean motion."""
        if self.touching[p] > 0:
            pair = self.store.body[p]
            i, j, branch = pair[0], pair[1], self.branch[p]
            after, turned = self.velocities.apart(i, j, branch)
            m = self.tables.pair(i, j)
            spin = self.state.spin[i]
            before = self.state.velocity[j] - self.state.velocity[i] - cross(spin, branch)
            linear = 0.5 * (after + before)
            angular = 0.5 * (turned + self.state.spin[j] - spin)
            start = self.store.first[p]
            dragged, rubbed, active = 0.0, 0.0, ti.i64(0)
            for c in range(start, start + self.touching[p]):
                velocity, normal = linear + cross(angular, self.arm[c]), self.normal[c]
                impulse = self._answer(m, c, after, turned)
                pressed = dot(impulse, normal)
                rate = dot(velocity, normal) + self._turned(c, angular)
                dragged += (ti.max(self.given[c][0], 0.0) - pressed) * rate
                rub = impulse - pressed * normal
                active |= active_bits(pressed, rub)
                if ti.static(self.springs.present):
                    stuck, spent = self._slip(m, p, c, i, j, pressed)
                    rub -= stuck
                    rubbed += spent
                rubbed -= dot(rub, velocity)
            if active != 0:
                self.state.note_active(i, active)
                self.state.note_active(j, active)
            self.store.heat[p] = self.store.heat[p] + vec4(dragged, rubbed, 0.0, 0.0)

    @ti.func
    def holds(self, k):
        """Whether entry k had an impulse in the last step."""
        return squared(self.impulse[k]) > 0.0

    @ti.func
    def answer(self, m, k, i, met, touch, push, velocity, scale, elapsed, stepping: ti.template()):
        """The mean force of the last step, an ``ContactAnswer``."""
        force = self.impulse[k] / self.schedule.step_seconds[0]
        pressed = dot(force, met.normal)
        rub = force - pressed * met.normal
        free = rub
        if ti.static(self.springs.present):
            free -= self.springs.force(m, k, self.state.rotation(i))
        return ContactAnswer(force=force, pressed=pressed, rub=rub, rubbed=-dot(free, velocity))

    @ti.func
    def _slip(self, m, p, c, i, j, pressed):
        """Limit a spring in a step; return its impulse [N s] and the energy of slipping [J]."""
        k, normal, rotation = self.entry[c], self.normal[c], self.state.rotation(i)
        dt = self.schedule.step_seconds[0]
        bound = self.friction.limit(m, pressed) / dt
        travel = self._way(i, j, self.branch[p], self.arm[c], normal, self.elapsed[p])
        spent = self.springs.slip(m, k, rotation, bound, travel)
        return dt * self.springs.force(m, k, rotation), spent
