"""Material of the bodies and of the bonds between them, in SI units."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

from taichi_dem.kit.errors import InputError
from taichi_dem.kit.validation import LARGEST, SMALLEST, finite, plain_fields, shown

_MAY_BE_ZERO = frozenset(
    {"normal_damping", "shear_damping", "cohesion", "friction", "contact_damping"}
)


@dataclass(frozen=True)
class Material:
    """Constants of one homogeneous material (Konno et al., sections 2.1 and 2.2, Table 1).

    density [kg/m3]; normal_stiffness, shear_stiffness [Pa/m] of a bond per area;
    normal_damping, shear_damping [Pa s/m] of a bond per area; tensile_strength, cohesion [Pa];
    friction [-]; fracture_energy [J/m2]; contact_stiffness [N/m] and contact_damping [N s/m] of
    one sphere contact after fracture.

    Raises InputError for a value that is no finite number, is negative, is zero where it must be
    positive, or where the bond would fail before it reaches its strength.
    """

    density: float
    normal_stiffness: float
    shear_stiffness: float
    normal_damping: float
    shear_damping: float
    tensile_strength: float
    cohesion: float
    friction: float
    fracture_energy: float
    contact_stiffness: float
    contact_damping: float

    def __post_init__(self):
        plain_fields(self)
        for field in dataclasses.fields(self):
            _check_number(field.name, getattr(self, field.name))
        if self.failure_opening <= self.onset_opening:
            least = self.tensile_strength**2 / (2.0 * self.normal_stiffness)
            raise InputError(
                f"fracture_energy must be larger than tensile_strength^2 / (2 normal_stiffness) = "
                f"{least:.6g} J/m2, or the bond would fail before it reaches its strength, "
                f"got {self.fracture_energy}"
            )

    @property
    def onset_opening(self) -> float:
        """Opening at which softening begins [m] (Konno et al., Fig 2: u_E)."""
        return self.tensile_strength / self.normal_stiffness

    @property
    def failure_opening(self) -> float:
        """Opening at which the traction has fallen to zero [m], from the area under the curve."""
        return 2.0 * self.fracture_energy / self.tensile_strength

    @property
    def softening_slope(self) -> float:
        """Fall of the traction with the opening beyond the onset, a positive number [Pa/m]."""
        return self.tensile_strength / (self.failure_opening - self.onset_opening)


def _check_number(name, value):
    """Raise InputError unless ``value`` is a finite number in the range of the field ``name``."""
    zero_allowed = name in _MAY_BE_ZERO
    inside = finite(value) and (SMALLEST <= value <= LARGEST or (value == 0.0 and zero_allowed))
    if not inside:
        allowed = "at least 0" if zero_allowed else "positive"
        raise InputError(
            f"{name} must be a finite number, {allowed} and, where it is not 0, from {SMALLEST:g} "
            f"to {LARGEST:g}, got {shown(value)}"
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
