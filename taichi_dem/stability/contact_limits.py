"""Contacts counted before they touch, and the limits they set to a body's step."""

import numpy as np
import taichi as ti

from taichi_dem.contact.contacts import Contacts
from taichi_dem.elasticity.rates import inverse_root
from taichi_dem.kit.allocation import assign
from taichi_dem.kit.products import matmul, matmul_transposed, transposed_matmul
from taichi_dem.kit.types import mat3, real
from taichi_dem.physics.rotation import place_in, unit3
from taichi_dem.physics.wrench import cross_matrix
from taichi_dem.state.model import Model
from taichi_dem.state.state import State
from taichi_dem.state.tables import Tables
from taichi_dem.state.timeline import MAX_LEVEL

#: Squarings of the block of near contacts: tr(A^32)^(1/32) exceeds its largest eigenvalue by at
#: most 6^(1/32), 6 %, and is never below it.
SQUARINGS = 5


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
    """Sphere pairs that count as contacts, and the block they form on each body.

    A sphere pair counts once it could touch within some steps of the finer of its bodies: it is
    evaluated once a step, and the coarser body is woken before the next time. count: number of the
    sphere pairs of a body pair that count. slides: 1 without friction, or where it is silent.
    """

    constant_fields = ("ahead", "root_mass", "root_inertia", "slides")

    def __init__(self, tables: Tables, state: State, contacts: Contacts):
        self.tables, self.state, self.contacts = tables, state, contacts
        self.store = contacts.store
        self.ahead = ti.field(real, shape=MAX_LEVEL + 1)
        self.count = self.store.column("count_within_margin", ti.i32)
        self.slides = ti.field(ti.i32, shape=())
        # M^-1/2 as 1 / sqrt(m) and I^-1/2 in the body frame.
        self.root_mass = ti.field(real, shape=tables.capacity.bodies)
        self.root_inertia = ti.Matrix.field(3, 3, real, shape=tables.capacity.bodies)

    def load(self, model: Model, ahead: float) -> None:
        """Load a model, and the time [s] that a step of level 0 looks ahead."""
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
        """Rate of the dashpots [1/s] and squared rate of the springs [1/s^2] of body i.

        The largest eigenvalue of M^-1/2 (sum of J^T D J) M^-1/2 over near contacts [1/kg], times
        their largest dashpot [N s/m] and stiffness [N/m]: a bound where partners are of several
        materials. J maps velocity and spin to the velocity at the contact; D is the identity with
        friction, whose dashpot acts along all three axes, and n n^T without. Partners stand still,
        as in ``elasticity.rates.bond_rates``.
        """
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
                a, b, c = self._add_pair(p, side, a, b, c)
                m = self.tables.pair(self.store.body[p][0], self.store.body[p][1])
                constants = self.contacts.law.damping(m), self.contacts.law.elastic(m, 1.0)
                largest = ti.max(largest, ti.Vector(constants))
        return largest_eigenvalue(a, b, c) * largest

    @ti.func
    def _add_pair(self, p, side, a, b, c):
        """Add the near contacts of a pair to the block of its first (0) or second (1) body."""
        i, j = self.store.body[p][0], self.store.body[p][1]
        if side == 1:
            i, j = j, i
        branch, margin = self.state.position[j] - self.state.position[i], self.margin(i, j)
        turn, offset = place_in(self.state.rotation[i], self.state.rotation[j], branch)
        for k in range(self.store.first[p], self.store.last[p]):
            own, other = self.store.sphere[k][0], self.store.sphere[k][1]
            if side == 1:
                own, other = other, own
            near = self.contacts.law.nearest(own, other, turn, offset)
            if self.contacts.law.is_within(near, margin):
                normal = near.apart / ti.max(near.apart.norm(), 1e-30)
                da, db, dc = self._contact(i, near.first.xyz + near.first[3] * normal, normal)
                if ti.static(self.contacts.law.meets_bodies):
                    area = self.contacts.law.largest_area(i, j)
                    da, db, dc = area * da, area * db, area * dc
                a, b, c = a + da, b + db, c + dc
        return a, b, c

    @ti.func
    def _contact(self, i, arm, normal):
        """Blocks of one contact at an arm from the centre of body i, in its frame."""
        along = normal.outer_product(normal)
        if self.slides[None] == 0:
            along = unit3()
        root = self.root_mass[i]
        lever = matmul(matmul(self.root_inertia[i], cross_matrix(arm)), along)
        return along * root * root, lever * root, matmul_transposed(lever, lever)
