"""Advance one bond: its law, its dashpots, its impulse on both bodies, its release."""

import taichi as ti

from taichi_dem.kit.products import cross, dot, squared, stacked, transposed_matvec
from taichi_dem.kit.types import real, vec2, vec3
from taichi_dem.physics.bond import bond_motion, unit_arm, unit_opening, unit_velocity
from taichi_dem.stability.body_limits import RELEASE


@ti.func
def motion_of(step, b):
    """Relative motion of the bodies of a bond now, a ``BondMotion``; step has tables and state."""
    slots = step.tables.bond_slots[b]
    i, j = slots[0] >> 2, slots[1] >> 2
    return bond_motion(
        step.tables.bond_frame[b],
        step.state.position[j] - step.state.position[i],
        step.state.rotation(i),
        step.state.rotation(j),
        step.state.velocity[j] - step.state.velocity[i],
        step.state.spin[i],
        step.state.spin[j],
    )


@ti.data_oriented
class BondStep:
    """What a bond does when it is due: the part of ``Advance``, which owns all that is used here.

    on_demand: whether the law of bonds is asked only near its limits.
    """

    @ti.func
    def bond(self, b):
        """Evaluate the three contact units of a bond; release it when one of them fails."""
        if self._is_pending(b):
            slots, scale = self.tables.bond_slots[b], self.bond_share(b)
            motion = motion_of(self, b)
            moved = motion
            if ti.static(self.solves_bonds):
                motion = self.solver.bonds.mean(b, motion)
            i, j = slots[0] >> 2, slots[1] >> 2
            dt = self.schedule.pair_step(i, j)
            stiffness, m = self.tables.bond_stiffness[b], self.tables.bond_pair[b]
            force, torque, failed = vec3(0.0), vec3(0.0), 0
            dragged, slipped, worked = 0.0, 0.0, 0.0
            for q in range(3):
                u = 3 * b + q
                arm = unit_arm(motion, self.tables.vertex_slave[u])
                opening = unit_opening(motion, arm, self.tables.vertex_master[u])
                before = self._residual_slip(u)
                traction, spent, broken = self.by_law(m, b, u, stiffness, opening)
                way = dt * unit_velocity(moved, arm)
                worked += dot(traction, way)
                if spent != 0.0:
                    # Booked at the mean of the tractions before and after the step.
                    slip = self._residual_slip(u) - before
                    spent -= 0.5 * stiffness[1] * dot(vec2(way[1], way[2]), slip)
                if ti.static(self.notes_limits):
                    across = vec2(traction[1], traction[2])
                    self.state.note_passed(m, b, traction[0], squared(across))
                if ti.static(self.has_dashpot):
                    velocity = unit_velocity(motion, arm)
                    drag = scale * self.tables.dashpot.traction(b, velocity)
                    traction += drag
                    dragged += dot(drag, velocity)
                force += traction
                torque += cross(arm, traction)
                slipped += spent
                failed |= broken
            if ti.static(self.schedule.controlled):
                self.schedule.applied_until.bond[b] = self.schedule.applied_until.until(i, j)
            area = self.tables.unit_area[b]
            if failed == 0:
                self._pull_together(slots, motion, force * (area * dt), torque * (area * dt))
                if ti.static(self.has_dashpot):
                    self._book_drag(b, area * (dragged * dt))
                if ti.static(self.tables.bond.rubs):
                    if slipped != 0.0:
                        self._book_heat(b, area * vec2(slipped, 0.0))
                if ti.static(self.solves_bonds):
                    self.solver.bonds.begin(b, i, j, motion.branch)
            else:
                if ti.static(self.has_dashpot and self.solves_bonds):
                    # Booked for the step before: it was full, though a unit fails now.
                    self._book_drag(b, dragged * (area * dt))
                if ti.static(not self.tables.bond.is_null):
                    # The springs have acted for the first half of the step to here.
                    freed = self._stored(b, motion) - 0.5 * worked
                    self._book_heat(b, area * vec2(slipped, freed))
                self._release(b, slots)
                if ti.static(self.solves_bonds):
                    self.solver.bonds.end(b)

    @ti.func
    def _book_drag(self, b, energy):
        self.state.bond_drag[b] = self.state.bond_drag[b] + energy

    @ti.func
    def _book_heat(self, b, energies):
        self.state.bond_heat[b] = self.state.bond_heat[b] + energies

    @ti.func
    def _residual_slip(self, u):
        """Slip of a unit that its law remembers, in the face frame [m], else zero."""
        slip = vec2(0.0)
        if ti.static(self.tables.bond.remembers_slip):
            slip = self.tables.bond.residual_slip(u)
        return slip

    @ti.func
    def by_law(self, m, b, u, stiffness, opening):
        """Traction of a unit [Pa], energy per area slipped now [J/m^2], 1 where it has failed."""
        traction = vec3(stiffness[0], stiffness[1], stiffness[1]) * opening
        slipped, failed, acts = 0.0, 0, True
        if ti.static(self.on_demand):
            near = self.tables.bond.begins(m, stiffness, opening)
            acts = self.state.activity.is_active(b, near, self.state.tick[None])
        if ti.static(not self.tables.bond.is_null):
            if acts:
                traction, slipped = self.tables.bond.traction(m, u, stiffness, opening)
                failed = self.tables.bond.failed(m, u, traction)
        return traction, slipped, failed

    @ti.func
    def _is_pending(self, b):
        """Whether a bond holds and has not applied its impulse for the coming step already."""
        pending = self.state.broken_tick[b] < 0
        if ti.static(self.schedule.controlled):
            i, j = self.tables.bond_slots[b][0] >> 2, self.tables.bond_slots[b][1] >> 2
            until = self.schedule.applied_until.until(i, j)
            pending = pending and self.schedule.applied_until.bond[b] < until
        return pending

    @ti.func
    def bond_share(self, b):
        """Share of its coefficient that a limited dashpot of a bond keeps: the smaller of two."""
        share = 1.0
        if ti.static(self.limited):
            for side in ti.static(range(2)):
                i = self.tables.bond_slots[b][side] >> 2
                share = ti.min(share, self.limits.bond_share(i, self.schedule.own_step(i)))
        return share

    @ti.func
    def _pull_together(self, slots, motion, impulse, moment):
        """Add opposite impulses to master and slave; moment is about the slave's centre."""
        linear = transposed_matvec(motion.axes, impulse)
        angular = transposed_matvec(motion.axes, moment)
        self._push(slots[0], stacked(linear, angular + cross(motion.branch, linear)))
        self._push(slots[1], stacked(-linear, -angular))

    @ti.func
    def _push(self, slot, impulse):
        if ti.static(not self.schedule.every_bond_acts):
            impulse += self.state.slot[slot]
        self.state.slot[slot] = impulse

    @ti.func
    def _stored(self, b, motion):
        """Elastic energy per area summed over the units of a bond [J/m^2]."""
        energy = 0.0
        for q in range(3):
            u = 3 * b + q
            arm = unit_arm(motion, self.tables.vertex_slave[u])
            opening = unit_opening(motion, arm, self.tables.vertex_master[u])
            normal, tangential = self.tables.bond.stored(b, u, opening)
            energy += normal
            energy += tangential
        return energy

    @ti.func
    def bond_energy(self, b, motion):
        """Elastic energy stored in an intact bond at a motion [J]."""
        return self.tables.unit_area[b] * self._stored(b, motion)

    @ti.func
    def bond_power(self, b, motion):
        """Power that the dashpots of an intact bond take at a motion [W]."""
        power, scale = 0.0, self.bond_share(b)
        if ti.static(self.solves_bonds):
            motion = self.solver.bonds.mean(b, motion)
        for q in range(3):
            velocity = unit_velocity(motion, unit_arm(motion, self.tables.vertex_slave[3 * b + q]))
            power += scale * dot(self.tables.dashpot.traction(b, velocity), velocity)
        return power * self.tables.unit_area[b]

    @ti.func
    def _release(self, b, slots):
        """Release a bond with a failed unit: its faces carry contact spheres from now on."""
        tick = self.state.tick[None]
        self.state.broken_tick[b] = tick
        for side in ti.static(range(2)):
            if ti.static(self.schedule.every_bond_acts):
                self.state.slot[slots[side]] = ti.Vector.zero(real, 6)
            if ti.static(self.has_contact):
                self.state.exposed_tick[slots[side]] = tick
            self.schedule.note_change(slots[side] >> 2)
            if ti.static(self.has_limits):
                self.limits.notice(slots[side] >> 2, RELEASE)
        if ti.static(self.has_contact):
            self.contacts.search_requested[None] = 1
