"""Material of the bodies and of the bonds between them, in SI units.

Bonds have the normal stiffness E_n / h and the tangential one E_t / h per area, h the distance of
the two bodies along the normal. In a tessellation the sum of area times h over the bonds is three
volumes, and with normals in all directions alike two mean fields bound the moduli:

  displacements affine, rotations none:  3 K = E_n,  10 G = 2 E_n + 3 E_t,
  tractions uniform, t = sigma n:        3 K = E_n,  1 / G = 4 / (5 E_n) + 6 / (5 E_t).

The first, of microplanes, reaches only nu <= 1/4 (Bazant and Oh, J. Eng. Mech. 111 (1985) 559).
Tetrahedra follow the second, a lower bound of the stiffness, to a tenth. What they carry beyond it
(``_MEASURED``) was found by periodic cells of random tetrahedra, solved in statics.
"""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from taichi_dem.kit.errors import InputError
from taichi_dem.kit.likely_units import ANGLE, DENSITY, MODULUS, STRENGTH, in_unit
from taichi_dem.kit.validation import between, plain_fields, positive, shown, told_apart
from taichi_dem.materials.bond_rules import (
    BondRule,
    Constant,
    ContactRule,
    ContactShareOfCritical,
    FaceStiffness,
    ModulusOverDistance,
    Rule,
    ShareOfCritical,
)
from taichi_dem.materials.strength import MOST_SPREAD

#: E_t / E_n, then 3 K / E_n and G over that of uniform tractions: means over five periodic Delaunay
#: meshes of 990 to 1900 tetrahedra about points that repel each other, which differ among each
#: other by up to SPREAD.
_MEASURED = np.array(
    [
        [0.02, 1.0023, 1.2093],
        [0.04, 1.0044, 1.1891],
        [0.08, 1.0082, 1.1587],
        [1.0 / 6.0, 1.0150, 1.1172],
        [0.25, 1.0205, 1.0931],
        [0.35, 1.0261, 1.0748],
        [0.5, 1.0332, 1.0591],
        [0.7, 1.0408, 1.0496],
        [1.0, 1.0499, 1.0469],
        [1.5, 1.0610, 1.0541],
        [2.5, 1.0753, 1.0784],
        [4.0, 1.0879, 1.1123],
    ]
)
#: Largest deviation of E of one of these meshes from the mean, as a share, and of nu.
SPREAD = 0.03, 0.002
#: Poisson's ratios from the least to the largest that bonds give with ratios of stiffness in use.
POISSON = -0.2, 0.45
#: Fields whose number tells by its size when another unit is meant.
_QUANTITIES = {"density": DENSITY, "tensile_strength": STRENGTH, "cohesion": STRENGTH}
_MAY_BE_ZERO = frozenset(
    {
        *("normal_damping", "shear_damping", "cohesion", "friction", "contact_damping"),
        *("strength_spread", "strength_volume"),
    }
)
#: Kind of rule that may stand for a number, by field; what joins two materials is in series there.
RULES: dict[str, type] = {
    **dict.fromkeys(
        ("normal_stiffness", "shear_stiffness", "normal_damping", "shear_damping"), BondRule
    ),
    **dict.fromkeys(("contact_stiffness", "contact_damping"), ContactRule),
}

#: Times its strength that no bond reaches; a power of two, so that no digit changes.
_BEYOND = 2.0**40
#: Largest angle of friction [degrees].
_STEEPEST = 89.9
#: What to do where elements are too large for strength and energy.
REFUSE, WEAKEN = "refuse", "weaken"
#: What bonds of a lowered strength may spend over what they hold when they reach it: above 1, so
#: that faces inclined by up to 45 degrees, which hold more and spend less, do not fail at once.
SPARE = 1.25


def bond_moduli(young: float, poisson: float) -> tuple[float, float]:
    """Normal and tangential modulus E_n, E_t of bonds [Pa] for E [Pa] and Poisson's ratio."""
    young, poisson = positive("young", young), between("poisson", poisson, *POISSON)
    ratio = _ratio_of(poisson)
    normal = young / _constants_at(ratio)[0]
    return normal, ratio * normal


def elastic_constants(normal: float, shear: float) -> tuple[float, float]:
    """Young's modulus [Pa] and Poisson's ratio for the moduli E_n, E_t of bonds [Pa]."""
    normal, shear = positive("normal", normal), positive("shear", shear)
    least, most = float(_MEASURED[0, 0]), float(_MEASURED[-1, 0])
    young, poisson = _constants_at(between("shear / normal", shear / normal, least, most))
    return normal * young, poisson


def _constants_at(ratio):
    """E / E_n and Poisson's ratio at a ratio E_t / E_n."""
    place = np.log(_MEASURED[:, 0])
    bulk, shear = (float(np.interp(np.log(ratio), place, _MEASURED[:, k])) for k in (1, 2))
    bulk, shear = bulk / 3.0, shear / (0.8 + 1.2 / ratio)
    poisson = (3.0 * bulk - 2.0 * shear) / (6.0 * bulk + 2.0 * shear)
    return 9.0 * bulk * shear / (3.0 * bulk + shear), poisson


