"""What laws of bonds have in common whose opening and sliding share one damage."""

import taichi as ti

from taichi_dem.laws.contracts import BondLaw


@ti.data_oriented
class DamageLaw(BondLaw):
    """Base of laws that keep of every unit ``unit``: its damage [-], the energy spent [J/m^2].

    A law declares ``unit``, a field of vectors of three; the last is a failed unit's ``reach``.
    """

    unit: ti.MatrixField

    @ti.func
    def acted(self, m, u, stiffness):
        """1 for a damaged unit, else 0."""
        return ti.cast(self.unit[u][0] > 0.0, ti.i32)

    @ti.func
    def spent(self, m, u, stiffness):
        """Energy per area [J/m^2] that damage has spent in the unit."""
        return self.unit[u][1]

    @ti.func
    def damage(self, m, u, stiffness):
        """0 intact to 1 failed."""
        return self.unit[u][0]

    @ti.func
    def reach(self, m, u):
        """Jump at which the unit failed over the one at which it had to; at most 1 before."""
        return self.unit[u][2]
