"""What a bond answers: its law, its dashpots, its impulse on both bodies, its release."""

import taichi as ti

from taichi_dem.kit.products import cross, dot, squared, stacked, transposed_matvec
from taichi_dem.kit.types import real, vec2, vec3
from taichi_dem.laws.contracts import PARTS_OF_BOND
from taichi_dem.physics.bond import unit_arm, unit_opening, unit_velocity
from taichi_dem.stability.body_limits import RELEASE
from taichi_dem.step.multirate.schedule import Schedule


@ti.dataclass
class BondAnswer:
    """What the three units of a bond answer, per area and in its axes."""

    force: vec3
    torque: vec3
    failed: ti.i32
    dragged: real
    slipped: real
    worked: real


@ti.data_oriented
class BondForces:
    """Evaluates bonds and releases them."""

    def __init__(self, schedule: Schedule):
        self.schedule, self.tables, self.state = schedule, schedule.tables, schedule.state
        self.law, self.dashpot = self.tables.bond, self.tables.dashpot
        self.on_demand = self.tables.on_demand and not self.law.is_null
        parts = (effect for effect in self.tables.effects if effect.role in PARTS_OF_BOND)
        self.notes_limits = any(part.is_null for part in parts)
        # Without fast_math a product with zero is not folded: absent terms must not be written.
        self.has_dashpot = bool(self.dashpot.name)
        self.limits, self.has_limits = schedule.limits, schedule.has_limits
        self.limited = self.has_limits and schedule.limits.limited

    @ti.func
    def is_pending(self, b):
        """Whether a bond holds and has not applied its impulse for the coming step already."""
        pending = self.state.broken_tick[b] < 0
        if ti.static(self.schedule.controlled):
            i, j = self.tables.bond_slots[b][0] >> 2, self.tables.bond_slots[b][1] >> 2
            until = self.schedule.applied_until.until(i, j)
            pending = pending and self.schedule.applied_until.bond[b] < until
        return pending

    @ti.func
    def answer(self, b, dt, motion, moved):
        """``BondAnswer`` at a motion, for a step [s]; moved: by how much springs stretch now."""
        stiffness, m = self.tables.bond_stiffness[b], self.tables.bond_pair[b]
        answer, scale = BondAnswer(), self.share(b)
        for q in range(3):
            u = 3 * b + q
            arm = unit_arm(motion, self.tables.vertex_slave[u])
            opening = unit_opening(motion, arm, self.tables.vertex_master[u])
            before = self.law.residual_slip(m, u)
            traction, spent, broken = self.by_law(m, b, u, stiffness, opening)
            travel = dt * unit_velocity(moved, arm)
            answer.worked += dot(traction, travel)
            if spent != 0.0:
                # Booked at the mean of the tractions before and after the step.
                slip = self.law.residual_slip(m, u) - before
                spent -= 0.5 * stiffness[1] * dot(vec2(travel[1], travel[2]), slip)
            if ti.static(self.notes_limits):
                across = vec2(traction[1], traction[2])
                self.state.note_passed(m, b, traction[0], squared(across))
            if ti.static(self.has_dashpot):
                velocity = unit_velocity(motion, arm)
                drag = scale * self.dashpot.traction(m, b, velocity)
                traction += drag
                answer.dragged += dot(drag, velocity)
            answer.force += traction
            answer.torque += cross(arm, traction)
            answer.slipped += spent
            answer.failed |= broken
        return answer

    @ti.func
    def by_law(self, m, b, u, stiffness, opening):
        """Traction of a unit [Pa], energy per area slipped now [J/m^2], 1 where it has failed."""
        traction = vec3(stiffness[0], stiffness[1], stiffness[1]) * opening
        slipped, failed, acts = 0.0, 0, True
        if ti.static(self.on_demand):
            near = self.law.begins(m, stiffness, opening)
            acts = self.state.activity.is_active(b, near, self.state.tick[None])
        if ti.static(not self.law.is_null):
            if acts:
                traction, slipped = self.law.traction(m, u, stiffness, opening)
                failed = self.law.failed(m, u, traction)
        return traction, slipped, failed

    @ti.func
    def share(self, b):
        """Share of its coefficient that a limited dashpot of a bond keeps: the smaller of two."""
        share = 1.0
        if ti.static(self.limited):
            for side in ti.static(range(2)):
                i = self.tables.bond_slots[b][side] >> 2
                share = ti.min(share, self.limits.bond_share(i, self.schedule.own_step(i)))
        return share

    @ti.func
    def pull(self, b, dt, motion, answer):
        """Add the impulse of a ``BondAnswer`` to both bodies, and book what it took."""
        area, slots = self.tables.unit_area[b], self.tables.bond_slots[b]
        linear = transposed_matvec(motion.axes, answer.force * (area * dt))
        # About the slave's centre.
        angular = transposed_matvec(motion.axes, answer.torque * (area * dt))
        self._push(slots[0], stacked(linear, angular + cross(motion.branch, linear)))
        self._push(slots[1], stacked(-linear, -angular))
        self.book_drag(b, area * (answer.dragged * dt))
        if ti.static(not self.law.is_null):
            if answer.slipped != 0.0:
                self._book_heat(b, area * vec2(answer.slipped, 0.0))

    @ti.func
    def _push(self, slot, impulse):
        if ti.static(not self.schedule.every_bond_acts):
            impulse += self.state.slot[slot]
        self.state.slot[slot] = impulse

    @ti.func
    def book_drag(self, b, energy):
        """Book energy that the dashpots of a bond took [J]."""
        if ti.static(self.has_dashpot):
            self.state.bond_drag[b] = self.state.bond_drag[b] + energy

    @ti.func
    def _book_heat(self, b, energies):
        self.state.bond_heat[b] = self.state.bond_heat[b] + energies

    @ti.func
    def release(self, b, motion, answer):
        """Release a bond with a failed unit: its faces carry contact spheres from now on."""
        if ti.static(not self.law.is_null):
            # The springs have acted for the first half of the step to here.
            freed = self._stored(b, motion) - 0.5 * answer.worked
            self._book_heat(b, self.tables.unit_area[b] * vec2(answer.slipped, freed))
        slots, tick = self.tables.bond_slots[b], self.state.tick[None]
        self.state.broken_tick[b] = tick
        for side in ti.static(range(2)):
            if ti.static(self.schedule.every_bond_acts):
                self.state.slot[slots[side]] = ti.Vector.zero(real, 6)
            if ti.static(self.schedule.has_contact):
                self.state.exposed_tick[slots[side]] = tick
            self.schedule.lists.note_change(slots[side] >> 2)
            if ti.static(self.has_limits):
                self.limits.notice(slots[side] >> 2, RELEASE)
        if ti.static(self.schedule.has_contact):
            self.schedule.contacts.search_requested[None] = 1

    @ti.func
    def _stored(self, b, motion):
        """Elastic energy per area summed over the units of a bond [J/m^2]."""
        stiffness, m, energy = self.tables.bond_stiffness[b], self.tables.bond_pair[b], 0.0
        for q in range(3):
            u = 3 * b + q
            arm = unit_arm(motion, self.tables.vertex_slave[u])
            opening = unit_opening(motion, arm, self.tables.vertex_master[u])
            normal, tangential = self.law.stored(m, u, stiffness, opening)
            energy += normal
            energy += tangential
        return energy

    @ti.func
    def energy(self, b, motion):
        """Elastic energy stored in an intact bond at a motion [J]."""
        return self.tables.unit_area[b] * self._stored(b, motion)

    @ti.func
    def power(self, b, motion):
        """Power that the dashpots of an intact bond take at a motion [W]."""
        m, power, scale = self.tables.bond_pair[b], 0.0, self.share(b)
        for q in range(3):
            velocity = unit_velocity(motion, unit_arm(motion, self.tables.vertex_slave[3 * b + q]))
            power += scale * dot(self.dashpot.traction(m, b, velocity), velocity)
        return power * self.tables.unit_area[b]