def _ratio_of(poisson):
    """E_t / E_n that gives a Poisson's ratio, which falls as it grows: by bisection."""
    low, high = float(_MEASURED[0, 0]), float(_MEASURED[-1, 0])
    for _ in range(60):
        middle = math.sqrt(low * high)
        low, high = (middle, high) if _constants_at(middle)[1] > poisson else (low, middle)
    return middle


@dataclass(frozen=True)
class Material:
    """Constants of one homogeneous material (Konno et al., sections 2.1 and 2.2, Table 1).

    Stiffnesses and dashpots are numbers, or rules of moduli and sizes (``from_elastic``).

    Parameters
    ----------
    density : float
        Density [kg/m^3].
    normal_stiffness : float or rule
        Normal stiffness of a bond per area [Pa/m], and of a contact of two bodies.
    shear_stiffness : float or rule
        Shear stiffness of a bond per area [Pa/m].
    normal_damping : float or rule
        Normal dashpot of a bond per area [Pa s/m].
    shear_damping : float or rule
        Shear dashpot of a bond per area [Pa s/m].
    tensile_strength : float
        Tensile strength of a bond [Pa].
    cohesion : float
        Cohesion of a bond [Pa].
    friction : float
        Friction coefficient of bonds and of contacts.
    fracture_energy : float
        Fracture energy of mode I [J/m^2].
    contact_stiffness : float or rule
        Stiffness of one contact of spheres [N/m], for ``SphereContact`` alone.
    contact_damping : float or rule
        Dashpot of one contact of spheres [N s/m], likewise.
    strength_spread : float, default 0.0
        Relative standard deviation of the strength from bond to bond, at most 1: by Weibull's law,
        drawn by the seed of the scene. Tensile strength, cohesion and fracture energies of a bond
        vary together, so that its opening at failure stays; those given are the means.
    strength_volume : float, default 0.0
        Volume [m^3] of rock with this mean strength; larger bonds are weaker. 0: all sizes alike.
    coarse : {"refuse", "weaken"}, default "refuse"
        What a scene does if elements are too large for strength and energy (``from_elastic``).

    Raises
    ------
    InputError
        A value is out of its range, or a bond would fail before it reaches its strength.
    """

    density: float
    normal_stiffness: Constant
    shear_stiffness: Constant
    normal_damping: Constant
    shear_damping: Constant
    tensile_strength: float
    cohesion: float
    friction: float
    fracture_energy: float
    contact_stiffness: Constant
    contact_damping: Constant
    strength_spread: float = 0.0
    strength_volume: float = 0.0
    coarse: str = REFUSE

    def __post_init__(self):
        plain_fields(self)
        if self.coarse not in (REFUSE, WEAKEN):
            raise InputError(f"coarse must be {REFUSE!r} or {WEAKEN!r}, got {shown(self.coarse)}")
        for field in dataclasses.fields(self)[:-1]:
            value = getattr(self, field.name)
            if not isinstance(value, RULES.get(field.name, ())):
                positive(field.name, value, zero_allowed=field.name in _MAY_BE_ZERO)
            if field.name in _QUANTITIES:
                in_unit(field.name, value, _QUANTITIES[field.name])
        between("strength_spread", self.strength_spread, 0.0, MOST_SPREAD)
        if not isinstance(self.normal_stiffness, BondRule):
            check_energy(self)

    @classmethod
    def from_elastic(
        cls,
        *,
        young: float,
        poisson: float,
        density: float,
        tensile_strength: float,
        fracture_energy: float,
        friction_angle: float,
        cohesion: float,
        damping_ratio: float = 0.05,
        strength_spread: float = 0.0,
        strength_volume: float = 0.0,
        coarse: str = REFUSE,
    ) -> Material:
        """Make a material from measured values; shorter bonds are stiffer.

        Young's modulus and Poisson's ratio of a block then do not depend on the size of its
        elements: a bond has the stiffness modulus / distance per area (``bond_moduli``).
        Contact spheres are as stiff as the bond that they replace
        (``materials.bond_rules.FaceStiffness``).

        Parameters
        ----------
        young : float
            Young's modulus of a block [Pa].
        poisson : float
            Poisson's ratio of a block, from -0.2 to 0.45 [-].
        density : float
            Density [kg/m^3].
        tensile_strength : float
            Tensile strength of a bond [Pa].
        fracture_energy : float
            Fracture energy of mode I of a bond [J/m^2].
        friction_angle : float
            Friction angle of bonds and of contacts, from 0 to 89.9 [degrees].
        cohesion : float
            Cohesion of a bond [Pa].
        damping_ratio : float, default 0.05
            Share of the critical damping, of bonds between two bodies and of contacts; 0 for none.
        strength_spread : float, default 0.0
            Relative standard deviation of the strength from bond to bond, see ``Material``.
        strength_volume : float, default 0.0
            Volume of rock that has this strength in the mean [m^3], likewise.
        coarse : {"refuse", "weaken"}, default "refuse"
            What a scene does with elements so large that a bond at its tensile strength holds more
            than the fracture energy: refuse them, with the size that would do, or lower the
            strength of all bonds until cracks keep their energy (Bazant and Oh), and say so.

        Raises
        ------
        InputError
            A value is out of its range; the scene checks the fracture energy.

        References
        ----------
        Bazant and Oh, Mater. Struct. 16 (1983) 155.

        Examples
        --------
        >>> rock = Material.from_elastic(
        ...     young=30e9, poisson=0.2, density=2400.0, tensile_strength=5e6,
        ...     fracture_energy=100.0, friction_angle=35.0, cohesion=10e6,
        ... )
        >>> round(rock.friction, 3)
        0.7
        """
        normal, shear = bond_moduli(young, poisson)
        angle = between("friction_angle", friction_angle, 0.0, _STEEPEST)
        in_unit("young", young, MODULUS)
        in_unit("friction_angle", angle, ANGLE)
        ratio = positive("damping_ratio", damping_ratio, zero_allowed=True)
        return cls(
            density=density,
            normal_stiffness=ModulusOverDistance(normal),
            shear_stiffness=ModulusOverDistance(shear),
            normal_damping=ShareOfCritical(ratio, normal) if ratio else 0.0,
            shear_damping=ShareOfCritical(ratio, shear) if ratio else 0.0,
            tensile_strength=tensile_strength,
            cohesion=cohesion,
            friction=math.tan(math.radians(angle)),
            fracture_energy=fracture_energy,
            contact_stiffness=FaceStiffness(normal),
            contact_damping=ContactShareOfCritical(ratio, normal) if ratio else 0.0,
            strength_spread=strength_spread,
            strength_volume=strength_volume,
            coarse=coarse,
        )

    @property
    def has_bond_damping(self) -> bool:
        """Whether bonds have dashpots."""
        constants = self.normal_damping, self.shear_damping
        return any(isinstance(value, Rule) or value > 0.0 for value in constants)

    @property
    def onset_opening(self) -> float:
        """Opening at which softening begins [m] (Konno et al., Fig 2: u_E)."""
        return self.tensile_strength / float(self.normal_stiffness)

    @property
    def failure_opening(self) -> float:
        """Opening at which the traction has fallen to zero [m], from the area under the curve."""
        return 2.0 * self.fracture_energy / self.tensile_strength

    @property
    def softening_slope(self) -> float:
        """Fall of the traction with the opening beyond the onset, a positive number [Pa/m]."""
        return self.tensile_strength / (self.failure_opening - self.onset_opening)


