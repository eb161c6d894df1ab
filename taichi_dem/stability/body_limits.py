"""Stable steps: of springs and dashpots, of near contacts, and of each body."""

from typing import Any

import numpy as np
import taichi as ti
from numpy.typing import ArrayLike

from taichi_dem import step_control as steps
from taichi_dem.contact.contacts import Contacts
from taichi_dem.elasticity.rates import inverse_root
from taichi_dem.kit.allocation import assign
from taichi_dem.kit.ordered import Places
from taichi_dem.kit.products import matmul, matmul_transposed, transposed_matmul
from taichi_dem.kit.types import mat3, real
from taichi_dem.methods import Method
from taichi_dem.physics.rotation import place_in, unit3
from taichi_dem.physics.wrench import cross_matrix
from taichi_dem.state.model import Model
from taichi_dem.state.state import State
from taichi_dem.state.tables import Tables
from taichi_dem.state.timeline import MAX_LEVEL
from taichi_dem.step_control import Displacement, StepControl, finer, level_of

#: Squarings of the block of near contacts: tr(A^32)^(1/32) exceeds its largest eigenvalue by at
#: most 6^(1/32), 6 %, and is never below it.
SQUARINGS = 5
#: Events at which a body between its own times is brought to the present and takes its new step at
#: once: a contact comes near, a bond near it breaks, a body that it touches refined its step much.
HIT, RELEASE, CLOSE = 1, 2, 4
#: With c min(1, LIMITED / X) no dashpot takes more than this in a step (X = 2 is unstable).
LIMITED = 1.7
#: Part of it that near contacts get at least, if they need it: a meeting is over in a few steps.
FOR_CONTACTS = 0.5
#: Part of it that they get at most: 1 stops bodies that meet in a step, more throws them back.
STOPS = 1.0


@ti.func
def largest_eigenvalue(a, b, c):
    """Bound from above, by 6 % at most, of the symmetric 6x6 matrix [[a, b^T], [b, c]] >= 0."""
    scale = a.trace() + c.trace()
    bound = 0.0
    if scale > 0.0:
        a, b, c = a / scale, b / scale, c / scale
        for _ in range(SQUARINGS):
            a, b, c = (
                matmul(a, a) + transposed_matmul(b, b),
                matmul(b, a) + matmul(c, b),
                matmul_transposed(b, b) + matmul(c, c),
            )
        root = a.trace() + c.trace()
        for _ in range(SQUARINGS):
            root = ti.sqrt(root)
        bound = scale * root
    return bound


