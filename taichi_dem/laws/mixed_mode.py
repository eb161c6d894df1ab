"""Cohesive law of bonds in which opening and sliding damage together (Benzeggagh and Kenane)."""

import taichi as ti

from taichi_dem.kit.errors import InputError
from taichi_dem.kit.products import squared
from taichi_dem.kit.types import vec2, vec3
from taichi_dem.kit.validation import positive, shown
from taichi_dem.laws.base import NEAR, check_sliding_energy
from taichi_dem.laws.damage import DamageLaw
from taichi_dem.materials import Material
from taichi_dem.state.tables import Capacity

#: Largest exponent, and its steps: powers of quarters need roots and products alone, which every
#: processor rounds in one way.
_MOST, _QUARTER = 8.0, 0.25


@ti.data_oriented
class MixedMode(DamageLaw):
    """Bonds soften along a straight line, by opening and sliding together, and fail.

    Replaces ``Softening`` and ``ShearSlip``.

    Parameters
    ----------
    shear_energy : float
        Fracture energy G_II of pure sliding [J/m^2]; G_I of pure opening is the fracture energy of
        the material. G_II must exceed c^2 / (2 shear stiffness), or units would fail at once.
    exponent : float, default 2.0
        Exponent of the law of mixed modes [-], a whole number of quarters from 0.25 to 8.

    Notes
    -----
    Strengths of pure opening and pure sliding are the tensile strength and the cohesion of the
    material. B is the share of sliding in the elastic energy of an undamaged unit at its jump.
    Damage begins where twice this energy reaches f_t^2 / k_n + (c^2 / k_s - f_t^2 / k_n) B^n, and
    ends where the unit has spent G = G_I + (G_II - G_I) B^n, which releases the face. It never
    heals. Pressed faces keep their whole normal stiffness; they do not rub.

    References
    ----------
    Benzeggagh and Kenane, Compos. Sci. Technol. 56 (1996) 439; Turon et al., Composites A 37 (2006)
    1; Camanho and Davila, NASA/TM-2002-211737.
    """

    may_be_silent = True

    def __init__(self, shear_energy: float, exponent: float = 2.0):
        self.shear_energy = positive("shear_energy", shear_energy)
        self.exponent = positive("exponent", exponent)
        if exponent > _MOST or exponent % _QUARTER:
            raise InputError(
                f"exponent must be a whole number of quarters from {_QUARTER} to {_MOST:g}, got "
                f"{shown(exponent)}"
            )

    def check_material(self, material: Material) -> None:
        """Raise InputError for a material without cohesion, or too soft for the energy."""
        check_sliding_energy(self, "shear_energy", material)

    def numbers(self, material: Material) -> tuple[float, ...]:
        """Squares of both strengths [Pa^2], twice both energies [J/m^2], quarters of exponent."""
        strengths = material.tensile_strength**2, material.cohesion**2
        energies = 2.0 * material.fracture_energy, 2.0 * self.shear_energy
        return (*strengths, *energies, self.exponent / _QUARTER)

    def declare(self, capacity: Capacity) -> None:
        """Damage [-] of every unit, energy per area that it has spent [J/m^2], and its reach."""
        self.unit = ti.Vector.field(3, ti.f64, shape=capacity.units)

    @ti.func
    def _limits(self, m, stiffness, jump):
        """Twice the elastic energy of an undamaged unit, where damage begins, where it ends."""
        opening = ti.max(0.0, jump[0])
        sliding = stiffness[1] * squared(vec2(jump[1], jump[2]))
        energy = stiffness[0] * opening * opening + sliding
        root, mixity = ti.sqrt(ti.sqrt(sliding / ti.max(energy, 1e-300))), 1.0
        for _ in range(ti.cast(self.law[m, 4], ti.i32)):
            mixity *= root
        first = self.law[m, 0] / stiffness[0]
        begin = first + (self.law[m, 1] / stiffness[1] - first) * mixity
        end = self.law[m, 2] + (self.law[m, 3] - self.law[m, 2]) * mixity
        return energy, begin, end

    @ti.func
    def begins(self, m, stiffness, jump):
        """1 where an intact unit comes near its limit at a jump [m], else 0."""
        energy, begin, _ = self._limits(m, stiffness, jump)
        return ti.cast(energy > NEAR * begin, ti.i32)

    @ti.func
    def traction(self, m, u, stiffness, jump):
        """Traction [Pa] at a jump [m]; raises the damage. No energy goes into slip."""
        damage = self._raised(m, u, stiffness, jump)
        left = 1.0 - damage
        normal = stiffness[0] * jump[0]
        if jump[0] > 0.0:
            normal *= left
        return vec3(normal, left * (stiffness[1] * jump[1]), left * (stiffness[1] * jump[2])), 0.0

    @ti.func
    def _raised(self, m, u, stiffness, jump):
        """Damage of a unit at a jump, noted with the energy that it spends."""
        # From strength to zero the secant stiffness is 1 - d of the first, d = (1 - sqrt(e_0 / e))
        # / (1 - e_0 / e_1), of twice the energy e and its limits e_0, e_1.
        unit = self.unit[u]
        energy, begin, end = self._limits(m, stiffness, jump)
        if energy > begin:
            brittle = 1.0 - begin / end
            damage = ti.min(1.0, (1.0 - ti.sqrt(begin / energy)) / brittle)
            if damage > unit[0]:
                before = _way(unit[0], begin / end)
                spent = 0.5 * end * (_way(damage, begin / end) - before)
                unit = vec3(damage, unit[1] + spent, ti.sqrt(energy / end))
                self.unit[u] = unit
        return unit[0]

    @ti.func
    def failed(self, m, u, traction):
        """1 once the damage is whole, else 0."""
        return ti.cast(self.unit[u][0] >= 1.0, ti.i32)

    @ti.func
    def stored(self, m, u, stiffness, jump):
        """Elastic energy per area of opening and of sliding [J/m^2]."""
        left = 1.0 - self.unit[u][0]
        normal = 0.5 * stiffness[0] * jump[0] * jump[0]
        if jump[0] > 0.0:
            normal *= left
        return normal, 0.5 * left * stiffness[1] * squared(vec2(jump[1], jump[2]))


@ti.func
def _way(damage, ratio):
    """Share of the way from onset to failure at a damage; ratio: of the openings at both."""
    return damage * ratio / (1.0 - damage * (1.0 - ratio))
