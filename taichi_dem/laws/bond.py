"""The law of a bond as the step asks it: one that couples opening and sliding, or one for each."""

from typing import Any

import taichi as ti

from taichi_dem.kit.types import vec2, vec3

#: Bits of the parts of a ``Separable`` law.
NORMAL, TANGENTIAL = 1, 2


@ti.data_oriented
class Separable:
    """A normal and a tangential law, each for itself but for the pressure: the paper's.

    tension, shear: bound effects of these roles. The rest is as of ``laws.roles.BondLaw``.
    Source: Konno et al., section 2.1.
    """

    def __init__(self, tension: Any, shear: Any):
        self.tension, self.shear = tension, shear
        self.is_null = tension.is_null and shear.is_null
        self.is_whole = not (tension.is_null or shear.is_null)
        self.rubs, self.remembers_slip = not shear.is_null, shear.remembers_slip

    @ti.func
    def begins(self, m, stiffness, jump):
        """Bits of the laws near whose limit an intact unit comes at a jump [m], else 0."""
        bits, sliding = 0, vec2(jump[1], jump[2])
        if ti.static(not self.tension.is_null):
            bits |= NORMAL * self.tension.begins(m, stiffness[0], jump[0])
        if ti.static(not self.shear.is_null):
            pressure = -(stiffness[0] * jump[0])
            bits |= TANGENTIAL * self.shear.begins(m, stiffness[1], sliding, pressure)
        return bits

    @ti.func
    def traction(self, m, u, stiffness, jump):
        """Traction [Pa] at a jump [m], and energy per area slipped away now [J/m^2]."""
        pull = self.tension.traction(m, stiffness[0], u, jump[0])
        sliding = vec2(jump[1], jump[2])
        shear, slipped = self.shear.traction(m, stiffness[1], u, sliding, -pull)
        return vec3(pull, shear[0], shear[1]), slipped

    @ti.func
    def failed(self, m, u, traction):
        """1 once the unit transmits nothing any more, else 0."""
        failed = self.tension.failed(m, u)
        if ti.static(self.shear.releases):
            failed |= self.shear.failed(m, u, -traction[0])
        return failed

    @ti.func
    def stored(self, b, u, jump):
        """Elastic energy per area of opening and of sliding [J/m^2]."""
        normal = self.tension.stored(b, u, jump[0])
        return normal, self.shear.stored(b, u, vec2(jump[1], jump[2]))

    @ti.func
    def spent(self, b, u):
        """Energy per area [J/m^2] that damage has spent in the unit."""
        return self.tension.spent(b, u)

    @ti.func
    def damage(self, b, u):
        """0 intact to 1 failed."""
        return self.tension.damage(b, u)

    @ti.func
    def acted(self, b, u):
        """Bits of the laws that have changed the unit."""
        bits = 0
        if ti.static(hasattr(self.tension, "is_active")):
            bits |= NORMAL * self.tension.is_active(b, u)
        if ti.static(hasattr(self.shear, "is_active")):
            bits |= TANGENTIAL * self.shear.is_active(b, u)
        return bits

    @ti.func
    def residual_slip(self, u):
        """Slip that stays when the traction is gone, in the face frame [m]."""
        return self.shear.residual_slip(u)