@ti.data_oriented
class ContactLimits:
    """Sphere pairs that count as contacts, and the block they form on each body."""

    constant_fields = ("ahead", "root_mass", "root_inertia", "slides")

    def __init__(self, tables: Tables, state: State, contacts: Contacts):
        self.tables, self.state, self.contacts = tables, state, contacts
        self.store, self.law = contacts.store, contacts.law
        self.ahead = ti.field(real, shape=MAX_LEVEL + 1)
        self.count = self.store.column("count_within_margin", ti.i32)
        self.slides = ti.field(ti.i32, shape=())
        # M^-1/2 as 1 / sqrt(m) and I^-1/2 in the body frame.
        self.root_mass = ti.field(real, shape=tables.capacity.bodies)
        self.root_inertia = ti.Matrix.field(3, 3, real, shape=tables.capacity.bodies)

    def upload(self, model: Model, ahead: float) -> None:
        """Upload a model, and the time [s] that a step of level 0 looks ahead."""
        assign(self.ahead, ahead / 2.0 ** np.arange(MAX_LEVEL + 1))
        root = inverse_root(model.body_mass, model.body_inertia)
        assign(self.root_mass, root[:, 0, 0])
        assign(self.root_inertia, root[:, 3:, 3:])
        friction = self.tables.friction
        assign(self.slides, not friction.name or friction.stands_silent)

    @ti.func
    def margin(self, i, j):
        """Gap [m] that two bodies can close in the time ``ahead``."""
        ahead = self.ahead[ti.max(self.state.level[i], self.state.level[j])]
        return ahead * self.contacts.approach(i, j)

    @ti.func
    def count_within_margin(self, p):
        """How many of the sphere pairs of a pair count now."""
        pair = self.store.body[p]
        return self.contacts.closer(p, self.margin(pair[0], pair[1]))

    @ti.func
    def rates(self, i):
        """Rate of the dashpots [1/s] and squared rate of the springs [1/s^2] of body i."""
        # Largest eigenvalue of M^-1/2 (sum of J^T D J) M^-1/2 over near contacts, partners at rest;
        # D is 1 with friction, whose dashpot acts along all axes, n n^T without.
        a, b, c = mat3(0.0), mat3(0.0), mat3(0.0)
        largest = ti.Vector([0.0, 0.0])
        first, second = self.store.first_of[i], self.store.second_start[i]
        swap = self.store.first_of[i + 1] - first
        for k in range(swap + self.store.second_start[i + 1] - second):
            p, side = 0, 0
            if k < swap:
                p = self.store.near_slot[first + k]
            else:
                p, side = self.store.second_slot[second + k - swap], 1
            if self.count[p] != 0:
                a, b, c, deepest = self._add_pair(p, side, a, b, c)
                i, j = self.store.body[p][0], self.store.body[p][1]
                numbers, geometry = self.law.row(self.tables.pair(i, j)), self.contacts.geometry
                weight = geometry.weight(i, j, geometry.largest_area(i, j))
                damping = weight * self.law.damping_at(numbers, deepest)
                stiffness = self.law.stiffness_at(numbers, deepest)
                largest = ti.max(largest, ti.Vector([damping, stiffness]))
        return largest_eigenvalue(a, b, c) * largest

    @ti.func
    def _add_pair(self, p, side, a, b, c):
        """Add the near contacts of a pair to the block of its first (0) or second (1) body.

        Also returns the deepest overlap [m] that they can reach before they are asked again.
        """
        i, j = self.store.body[p][0], self.store.body[p][1]
        if side == 1:
            i, j = j, i
        branch, margin = self.state.position[j] - self.state.position[i], self.margin(i, j)
        turn, offset = place_in(self.state.rotation(i), self.state.rotation(j), branch)
        area, deepest = self.contacts.geometry.largest_area(i, j), 0.0
        for k in range(self.store.first[p], self.store.last[p]):
            own, other = self.store.sphere[k][0], self.store.sphere[k][1]
            if side == 1:
                own, other = other, own
            near = self.contacts.geometry.nearest(own, other, turn, offset)
            if self.contacts.geometry.is_within(near, margin):
                normal = near.apart / ti.max(near.apart.norm(), 1e-30)
                da, db, dc = self._contact(i, near.first.xyz + near.first[3] * normal, normal)
                a, b, c = a + area * da, b + area * db, c + area * dc
                deepest = ti.max(deepest, margin + self.contacts.geometry.overlap(near))
        return a, b, c, deepest

    @ti.func
    def _contact(self, i, arm, normal):
        """Blocks of one contact at an arm from the centre of body i, in its frame."""
        along = normal.outer_product(normal)
        if self.slides[None] == 0:
            along = unit3()
        root = self.root_mass[i]
        lever = matmul(matmul(self.root_inertia[i], cross_matrix(arm)), along)
        return along * root * root, lever * root, matmul_transposed(lever, lever)


def dashpot_step(rate: ArrayLike) -> np.ndarray:
    """Largest step [s] at which dashpots are stable that slow a body at a rate [1/s]."""
    # Two equal bodies move against each other at twice the rate; Euler is stable to 2 / (2 rate).
    with np.errstate(divide="ignore"):
        return 1.0 / np.asarray(rate)


def spring_step(rate2: ArrayLike) -> np.ndarray:
    """Largest step [s] at which springs are stable that hold a body at a squared rate [1/s2]."""
    # Two equal bodies have twice the squared rate; symplectic Euler is stable to 2 / sqrt(2
    # omega^2).
    with np.errstate(divide="ignore"):
        return 2.0 / np.sqrt(2.0 * np.asarray(rate2))


