"""Readings of a run: tables of energy, momentum and shares that kernels fill for the host."""

from typing import TYPE_CHECKING

import numpy as np
import taichi as ti

from taichi_dem.kit.allocation import values
from taichi_dem.kit.types import vec3
from taichi_dem.step.advance import Advance
from taichi_dem.step.half_step import HalfStep

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
        self.contacts, self.half_step = advance.contacts, HalfStep(advance)

    def pushes(self) -> np.ndarray:
        """Forces [N] and moments [N m] of contacts on every body now, (body_count, 6).

        Summed in the order of the pairs, so that no thread changes a bit.
        """
        pushed = np.zeros((int(values(self.tables.body_count)), 6))
        if self.contacts is not None and int(values(self.contacts.store.near_count)):
            bodies = self.contacts.store.near_table()[0]
            table = np.zeros((len(bodies), 12))
            self._push(table)
            for side in range(2):
                np.add.at(pushed, bodies[:, side], table[:, 6 * side : 6 * side + 6])
        return pushed

    @ti.kernel
    def _push(self, table: ti.types.ndarray(dtype=ti.f64, ndim=2)):
        """Force and moment of every pair's contacts on its first and on its second body."""
        for a in range(self.contacts.store.near_count[None]):
            found = self.advance.forces_now(self.contacts.store.near_slot[a])
            for k in ti.static(range(3)):
                table[a, k], table[a, 3 + k] = -found.force[k], found.moment_i[k]
                table[a, 6 + k], table[a, 9 + k] = found.force[k], found.moment_j[k]

    @ti.func
    def _pushed(self, pushed: ti.template(), i):
        """Force and moment of the contacts of body i, rows of ``pushes``."""
        force, moment = vec3(0.0), vec3(0.0)
        for k in ti.static(range(3)):
            force[k], moment[k] = pushed[i, k], pushed[i, 3 + k]
        return force, moment

    @ti.kernel
    def motion(
        self,
        pushed: ti.types.ndarray(dtype=ti.f64, ndim=2),
        table: ti.types.ndarray(dtype=ti.f64, ndim=2),
    ):
        """Velocity, spin and angular momentum of every body at the time of its position."""
        for i in range(self.tables.body_count[None]):
            force, moment = self._pushed(pushed, i)
            velocity, momentum = self.half_step.motion(i, force, moment)
            spin = self.advance.spin(i, momentum)
            for k in ti.static(range(3)):
                table[i, k], table[i, 3 + k], table[i, 6 + k] = velocity[k], spin[k], momentum[k]

    @ti.kernel
    def step_back(self, pushed: ti.types.ndarray(dtype=ti.f64, ndim=2)):
        """Set the velocities, which are given at time zero, half a step back."""
        for i in range(self.tables.body_count[None]):
            force, moment = self._pushed(pushed, i)
            self.half_step.step_back(i, force, moment)

    @ti.kernel
    def bodies(
        self,
        pushed: ti.types.ndarray(dtype=ti.f64, ndim=2),
        table: ti.types.ndarray(dtype=ti.f64, ndim=2),
    ):
        """Kinetic energy, work of loads and supports, contact heats of every body [J]."""
        for i in range(self.tables.body_count[None]):
            force, moment = self._pushed(pushed, i)
            velocity, momentum = self.half_step.motion(i, force, moment)
            turning = momentum.dot(self.advance.spin(i, momentum))
            moving = self.tables.mass[i] * velocity.norm_sqr()
            table[i, 0] = 0.5 * (moving + turning)
            works = self.half_step.works(i, force, moment)
            for e in ti.static(range(len(self.tables.loads))):
                table[i, 1] = table[i, 1] + (self.state.load_work[i][e] + works[e])
            held = ti.static(len(self.tables.loads))
            table[i, 2] = self.state.load_work[i][held] + works[held]
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
                table[b, 1] = table[b, 1] + self.half_step.bond_heat(b)
            for q in range(3):
                spent = self.tables.tension.spent(b, 3 * b + q)
                table[b, 4] = table[b, 4] + self.tables.unit_area[b] * spent

    @ti.kernel
    def pairs(self, table: ti.types.ndarray(dtype=ti.f64, ndim=2)):
        """Strain, and heats that the first body has not taken, of every pair [J]."""
        for a in range(self.contacts.store.near_count[None]):
            p = self.contacts.store.near_slot[a]
            table[a, 0] = self.contacts.pair_energy(p)
            found, half = self.advance.forces_now(p), self.half_step.pair_step(p)
            heat = self.contacts.store.heat[p] + half * vec3(found.dragged, found.rubbed, 0.0)
            for k in ti.static(range(3)):
                table[a, 1 + k] = heat[k]

    @ti.kernel
    def works(
        self,
        pushed: ti.types.ndarray(dtype=ti.f64, ndim=2),
        work: ti.types.ndarray(dtype=ti.f64, ndim=2),
    ):
        """Work of each load, and of all supports last, on every body [J]."""
        for i in range(self.tables.body_count[None]):
            force, moment = self._pushed(pushed, i)
            works = self.half_step.works(i, force, moment)
            for e in ti.static(range(len(self.tables.loads) + 1)):
                work[i, e] = self.state.load_work[i][e] + works[e]

    @ti.kernel
    def supported(self, index: ti.i32, marks: ti.types.ndarray(dtype=ti.i32, ndim=1)):
        """Mark the bodies on which one of the supports acts."""
        for i in range(self.tables.body_count[None]):
            for e in ti.static(range(len(self.tables.supports))):
                if e == index and self.tables.supports[e].acts_on(i):
                    marks[i] = 1

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
    def pressed(self, marks: ti.types.ndarray(dtype=ti.i32, ndim=1)):
        """Mark released bonds of which the faces overlap."""
        for b in range(self.tables.bond_count[None]):
            if self.state.broken_tick[b] >= 0:
                marks[b] = ti.cast(self.advance.bond_opening(b)[0] < 0.0, ti.i32)

    @ti.kernel
    def active_bonds(self, marks: ti.types.ndarray(dtype=ti.i32, ndim=2)):
        """Mark bonds of which a unit has softened, and of which one has slipped."""
        for b in range(self.tables.bond_count[None]):
            for u in range(3 * b, 3 * b + 3):
                if ti.static(hasattr(self.tables.tension, "is_active")):
                    marks[b, 0] = marks[b, 0] | self.tables.tension.is_active(b, u)
                if ti.static(hasattr(self.tables.shear, "is_active")):
                    marks[b, 1] = marks[b, 1] | self.tables.shear.is_active(b, u)

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