def check_energy(material: Material, where: str = "", remedy: str = "") -> None:
    """Raise InputError where a bond would fail before it reaches its strength."""
    if material.failure_opening <= material.onset_opening:
        least = material.tensile_strength**2 / (2.0 * float(material.normal_stiffness))
        got, bound = told_apart(material.fracture_energy, least, 6)
        raise InputError(
            f"fracture_energy must be larger than tensile_strength^2 / (2 normal_stiffness) = "
            f"{bound} J/m2{where}, or the bond would fail before it reaches its strength, got {got}"
            f"{remedy}"
        )


def kept_energy(material: Material, stiffness: float) -> Material:
    """A material whose bonds, of a least normal stiffness [Pa/m], keep its fracture energy."""
    strength = math.sqrt(2.0 * material.fracture_energy * stiffness / SPARE)
    if material.coarse == REFUSE or material.tensile_strength <= strength:
        return material
    return replace(material, tensile_strength=strength)


def unchecked(material: Material, **values: Any) -> Material:
    """A copy of a material with other values, without a check."""
    unchecked_material = object.__new__(Material)
    unchecked_material.__dict__.update(vars(material), **values)
    return unchecked_material


def harmless(material: Material) -> Material:
    """Material whose bonds no load breaks or shears, without dashpots of bonds and friction."""
    return replace(
        material,
        tensile_strength=_BEYOND * material.tensile_strength,
        cohesion=_BEYOND * material.tensile_strength,
        fracture_energy=_BEYOND**2 * material.fracture_energy,
        normal_damping=0.0,
        shear_damping=0.0,
        friction=0.0,
    )


#: Concrete of Konno et al., Table 1; the adhesive stress is both tensile strength and cohesion.
CONCRETE = Material(
    density=2390.0,
    normal_stiffness=450e9,
    shear_stiffness=90e9,
    normal_damping=22.6e6,
    shear_damping=10.1e6,
    tensile_strength=6.66e6,
    cohesion=6.66e6,
    friction=0.58,
    fracture_energy=99.67,
    contact_stiffness=1.5e9,
    contact_damping=3.08e6,
)