@ti.func
def dashpot_limit(rate):
    """``dashpot_step`` for kernels: [s], huge where the rate [1/s] is zero."""
    return 1.0 / ti.max(rate, 1e-200)


@ti.func
def spring_limit(rate2):
    """``spring_step`` for kernels: [s], huge where the squared rate [1/s2] is zero."""
    return 2.0 / ti.sqrt(2.0 * ti.max(rate2, 1e-200))


@ti.data_oriented
class StabilityLimits(Places):
    """Rates of every body, and the list of bodies whose rates must be updated."""

    constant_fields = ("dashpot_table", "spring_table")

    def __init__(self, tables: Tables, state: State, contacts: Contacts | None, method: Method):
        self.tables, self.state, self.contacts = tables, state, contacts
        rule, self.controlled = method.control or StepControl(), method.control is not None
        self.has_contact = contacts is not None
        self.has_distance = method.distance is not None
        self.limited = method.dashpot == "limited"
        self.spreads = rule.level_jump is not None
        self.has_load = self.has_distance and bool(tables.loads)
        if self.has_distance:
            self.displacement = Displacement()
        if self.has_load:
            self.leap = Displacement(power=2)
        self.turn = Displacement()
        self.contact_limits = ContactLimits(tables, state, contacts) if contacts else None
        self.jump = ti.field(ti.i32, shape=())
        self.rule = ti.field(real, shape=3)
        n = self.most = tables.capacity.bodies
        self.dashpot_table, self.spring_table = (ti.field(real, shape=(n, 16)) for _ in range(2))
        self.bond_damping, self.contact_damping = (ti.field(real, shape=n) for _ in range(2))
        self.limit_by, self.limit_level = (ti.field(ti.i32, shape=n) for _ in range(2))
        self.events, self.listed = (ti.field(ti.i32, shape=n) for _ in range(2))
        self.listed_count, self.woken = (ti.field(ti.i32, shape=()) for _ in range(2))

    def upload(self, model: Model, method: Method) -> None:
        """Upload the bonds of a model and the numbers of a method."""
        rule = method.control or StepControl()
        assign(self.rule, np.array([method.dt0, rule.safety, rule.dashpot_floor]))
        assign(self.jump, rule.level_jump or 0)
        distance: Any = method.distance
        if self.has_distance:
            self.displacement.upload(distance, method.dt0)
        if self.has_load:
            self.leap.upload(distance, method.dt0)
        self.turn.upload(rule.angle, method.dt0)
        if self.has_contact:
            self.contact_limits.upload(model, rule.ahead * method.dt0)
        if self.tables.dashpot.name:
            assign(self.dashpot_table, model.dashpot_rates)
        if self.controlled:
            assign(self.spring_table, model.spring_rates)

    @ti.func
    def count(self, low):
        """Number of bodies whose rates must be updated."""
        return self.listed_count[None]

    @ti.func
    def pick(self, a):
        """One of them."""
        return self.listed[a]

    @ti.func
    def notice(self, i, event):
        """List body i, once, and note the event."""
        if ti.atomic_or(self.events[i], event) == 0:
            self.listed[ti.atomic_add(self.listed_count[None], 1)] = i

    @ti.func
    def notice_pair(self, p, count, event):
        """Note how many contacts of a pair are near; list both bodies if the number changed."""
        if count != self.contact_limits.count[p]:
            self.contact_limits.count[p] = count
            for side in ti.static(range(2)):
                self.notice(self.contacts.store.body[p][side], event)

    @ti.func
    def notice_listed(self, p, entered, fresh):
        """Count contacts of a pair that a search lists; entered, fresh: nonzero for the reason."""
        # Entering the list does not change a body's limits, as results must not depend on the reach
        # of a search; but spheres that a break has just exposed may touch already.
        event = HIT
        if fresh != 0:
            event = RELEASE
        if fresh != 0 or entered != 0:
            self.notice_pair(p, self.contact_limits.count_within_margin(p), event)

    @ti.func
    def refresh_last(self, i):
        """Find the rates of a body for which nothing else is to be done."""
        self.refresh(i)
        self.events[i] = 0

    @ti.func
    def refresh(self, i):
        """Find the rates of body i, and the longest stable step."""
        intact = 0
        for f in range(4):
            b = self.tables.face_bond[4 * i + f]
            if b >= 0:
                if self.state.broken_tick[b] < 0:
                    intact |= 1 << f
        dashpot = self.dashpot_table[i, intact]
        contact_c, contact_k = 0.0, 0.0
        if ti.static(self.has_contact):
            rates = self.contact_limits.rates(i)
            contact_c, contact_k = rates[0], rates[1]
        self.bond_damping[i], self.contact_damping[i] = dashpot, contact_c
        if ti.static(self.controlled):
            self._limit(i, dashpot, contact_c, self.spring_table[i, intact], contact_k)

    @ti.func
    def _limit(self, i, bond_c, contact_c, bond_k, contact_k):
        """Rates of bonds and contacts add up; the larger one of the two counts as the cause."""
        step, by = self.rule[0], steps.LARGEST
        borne = self.rule[1] * spring_limit(bond_k + contact_k)
        if borne < step:
            step, by = borne, steps.BOND_K
            if contact_k > bond_k:
                by = steps.CONTACT_K
        borne = self.rule[1] * dashpot_limit(bond_c + contact_c)
        if ti.static(self.limited):
            borne = ti.max(borne, self.rule[2])
        if borne < step:
            step, by = borne, steps.BOND_C
            if contact_c > bond_c:
                by = steps.CONTACT_C
        self.limit_level[i], self.limit_by[i] = level_of(step, self.rule[0]), by

    @ti.func
    def wanted(self, i, now):
        """Wanted level of body i at a time [s], and its criterion."""
        # A body asks at every step: squares and tables spare it roots and quotients.
        level, by = self.limit_level[i], self.limit_by[i]
        if ti.static(self.has_distance):
            speed2 = self.state.velocity[i].norm_sqr()
            level, by = finer(level, by, self.displacement.finer(level, speed2), steps.DISPLACEMENT)
        spin2 = self.state.spin[i].norm_sqr()
        level, by = finer(level, by, self.turn.finer(level, spin2), steps.ROTATION)
        if ti.static(self.has_load):
            push2 = self._push2(i, now)
            level, by = finer(level, by, self.leap.finer(level, push2), steps.LOAD)
        return level, by

    @ti.func
    def _push2(self, i, now):
        """Square of the acceleration of body i by the loads alone [m^2/s^4]."""
        # The larger of now and one largest step ahead, for loads that set in before the next
        # update.
        push2, step = 0.0, self.rule[0]
        for ahead in ti.static(range(2)):
            time = now + ahead * step
            motion = self.state.body_motion(i, time, step, time - 0.5 * step, time + 0.5 * step)
            for e in ti.static(range(len(self.tables.loads))):
                if self.tables.loads[e].acts_on(i):
                    force, _ = self.tables.loads[e].wrench(i, motion)
                    push2 = ti.max(push2, force.norm_sqr())
        return push2 * self.tables.mass_inverse[i] ** 2

    @ti.func
    def bond_share(self, i, step):
        """Share of its bonds' dashpots that is stable at a step [s] of body i."""
        # A body's rates add up to LIMITED / (2 dt) at most, so no step is unstable. Bonds come
        # first: one common share would starve them (+45 % at 1e-8 s).
        return self._bonds_get(i, step) / ti.max(2.0 * step * self.bond_damping[i], 1e-200)

    @ti.func
    def contact_share(self, i, step):
        """Share of its contacts' dashpots that is stable, beside its bonds, at a step [s]."""
        x = 2.0 * step * self.contact_damping[i]
        left = ti.min(STOPS, LIMITED - self._bonds_get(i, step))
        return ti.min(1.0, left / ti.max(x, 1e-200))

    @ti.func
    def _bonds_get(self, i, step):
        contacts = ti.min(FOR_CONTACTS, 2.0 * step * self.contact_damping[i])
        return ti.min(2.0 * step * self.bond_damping[i], LIMITED - contacts)
