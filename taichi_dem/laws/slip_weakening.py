"""Coulomb slip of bonds whose cohesion falls with the slip (linear slip weakening)."""

import taichi as ti

from taichi_dem.kit.products import dot, norm
from taichi_dem.kit.types import vec2
from taichi_dem.kit.validation import positive
from taichi_dem.laws.base import check_sliding_energy
from taichi_dem.laws.bond import ShearSlip
from taichi_dem.materials import Material
from taichi_dem.physics.fracture import coulomb_limit, weakening_slip
from taichi_dem.state.capacity import Capacity


@ti.data_oriented
class SlipWeakening(ShearSlip):
    """Coulomb slip of bonds whose cohesion falls linearly with the accumulated slip, to zero.

    Takes the place of ``ShearSlip``, by which cohesion does not degrade.

    Parameters
    ----------
    fracture_energy : float
        Fracture energy G_II of mode II [J/m^2], the area under the cohesion over the slip. A scene
        refuses one of c^2 / (2 shear stiffness) or less, with which a unit would fail at once.

    Raises
    ------
    InputError
        The energy is not positive.

    Notes
    -----
    The cohesion c of the material is gone at the critical slip d_c = 2 G_II / c; the friction of
    the bond remains. A unit without cohesion that is not pressed transmits nothing and releases the
    face, as one that failed in tension does; pressed faces slide with friction until they open.
    Slip in both directions accumulates; the strength in tension does not fall with it. The effect
    is not in the paper.

    References
    ----------
    Ida, J. Geophys. Res. 77 (1972) 3796; Andrews, J. Geophys. Res. 81 (1976) 3575.

    Examples
    --------
    >>> SlipWeakening(fracture_energy=500.0).fracture_energy
    500.0
    """

    name = "slip_weakening"
    releases = True
    # It begins where ShearSlip does, as it says itself of its other traction.
    activation = ShearSlip.activation
    begins = ShearSlip.begins
    may_be_silent = True

    def __init__(self, fracture_energy: float):
        self.fracture_energy = positive("fracture_energy", fracture_energy)

    def check_material(self, material: Material) -> None:
        """Raise InputError for a material without cohesion, or too stiff for the energy."""
        check_sliding_energy(self, "fracture_energy", material)

    def numbers(self, material: Material) -> tuple[float, ...]:
        """Cohesion [Pa], friction coefficient, critical slip [m], loss of cohesion [Pa/m]."""
        critical = 2.0 * self.fracture_energy / material.cohesion
        return material.cohesion, material.friction, critical, material.cohesion / critical

    def declare(self, capacity: Capacity) -> None:
        """Residual slip of units in the face frame, two components, and accumulated slip [m]."""
        self.unit = ti.Vector.field(3, ti.f64, shape=capacity.units)

    @ti.func
    def traction(self, m, stiffness, u, sliding, pressure):
        """Shear traction [Pa] and the energy per area slipped away now [J/m^2]."""
        unit = self.unit[u]
        cohesion = self.law[m, 0] - self.law[m, 3] * unit[2]
        limit = coulomb_limit(ti.max(0.0, cohesion), self.law[m, 1], pressure)
        elastic = sliding - vec2(unit[0], unit[1])
        spent = 0.0
        if stiffness * stiffness * dot(elastic, elastic) > limit * limit:
            reach = norm(elastic)
            rubbing = self.law[m, 1] * pressure
            length = weakening_slip(stiffness, self.law[m, 3], cohesion, rubbing, reach)
            # Mean of the tractions before and after, so that stored plus spent is exact.
            spent = stiffness * (reach - 0.5 * length) * length
            slip = elastic * (length / reach)
            unit[0], unit[1], unit[2] = unit[0] + slip[0], unit[1] + slip[1], unit[2] + length
            self.unit[u] = unit
            elastic -= slip
        return stiffness * elastic, spent

    @ti.func
    def failed(self, m, u, pressure):
        """1 once the unit has neither cohesion nor pressure [Pa], else 0."""
        return ti.cast(self.unit[u][2] >= self.law[m, 2] and pressure <= 0.0, ti.i32)

    @ti.func
    def is_active(self, b, u):
        """1 for a unit that has slipped, else 0."""
        return ti.cast(self.unit[u][2] > 0.0, ti.i32)

    @ti.func
    def residual_slip(self, u):
        """Residual slip of a unit in the face frame [m]."""
        return vec2(self.unit[u][0], self.unit[u][1])
