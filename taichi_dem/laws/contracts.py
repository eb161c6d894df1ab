"""Contracts: what an effect gives, by the class that it derives from.

An abstract method has to be given; any other returns what an effect without the ability would.
Methods without types are ``ti.func``. Arguments: pair of materials, entry, numbers.
"""

from abc import abstractmethod

import numpy as np
import taichi as ti

from taichi_dem.kit.products import dot
from taichi_dem.kit.types import vec2, vec3
from taichi_dem.laws.base import Effect, Reported
from taichi_dem.materials import Material

#: Lowest and highest displacement along x, y and z [m].
Travel = tuple[tuple[float, ...], tuple[float, ...]]


@ti.data_oriented
class UnitLaw(Effect):
    """What laws of the contact units of bonds share.

    m: pair of materials, with the numbers ``self.law[m, 0]`` and on. u: unit, one of the three of a
    bond b: 3 b, 3 b + 1, 3 b + 2. stiffness: normal and shear [Pa/m], or one of them.
    """

    @ti.func
    def begins(self, m, stiffness, jump):
        """Nonzero where a unit that it never changed comes near its limit at a jump [m].

        Elsewhere the traction must be stiffness times jump to the bit, and nothing else may happen.
        Only effects="auto" asks for it, and refuses a law that has none of its own.
        """
        return 0

    @ti.func
    def failed(self, m, u, traction):
        """1 once the unit transmits nothing any more at a traction [Pa], else 0."""
        return 0

    @ti.func
    def spent(self, m, u, stiffness):
        """Energy per area [J/m^2] that damage has spent in the unit."""
        return 0.0

    @ti.func
    def damage(self, m, u, stiffness):
        """0 intact to 1 failed."""
        return 0.0

    @ti.func
    def reach(self, m, u):
        """Jump at which the unit failed over the one at which it had to; below 1 while it holds."""
        return 0.0

    @ti.func
    def residual_slip(self, m, u):
        """Sliding (2,) that stays when the traction is gone, in the face frame [m]."""
        return vec2(0.0)

    @abstractmethod
    def acted(self, m, u, stiffness):
        """Nonzero for a unit that it has changed."""


class BondLaw(UnitLaw):
    """Law of the contact units of bonds, opening and sliding together.

    jump (3,): normal opening, and both components of the sliding in the face frame [m]. A law of
    two parts says by bits, 1 and 2, which of them ``begins`` and has ``acted``.
    """

    role = "bond"
    reported = Reported("bonds damaged", ("softening", "release", "slip"), "damage")

    @abstractmethod
    def traction(self, m, u, stiffness, jump):
        """Traction [Pa] (3,) at a jump, and energy per area that slips away now [J/m^2]."""

    @abstractmethod
    def stored(self, m, u, stiffness, jump):
        """Elastic energy per area of opening, and of sliding [J/m^2]."""


@ti.data_oriented
class TensionLaw(UnitLaw):
    """Normal law of the contact units of bonds, for itself."""

    role = "tension"
    reported = Reported("bonds softened", ("softening", "release"), "softening")

    @abstractmethod
    def traction(self, m, u, stiffness, opening):
        """Traction [Pa] at a normal opening [m]."""

    @ti.func
    def stored(self, m, u, stiffness, opening):
        """Elastic energy per area [J/m^2]."""
        return 0.5 * stiffness * opening * opening


@ti.data_oriented
class ShearLaw(UnitLaw):
    """Tangential law of the contact units of bonds, for itself.

    sliding (2,): in the face frame [m]. pressure: of the normal spring [Pa], which ``failed`` gets
    in place of the traction. The energy that it takes is one of slip, not of damage.
    """

    role = "shear"
    reported = Reported("bonds slipped", ("slip",), "slip")

    @abstractmethod
    def traction(self, m, u, stiffness, sliding, pressure):
        """Traction [Pa] (2,) and energy per area that slips away now [J/m^2]."""

    @ti.func
    def begins(self, m, stiffness, sliding, pressure):
        """Nonzero near its limit at a sliding and a pressure."""
        return 0

    @ti.func
    def stored(self, m, u, stiffness, sliding):
        """Elastic energy per area [J/m^2]."""
        elastic = sliding - self.residual_slip(m, u)
        return 0.5 * stiffness * dot(elastic, elastic)


