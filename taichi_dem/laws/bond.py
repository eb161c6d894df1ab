"""The paper's law of bonds (Konno et al., section 2.1, Table 1), and linear slip weakening."""

import numpy as np
import taichi as ti

from taichi_dem.kit.allocation import assign
from taichi_dem.kit.products import dot, norm, squared
from taichi_dem.kit.types import real, vec2, vec3
from taichi_dem.kit.validation import positive
from taichi_dem.laws.base import NEAR, check_sliding_energy
from taichi_dem.laws.contracts import BondLaw, Dashpot, ShearLaw, TensionLaw
from taichi_dem.materials import Material
from taichi_dem.physics.fracture import (
    coulomb_limit,
    envelope_traction,
    slip_beyond,
    softening_energy,
    weakening_slip,
)
from taichi_dem.state.model import Model
from taichi_dem.state.tables import Capacity

#: Bits of the parts of a ``Separable`` law.
NORMAL, TANGENTIAL = 1, 2


@ti.data_oriented
class Softening(TensionLaw):
    """Beyond the strength a unit softens along a straight line to zero (Konno et al., Fig. 2).

    Notes
    -----
    Unloading goes to the origin; compression stays stiff. One failed unit releases the face.
    """

    may_be_silent = True

    def numbers(self, material: Material) -> tuple[float, ...]:
        """Tensile strength [Pa] and opening at failure [m]."""
        return material.tensile_strength, material.failure_opening

    def declare(self, capacity: Capacity) -> None:
        """Elastic limit [m] and secant stiffness [Pa/m] of every contact unit."""
        self.unit = ti.Vector.field(2, ti.f64, shape=capacity.units)

    def upload(self, model: Model) -> None:
        """Set every unit intact."""
        stiffness = np.repeat(model.bond_stiffness[:, 0], 3)
        strength = model.of_bonds(lambda material: material.tensile_strength)
        onset = np.repeat(np.broadcast_to(strength, model.bond_count), 3) / stiffness
        assign(self.unit, np.stack([onset, stiffness], axis=1))

    @ti.func
    def begins(self, m, stiffness, opening):
        """1 where an intact unit comes near its strength at an opening [m], else 0."""
        return ti.cast(stiffness * opening > NEAR * self.law[m, 0], ti.i32)

    @ti.func
    def traction(self, m, u, stiffness, opening):
        """Traction [Pa] at a normal opening [m]; raises the elastic limit beyond it."""
        traction = stiffness * opening
        if opening > 0.0:
            unit = self.unit[u]
            if opening > unit[0]:
                onset = self.law[m, 0] / stiffness
                softened = envelope_traction(self.law[m, 0], onset, self.law[m, 1], opening)
                unit = vec2(opening, softened / opening)
                self.unit[u] = unit
            traction = unit[1] * opening
        return traction

    @ti.func
    def failed(self, m, u, traction):
        """1 once the unit has been opened to the failure opening, else 0."""
        return ti.cast(self.unit[u][0] >= self.law[m, 1], ti.i32)

    @ti.func
    def acted(self, m, u, stiffness):
        """1 for a unit that has been opened beyond its elastic limit, else 0."""
        return ti.cast(self.unit[u][0] > self.law[m, 0] / stiffness, ti.i32)

    @ti.func
    def stored(self, m, u, stiffness, opening):
        """Elastic energy per area [J/m^2] at the present stiffness."""
        present = stiffness
        if opening > 0.0:
            present = self.unit[u][1]
        return 0.5 * present * opening * opening

    @ti.func
    def spent(self, m, u, stiffness):
        """Energy per area [J/m^2] that softening has spent in this unit."""
        strength = self.law[m, 0]
        return softening_energy(strength, strength / stiffness, self.law[m, 1], self.unit[u][0])

    @ti.func
    def damage(self, m, u, stiffness):
        """Share of the fracture energy that is spent, 0 intact to 1 failed."""
        return self.spent(m, u, stiffness) / (0.5 * self.law[m, 0] * self.law[m, 1])

    @ti.func
    def reach(self, m, u):
        """Largest opening over that at failure."""
        return self.unit[u][0] / self.law[m, 1]


@ti.data_oriented
class ShearSlip(ShearLaw):
    """Shear traction is bounded by cohesion + friction * pressure (Konno et al., eq. 1 and 2).

    Notes
    -----
    The pressure is the spring's part alone and lowers the limit in tension, never below zero.
    Cohesion does not degrade, and slip alone never releases a face.
    """

    may_be_silent = True

    def numbers(self, material: Material) -> tuple[float, ...]:
        """Cohesion [Pa] and friction coefficient."""
        return material.cohesion, material.friction

    def declare(self, capacity: Capacity) -> None:
        """Residual slip of every contact unit in the face frame [m]."""
        self.slip = ti.Vector.field(2, ti.f64, shape=capacity.units)

    @ti.func
    def begins(self, m, stiffness, sliding, pressure):
        """1 where a unit that never slipped comes near its limit at a pressure [Pa], else 0."""
        limit = NEAR * coulomb_limit(self.law[m, 0], self.law[m, 1], pressure)
        return ti.cast(stiffness * stiffness * squared(sliding) > limit * limit, ti.i32)

    @ti.func
    def traction(self, m, u, stiffness, sliding, pressure):
        """Shear traction [Pa] and the energy per area slipped away now [J/m^2]."""
        limit = coulomb_limit(self.law[m, 0], self.law[m, 1], pressure)
        elastic = sliding - self.slip[u]
        spent = 0.0
        # Squares first: almost every unit stays elastic and needs no root.
        if stiffness * stiffness * dot(elastic, elastic) > limit * limit:
            slip = slip_beyond(stiffness, limit, elastic)
            # Mean of the tractions before and after, so that stored plus spent is exact.
            spent = dot(stiffness * (elastic - 0.5 * slip), slip)
            self.slip[u] = self.slip[u] + slip
            elastic -= slip
        return stiffness * elastic, spent

    @ti.func
    def acted(self, m, u, stiffness):
        """1 for a unit that has slipped, else 0."""
        return ti.cast(squared(self.slip[u]) > 0.0, ti.i32)

    @ti.func
    def residual_slip(self, m, u):
        """Residual slip of a unit in the face frame [m]."""
        return self.slip[u]


