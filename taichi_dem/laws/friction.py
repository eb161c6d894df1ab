"""Sliding friction between contact spheres (Konno et al., 2.2)."""

import taichi as ti

from taichi_dem.laws.base import Effect
from taichi_dem.materials import Material
from taichi_dem.physics.sphere_pair import friction_force


@ti.data_oriented
class Friction(Effect):
    """Sliding friction of sphere contacts with the material's coefficient; no tangential spring.

    References
    ----------
    Konno et al., section 2.2.
    """

    role = "friction"
    name = "friction"
    activation = "spheres that touch slide"
    may_be_silent = True

    def numbers(self, material: Material) -> tuple[float, ...]:
        """Friction coefficient."""
        return (material.friction,)

    @ti.func
    def limit(self, m, force_normal):
        """Largest friction [N] at a normal force [N]; of impulses likewise."""
        return self.law[m, 0] * force_normal

    @ti.func
    def force(self, m, damping, force_normal, slide):
        """Force [N] on the second sphere against its sliding velocity [m/s]."""
        return friction_force(self.law[m, 0], damping, force_normal, slide)
