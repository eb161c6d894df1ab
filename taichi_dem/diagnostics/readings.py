"""Readings of a run: tables of energy, momentum and shares that kernels fill for the host."""

from typing import TYPE_CHECKING

import taichi as ti

from taichi_dem.physics.fracture import coulomb_limit
from taichi_dem.step.advance import Advance

if TYPE_CHECKING:
    from taichi_dem.engine.state import State
    from taichi_dem.engine.tables import Tables


@ti.data_oriented
class Readings:
    """Kernels that read booked terms, or compute others by the laws of the step.

    Every method fills arrays of the counts of the scene.
    """

    def __init__(self, tables: "Tables", state: "State", advance: Advance):
        self.tables, self.state, self.advance = tables, state, advance
        self.contacts = advance.contacts

    @ti.kernel
    def bodies(self, table: ti.types.ndarray(dtype=ti.f64, ndim=2)):
        """Kinetic energy, work of loads and supports, contact heats of every body [J]."""
        for i in range(self.tables.body_count[None]):
            momentum = self.state.angular_momentum[i]
            turning = momentum.dot(self.advance.spin(i, momentum))
            moving = self.tables.mass[i] * self.state.velocity[i].norm_sqr()
            table[i, 0] = 0.5 * (moving + turning)
            for e in ti.static(range(len(self.tables.loads))):
                table[i, 1] = table[i, 1] + self.state.load_work[i][e]
            table[i, 2] = self.state.load_work[i][ti.static(len(self.tables.loads))]
            if ti.static(self.tables.has_contact):
                for k in ti.static(range(3)):
                    table[i, 3 + k] = self.state.contact_heat[i][k]

    @ti.kernel
    def bonds(self, table: ti.types.ndarray(dtype=ti.f64, ndim=2)):
        """Strain, dashpot, slip, release and softening energy of every bond [J]."""
        for b in range(self.tables.bond_count[None]):
            table[b, 0] = self.advance.bond_energy(b)
            if ti.static(self.tables.has_bond_heat):
                for k in ti.static(range(3)):
                    table[b, 1 + k] = self.state.bond_heat[b][k]
            for q in range(3):
                spent = self.tables.tension.spent(b, 3 * b + q)
                table[b, 4] = table[b, 4] + self.tables.unit_area[b] * spent

    @ti.kernel
    def pairs(self, table: ti.types.ndarray(dtype=ti.f64, ndim=2)):
        """Strain, and heats that the first body has not taken, of every pair [J]."""
        for a in range(self.contacts.store.near_count[None]):
            p = self.contacts.store.near_slot[a]
            table[a, 0] = self.contacts.pair_energy(p)
            for k in ti.static(range(3)):
                table[a, 1 + k] = self.contacts.store.heat[p][k]

    @ti.kernel
    def load_work(self, index: ti.i32, work: ti.types.ndarray(dtype=ti.f64, ndim=1)):
        """Work of one load on every body [J]."""
        for i in range(self.tables.body_count[None]):
            for e in ti.static(range(len(self.tables.loads))):
                if e == index:
                    work[i] = self.state.load_work[i][e]

    @ti.kernel
    def support_work(self, index: ti.i32, work: ti.types.ndarray(dtype=ti.f64, ndim=1)):
        """Work [J] of all supports on the bodies that one of them holds; other entries stay."""
        for i in range(self.tables.body_count[None]):
            for e in ti.static(range(len(self.tables.supports))):
                if e == index and self.tables.supports[e].acts_on(i):
                    work[i] = self.state.load_work[i][ti.static(len(self.tables.loads))]

    @ti.kernel
    def momentum(self, table: ti.types.ndarray(dtype=ti.f64, ndim=2)):
        """Linear and angular momentum of every body, and impulses from loads and supports."""
        for i in range(self.tables.body_count[None]):
            linear = self.tables.mass[i] * self.state.velocity[i]
            angular = self.state.angular_momentum[i] + self.state.position[i].cross(linear)
            for k in ti.static(range(3)):
                table[i, k], table[i, 3 + k] = linear[k], angular[k]
            for k in ti.static(range(6)):
                table[i, 6 + k] = self.state.load_impulse[i][k]

    @ti.kernel
    def beyond_limits(
        self,
        strength: ti.f64,
        cohesion: ti.f64,
        friction: ti.f64,
        marks: ti.types.ndarray(dtype=ti.i32, ndim=2),
    ):
        """Mark bonds stretched past their strength, sheared past their Coulomb limit, overlapping.

        The last is asked of released bonds, the others of those that hold.
        """
        for b in range(self.tables.bond_count[None]):
            opening = self.advance.bond_opening(b)
            stiffness = self.tables.bond_stiffness[b]
            if self.state.broken_tick[b] < 0:
                pull = stiffness[0] * opening[0]
                limit = coulomb_limit(cohesion, friction, -pull)
                marks[b, 0] = ti.cast(pull > strength, ti.i32)
                marks[b, 1] = ti.cast(stiffness[1] * opening[1] > limit, ti.i32)
            else:
                marks[b, 2] = ti.cast(opening[0] < 0.0, ti.i32)

    @ti.kernel
    def residual_slip(self, slip: ti.types.ndarray(dtype=ti.f64, ndim=1)):
        """Largest residual slip [m] of the units of every bond that holds.

        Zero for released bonds, and for shear laws that keep none.
        """
        for b in range(self.tables.bond_count[None]):
            largest = 0.0
            if ti.static(self.tables.shear.remembers_slip):
                if self.state.broken_tick[b] < 0:
                    for q in range(3):
                        found = self.tables.shear.residual_slip(3 * b + q).norm()
                        largest = ti.max(largest, found)
            slip[b] = largest

    @ti.kernel
    def damage(self, damage: ti.types.ndarray(dtype=ti.f64, ndim=1)):
        """Mean damage of the units of every bond, 1 once it is released."""
        for b in range(self.tables.bond_count[None]):
            damage[b] = 1.0
            if self.state.broken_tick[b] < 0:
                damage[b] = 0.0
                for q in range(3):
                    damage[b] = damage[b] + self.tables.tension.damage(b, 3 * b + q) / 3.0

    @ti.kernel
    def bond_shares(self, share: ti.types.ndarray(dtype=ti.f64, ndim=1)):
        """Lower each bond's entry to the share of its dashpots that the present steps leave."""
        for b in range(self.tables.bond_count[None]):
            if self.state.broken_tick[b] < 0:
                share[b] = ti.min(share[b], self.advance.bond_share(b))

    @ti.kernel
    def contact_shares(
        self,
        share: ti.types.ndarray(dtype=ti.f64, ndim=1),
        taken: ti.types.ndarray(dtype=ti.f64, ndim=1),
    ):
        """Note how far the steps of touching bodies limit their sphere dashpots.

        share: least share, where dashpots are limited; else taken: largest part of a speed that
        they take in a step.
        """
        for a in range(self.contacts.store.near_count[None]):
            p = self.contacts.store.near_slot[a]
            count = self.contacts.touching(p)
            if count > 0:
                i, j = self.contacts.store.body[p][0], self.contacts.store.body[p][1]
                if ti.static(self.advance.limited):
                    ti.atomic_min(share[i], self.advance.contact_share(i, j))
                else:
                    rate = count * self.contacts.law.damping()
                    rate *= 1.0 / self.tables.mass[i] + 1.0 / self.tables.mass[j]
                    ti.atomic_max(taken[i], rate * self.advance.schedule.pair_step(i, j))