@ti.data_oriented
class BondDamping(Dashpot):
    """Normal and tangential dashpots of bonds, at full strength until the face is released."""

    may_be_silent = True

    def declare(self, capacity: Capacity) -> None:
        """Normal and tangential coefficient of every bond per area [Pa s/m]."""
        self.coefficient = ti.Vector.field(2, real, shape=capacity.bonds)

    def upload(self, model: Model) -> None:
        """Take the coefficients of the material."""
        assign(self.coefficient, model.bond_damping)

    @ti.func
    def traction(self, m, b, velocity):
        """Traction [Pa] of bond b at a relative velocity in the face frame [m/s]."""
        c = self.coefficient[b]
        return vec3(c[0] * velocity[0], c[1] * velocity[1], c[1] * velocity[2])


@ti.data_oriented
class Separable(BondLaw):
    """A normal and a tangential law that share only the pressure, as in the paper."""

    def __init__(self, tension: TensionLaw, shear: ShearLaw):
        self.tension, self.shear = tension, shear
        self.is_null = tension.is_null and shear.is_null

    @ti.func
    def begins(self, m, stiffness, jump):
        """Bits of the laws near whose limit an intact unit comes at a jump [m], else 0."""
        bits = NORMAL * self.tension.begins(m, stiffness[0], jump[0])
        pressure, sliding = -(stiffness[0] * jump[0]), vec2(jump[1], jump[2])
        bits |= TANGENTIAL * self.shear.begins(m, stiffness[1], sliding, pressure)
        return bits

    @ti.func
    def traction(self, m, u, stiffness, jump):
        """Traction [Pa] at a jump [m], and energy per area slipped away now [J/m^2]."""
        pull = self.tension.traction(m, u, stiffness[0], jump[0])
        sliding = vec2(jump[1], jump[2])
        shear, slipped = self.shear.traction(m, u, stiffness[1], sliding, -pull)
        return vec3(pull, shear[0], shear[1]), slipped

    @ti.func
    def failed(self, m, u, traction):
        """1 once the unit transmits nothing any more, else 0."""
        failed = self.tension.failed(m, u, traction[0])
        return failed | self.shear.failed(m, u, -traction[0])

    @ti.func
    def stored(self, m, u, stiffness, jump):
        """Elastic energy per area of opening and of sliding [J/m^2]."""
        normal = self.tension.stored(m, u, stiffness[0], jump[0])
        return normal, self.shear.stored(m, u, stiffness[1], vec2(jump[1], jump[2]))

    @ti.func
    def spent(self, m, u, stiffness):
        """Energy per area [J/m^2] that damage has spent in the unit."""
        return self.tension.spent(m, u, stiffness[0])

    @ti.func
    def damage(self, m, u, stiffness):
        """0 intact to 1 failed."""
        return self.tension.damage(m, u, stiffness[0])

    @ti.func
    def reach(self, m, u):
        """That of the law of tension."""
        return self.tension.reach(m, u)

    @ti.func
    def acted(self, m, u, stiffness):
        """Bits of the laws that have changed the unit."""
        bits = NORMAL * self.tension.acted(m, u, stiffness[0])
        return bits | TANGENTIAL * self.shear.acted(m, u, stiffness[1])

    @ti.func
    def residual_slip(self, m, u):
        """Slip that stays when the traction is gone, in the face frame [m]."""
        return self.shear.residual_slip(m, u)


@ti.data_oriented
class SlipWeakening(ShearSlip):
    """Coulomb slip of bonds whose cohesion falls linearly with the accumulated slip, to zero.

    Replaces ``ShearSlip``, whose cohesion does not degrade.

    Parameters
    ----------
    fracture_energy : float
        Fracture energy G_II of mode II [J/m^2], the area under the cohesion over the slip. A scene
        refuses one of c^2 / (2 shear stiffness) or less, with which a unit would fail at once.

    Notes
    -----
    The cohesion c of the material is gone at the critical slip d_c = 2 G_II / c; the friction of
    the bond remains. A unit without cohesion that is not pressed transmits nothing and releases the
    face, as one that failed in tension does; pressed faces slide with friction until they open.
    Slip in both directions accumulates; the tensile strength stays. This is not in the paper.

    References
    ----------
    Ida, J. Geophys. Res. 77 (1972) 3796; Andrews, J. Geophys. Res. 81 (1976) 3575.
    """

    # It begins where ShearSlip does, as it says itself of its other traction.
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
    def traction(self, m, u, stiffness, sliding, pressure):
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
    def acted(self, m, u, stiffness):
        """1 for a unit that has slipped, else 0."""
        return ti.cast(self.unit[u][2] > 0.0, ti.i32)

    @ti.func
    def residual_slip(self, m, u):
        """Residual slip of a unit in the face frame [m]."""
        return vec2(self.unit[u][0], self.unit[u][1])
