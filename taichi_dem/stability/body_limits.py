"""Rates of the springs and dashpots of each body, and the stable step that they allow.

A body's rates change only where a bond breaks or a contact comes near or leaves. Such bodies are
listed, and their rates found anew at the start of the next substep.
"""

from typing import Any

import numpy as np
import taichi as ti
from numpy.typing import ArrayLike

from taichi_dem import step_control as steps
from taichi_dem.contact.contacts import Contacts
from taichi_dem.kit.allocation import assign
from taichi_dem.kit.types import real
from taichi_dem.methods import Method
from taichi_dem.stability.contact_limits import ContactLimits
from taichi_dem.state.model import Model
from taichi_dem.state.state import State
from taichi_dem.state.tables import Tables
from taichi_dem.step_control import Displacement, StepControl, finer, level_of

#: Events at which a body between its own times is brought to the present and takes its new step at
#: once: a contact comes near, a bond near it breaks, a body that it touches refined its step much.
HIT, RELEASE, CLOSE = 1, 2, 4
#: With c min(1, LIMITED / X) no dashpot takes more than this in a step (X = 2 is unstable).
LIMITED = 1.7
#: Part of it that near contacts get at least, if they need it: a meeting is over in a few steps.
FOR_CONTACTS = 0.5
#: Part of it that they get at most: 1 stops bodies that meet in a step, more throws them back.
STOPS = 1.0


def dashpot_step(rate: ArrayLike) -> np.ndarray:
    """Largest step [s] at which dashpots are stable that slow a body at a rate [1/s].

    A pair of equal bodies moves against each other at twice the rate of one, and forward Euler
    is stable to 2 / (2 rate). Infinite where the rate is zero.
    """
    with np.errstate(divide="ignore"):
        return 1.0 / np.asarray(rate)


def spring_step(rate2: ArrayLike) -> np.ndarray:
    """Largest step [s] at which springs are stable that hold a body at a squared rate [1/s2].

    As for dashpots a pair has twice that of one, and symplectic Euler is stable to
    2 / sqrt(2 omega^2). Infinite where it is zero.
    """
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
class StabilityLimits:
    """Rates of every body, and the list of bodies whose rates must be updated.

    dashpot_table, spring_table: largest eigenvalue of the bonds' block by the set of intact
    bonds, [1/s] and [1/s^2]. bond_damping, contact_damping: rates of a body's dashpots [1/s].
    limit_level, limit_by: level of the longest stable step, and the criterion that sets it.
    displacement, turn, leap: levels for speed, spin and acceleration. listed, listed_count: bodies
    to look at; events: why, as bits. woken: how many were brought to the present between their
    times. controlled: not by a method that only limits dashpots. rule: dt0 [s],
    safety and dashpot floor [s]. jump: levels between neighbours, where they are limited.

    Limited dashpots share 1.7 by need. With X = 2 dt rate for bonds (b) and contacts (c) of a body
    at its step, bonds keep min(X_b, 1.7 - min(X_c, 0.5)) of X_b and contacts min(X_c, 1, 1.7 -
    what the bonds keep) of X_c, and a pair the smaller share of its two. A body's rates never
    add up to more than 1.7 / (2 dt), as the eigenvalue of a sum is no larger than the sum of
    both: no step makes them unstable. Bonds come first, as their dashpots are most of the physics
    here; contacts need little, for X_c is ten to a hundred and any c stops what meets, if it stops
    it in a few steps, and not more than 1, since 1 - X < 0 throws it back.
    One common share min(1, 1.7 / (X_b + X_c)) starves the bonds: +45 % at 1e-8 s, and from 2e-8 s
    on fragments pass through each other.
    The paper's block, one step for all, hole at 3e-4 s against 13.735 mm, residual of the energy
    balance:

        dt     least  most
        1e-8   0.5    1.0    +0.1 %   0.004
        2e-8   0.5    1.0    +0.3 %   0.004
        4e-8   0.1    1.0    +1.1 %   0.004
        4e-8   0.5    1.0    +1.1 %   0.004
        4e-8   1.0    1.0    +2.1 %   0.005
        4e-8   0.5    1.7    +1.0 %   0.007
        6e-8   0.5    1.0    +1.6 %   0.005
        2e-7   0.5    1.0     +39 %   0.004
    """

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
        n = tables.capacity.bodies
        self.dashpot_table, self.spring_table = (ti.field(real, shape=(n, 16)) for _ in range(2))
        self.bond_damping, self.contact_damping = (ti.field(real, shape=n) for _ in range(2))
        self.limit_by, self.limit_level = (ti.field(ti.i32, shape=n) for _ in range(2))
        self.events, self.listed = (ti.field(ti.i32, shape=n) for _ in range(2))
        self.listed_count, self.woken = (ti.field(ti.i32, shape=()) for _ in range(2))

    def load(self, model: Model, method: Method) -> None:
        """Load the bonds of a model and the numbers of a method."""
        rule = method.control or StepControl()
        assign(self.rule, np.array([method.dt0, rule.safety, rule.dashpot_floor]))
        assign(self.jump, rule.level_jump or 0)
        distance: Any = method.distance
        if self.has_distance:
            self.displacement.load(distance, method.dt0)
        if self.has_load:
            self.leap.load(distance, method.dt0)
        self.turn.load(rule.angle, method.dt0)
        if self.has_contact:
            self.contact_limits.load(model, rule.ahead * method.dt0)
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
        """Count the contacts of a pair that a search lists; entered, fresh: nonzero for the reason.

        Entering the list does not change a body's limits, as results must not depend on the reach
        of a search. Spheres that a break has just exposed may touch already.
        """
        event = HIT
        if fresh != 0:
            event = RELEASE
        if fresh != 0 or entered != 0:
            self.notice_pair(p, self.contact_limits.count_within_margin(p), event)

    @ti.func
    def done(self):
        """Empty the list."""
        for a in range(self.listed_count[None]):
            self.events[self.listed[a]] = 0
        self.listed_count[None] = 0

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
        """Wanted level of body i at a time [s], and its criterion.

        A body asks at every step: squares and tables spare it roots and quotients.
        """
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
        """Square of the acceleration of body i by the loads alone [m^2/s^4].

        The larger one of now and a largest step ahead, for loads that set in before its next
        update.
        """
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
        return self._bonds_get(i, step) / ti.max(2.0 * step * self.bond_damping[i], 1e-200)

    @ti.func
    def contact_share(self, i, step):
        """Share of its contacts' dashpots that is stable, beside its bonds, at a step [s]."""
        x = 2.0 * step * self.contact_damping[i]
        left = ti.min(STOPS, LIMITED - self._bonds_get(i, step))
        return ti.min(1.0, left / ti.max(x, 1e-200))

    @ti.func
    def _bonds_get(self, i, step):
        """Part of LIMITED that the bonds take."""
        contacts = ti.min(FOR_CONTACTS, 2.0 * step * self.contact_damping[i])
        return ti.min(2.0 * step * self.bond_damping[i], LIMITED - contacts)