class Dashpot(Effect):
    """Damping of the contact units of bonds."""

    role = "dashpot"
    reported = Reported("bonds damped", ("bond_dashpot",))

    @abstractmethod
    def traction(self, m, b, velocity):
        """Traction [Pa] (3,) of a unit of bond b at a relative velocity in the face frame [m/s]."""


@ti.data_oriented
class ElasticTension(TensionLaw):
    """No softening: a unit stays elastic in tension and compression and never fails."""

    is_null = True

    @ti.func
    def traction(self, m, u, stiffness, opening):
        """Linear traction [Pa] at a normal opening [m]."""
        return stiffness * opening

    @ti.func
    def acted(self, m, u, stiffness):
        """It changes no unit."""
        return 0


@ti.data_oriented
class ElasticShear(ShearLaw):
    """No slip: a unit stays elastic in shear."""

    is_null = True
    acted = ElasticTension.acted

    @ti.func
    def traction(self, m, u, stiffness, sliding, pressure):
        """Linear shear traction [Pa] (eq. 1) and no energy slipped away."""
        return stiffness * sliding, 0.0


@ti.data_oriented
class NoDashpot(Dashpot):
    """Bonds without damping."""

    is_null = True

    @ti.func
    def traction(self, m, b, velocity):
        """No traction at any velocity."""
        return vec3(0.0)


@ti.data_oriented
class BodyEffect(Effect):
    """What loads, supports and ground share. i: a body."""

    @ti.func
    def acts_on(self, i):
        """Nonzero for a body on which it acts; by default every one."""
        return 1

    def stress(self, material: Material, size: float) -> float:
        """Stress [Pa] that it may cause in a block of a size [m]; NaN, the default, if unknown."""
        return np.nan

    def change_time(self) -> float:
        """Shortest time [s] within which it changes; longer steps lose its shape.

        Infinite by default.
        """
        return np.inf

    def travel(self) -> Travel:
        """Lowest and highest displacement [m] (3,) that it may cause; infinite by default.

        Used to decide whether parts of a mesh may meet.
        """
        return (-np.inf,) * 3, (np.inf,) * 3


@ti.data_oriented
class Load(BodyEffect):
    """Force on bodies."""

    role = "load"
    #: Order of the error that it leaves in the step, which reports tell; None if nobody knows.
    order: int | None = None
    reported = Reported("bodies loaded")

    @abstractmethod
    def wrench(self, i, motion):
        """Force [N] (3,) and torque about the centre [N m] (3,) on body i.

        motion: ``state.state.BodyMotion``, with position [m], rotation (3, 3), time [s]; velocity
        [m/s] and spin [rad/s] are those of half a step, motion.step [s], before. Where the load
        changes, its mean from motion.since to motion.until.
        """

    @ti.func
    def changes(self, since, until):
        """Nonzero where ``wrench`` gives means and the load changes between two times [s]."""
        return 0


class Support(BodyEffect):
    """Constraint of bodies."""

    role = "support"
    reported = Reported("bodies held")

    @abstractmethod
    def held(self, i, t, step, rotation, velocity, angular_momentum):
        """Velocity [m/s] (3,) and angular momentum [kg m^2/s] (3,) that it allows of those given.

        Means over a step [s] with its middle at a time t [s]; over a step of 0, values then.
        """


class Ground(BodyEffect):
    """Dashpots between bodies and ground at rest.

    The step solves them in the body's own update, so that they limit no step.
    """

    role = "ground"
    reported = Reported("bodies braked")

    @abstractmethod
    def resistance(self, i):
        """Force [N] and moment [N m] by which the ground resists velocity and spin, a ``Block``.

        In world axes, about the centre, positive semidefinite.
        """


#: Roles of which a ``BondLaw`` takes the place.
PARTS_OF_BOND = ("tension", "shear")
