"""Tractions of a bond's contact units: the part of ``Advance`` that asks the bond's laws."""

import taichi as ti

from taichi_dem.kit.products import dot, norm, squared
from taichi_dem.kit.types import vec2, vec3
from taichi_dem.physics.bond import unit_arm, unit_opening, unit_velocity
from taichi_dem.physics.rotation import zero3
from taichi_dem.state.activity import SLIP, SOFTENING


@ti.func
def beyond(opening, rounding):
    """An opening [m], shorter by a rounding; zero where it is no longer."""
    length = norm(opening)
    return opening * (ti.max(0.0, length - rounding) / ti.max(length, 1e-300))


@ti.data_oriented
class BondLaws:
    """Base of ``Advance``, which owns all that is used here.

    m: pair of materials of a bond. on_demand: whether the normal and the shear law are evaluated
    only on bonds that came near their limits (``Activity``); else on all.
    """

    @ti.func
    def pull(self, m, b, u, stiffness, opening):
        """Normal traction of a unit [Pa] at an opening [m], by its law where that acts."""
        traction = stiffness * opening
        if ti.static(self.on_demand[SOFTENING]):
            begins = self.tables.tension.begins(m, stiffness, opening)
            if self.activity.is_active(b, SOFTENING, begins, self.state.tick[None]):
                traction = self.tables.tension.traction(m, stiffness, u, opening)
        else:
            traction = self.tables.tension.traction(m, stiffness, u, opening)
        return traction

    @ti.func
    def shear(self, m, b, u, stiffness, sliding, pressure):
        """Shear traction of a unit [Pa] and energy per area slipped away now [J/m^2]."""
        traction, spent = stiffness * sliding, 0.0
        if ti.static(self.on_demand[SLIP]):
            begins = self.tables.shear.begins(m, stiffness, sliding, pressure)
            if self.activity.is_active(b, SLIP, begins, self.state.tick[None]):
                traction, spent = self.tables.shear.traction(m, stiffness, u, sliding, pressure)
        else:
            traction, spent = self.tables.shear.traction(m, stiffness, u, sliding, pressure)
        return traction, spent

    @ti.func
    def motion_of(self, b):
        """Relative motion of the two bodies of a bond now, a ``BondMotion``."""
        return self._motion(b, self.tables.bond_slots[b])

    @ti.func
    def at_rest(self, b, factor, rounding):
        """Energy that the springs of a bond hold [J], and 1 where one of its laws would begin.

        Of what the bond is opened beyond a rounding [m]; a law begins at this opening times a
        factor, pressed as pulled, and sheared without pressure.
        """
        stiffness, m = self.tables.bond_stiffness[b], self.tables.bond_pair[b]
        motion, energy, begins = self.motion_of(b), 0.0, 0
        for u in range(3 * b, 3 * b + 3):
            arm = unit_arm(motion, self.tables.vertex_slave[u])
            opening = beyond(unit_opening(motion, arm, self.tables.vertex_master[u]), rounding)
            pull, sliding = ti.abs(opening[0]), vec2(opening[1], opening[2])
            energy += 0.5 * (stiffness[0] * pull * pull + stiffness[1] * squared(sliding))
            if ti.static(self.on_demand[SOFTENING]):
                begins |= self.tables.tension.begins(m, stiffness[0], factor * pull)
            if ti.static(self.on_demand[SLIP]):
                begins |= self.tables.shear.begins(m, stiffness[1], factor * sliding, 0.0)
        return self.tables.unit_area[b] * energy, begins

    @ti.func
    def withheld(self, b, elapsed, last, rounding):
        """Impulse [N s] and energy [J] of a bond that was not evaluated for a time [s].

        last: time [s] since the last evaluation that it missed. The springs' force has grown to
        what it was then; the dashpots' impulse is that of the mean velocity. Energy: what springs
        hold now, less the work of a leapfrog's coming step. Of what exceeds a rounding [m].
        """
        stiffness, force, energy = self.tables.bond_stiffness[b], zero3(), 0.0
        motion = self.motion_of(b)
        for u in range(3 * b, 3 * b + 3):
            arm = unit_arm(motion, self.tables.vertex_slave[u])
            opening = unit_opening(motion, arm, self.tables.vertex_master[u])
            before = beyond(opening - last * unit_velocity(motion, arm), rounding)
            pull = vec3(stiffness[0], stiffness[1], stiffness[1]) * before
            force += pull + self.tables.dashpot.traction(b, before / elapsed)
            energy += 0.5 * dot(pull, opening)
        return self.tables.unit_area[b] * vec2(elapsed * norm(force), ti.abs(energy))

    @ti.func
    def has_failed(self, m, b, u, pull):
        """1 once a unit transmits nothing any more, else 0; pull: its normal traction [Pa]."""
        failed = 0
        if ti.static(self.on_demand[SOFTENING]):
            if self.activity.has_begun(b, SOFTENING):
                failed = self.tables.tension.failed(m, u)
        else:
            failed = self.tables.tension.failed(m, u)
        if ti.static(self.shear_releases):
            if ti.static(self.on_demand[SLIP]):
                if self.activity.has_begun(b, SLIP):
                    failed |= self.tables.shear.failed(m, u, -pull)
            else:
                failed |= self.tables.shear.failed(m, u, -pull)
        return failed
