"""What an effect is, and the null objects that stand where a scene lists none.

An effect owns its parameters (in fields, so that sweeping them compiles nothing anew) and its
state. Its ``role`` says where ``step/advance.py`` asks for it:

tension   ``traction(stiffness, u, opening)`` [Pa], ``failed(u)``, ``stored(b, u, opening)`` and
          ``spent(b, u)`` [J/m^2], ``damage(b, u)``
shear     ``traction(stiffness, u, sliding, pressure)`` -> (traction [Pa], energy slipped away
          [J/m^2]), ``stored(b, u, sliding)``
dashpot   ``traction(velocity)`` [Pa] of a contact unit
load      ``acts_on(i)``, ``wrench(i, t, rotation)`` -> (force [N], torque about the centre [N m])
support   ``acts_on(i)``, ``held(i, t, rotation, velocity, angular_momentum)`` -> both, corrected
contact   sphere contacts between broken faces: ``normal``, ``elastic``, ``damping``, ``stored``
friction  ``force(damping, force_normal, slide)`` [N] on the second sphere, ``bound(force_normal)``
          [N]; with ``remembers = True``, for springs across the contact of sphere pair k, whose
          vectors are in the first body's frame: ``follow(k, normal, way)``, ``slip(k, bound, way)``
          -> energy [J], ``spring(k)`` [N], ``stored(k)`` [J], ``part(k)`` -> energy [J]

b is a bond, u one of its three contact units (3 b, 3 b + 1, 3 b + 2), i a body. Roles ``load`` and
``support`` take any number of effects, the others at most one.
"""

import numpy as np
import taichi as ti

from taichi_dem.kit.allocation import defer_fill
from taichi_dem.kit.display import by_arguments
from taichi_dem.kit.types import real, vec3

MANY = ("load", "support")
ROLES = ("tension", "shear", "dashpot", "contact", "friction", *MANY)


class Effect:
    """Base of all effects.

    role: where the step asks for it. name: the word used in reports and on the command line.
    """

    role = ""
    name = ""

    def __repr__(self):
        return by_arguments(self)

    def bind(self, model):
        """Check the effect against the model and allocate its parameters and state there."""

    def declare(self, store):
        """Declare what it keeps of a pair of bodies, or of two spheres, in a ``PairStore``.

        Called where the scene has contact: ``store.column`` and ``store.sphere_column`` give
        fields.
        """

    def state(self):
        """Fields that change in a run, by name; a checkpoint holds them."""
        return {}

    def travel(self):
        """How far it may carry bodies along x, y and z [m]: lowest and highest, two rows.

        Asked of loads and supports, whether parts of a mesh may meet: without bounds unless an
        effect knows better.
        """
        return (-np.inf,) * 3, (np.inf,) * 3


def along(direction):
    """Travel without end in a direction, for ``Effect.travel``."""
    low = tuple(-np.inf if x < 0.0 else 0.0 for x in direction)
    return low, tuple(np.inf if x > 0.0 else 0.0 for x in direction)


def parameters(**values):
    """Checked parameters in one field, in the order given; floats that kernels read."""
    field = ti.field(real, shape=len(values))
    defer_fill(field.from_numpy, np.array(list(values.values()), dtype=np.float64))
    return field


@ti.data_oriented
class ElasticTension(Effect):
    """No softening: a unit stays elastic in tension and compression and never fails."""

    role = "tension"

    def bind(self, model):
        """Take the bonds' stiffness from the model."""
        self.model = model

    @ti.func
    def traction(self, stiffness, u, opening):
        """Linear traction [Pa] at a normal opening [m]."""
        return stiffness * opening

    @ti.func
    def failed(self, u):
        """An elastic unit never fails."""
        return 0

    @ti.func
    def stored(self, b, u, opening):
        """Elastic energy per area [J/m^2]."""
        return 0.5 * self.model.bond_stiffness[b][0] * opening * opening

    @ti.func
    def spent(self, b, u):
        """Nothing is spent by softening."""
        return 0.0

    @ti.func
    def damage(self, b, u):
        """An elastic unit is never damaged."""
        return 0.0


@ti.data_oriented
class ElasticShear(Effect):
    """No slip: a unit stays elastic in shear."""

    role = "shear"

    def bind(self, model):
        """Take the bonds' stiffness from the model."""
        self.model = model

    @ti.func
    def traction(self, stiffness, u, sliding, pressure):
        """Linear shear traction [Pa] (eq. 1) and no energy slipped away."""
        return stiffness * sliding, 0.0

    @ti.func
    def stored(self, b, u, sliding):
        """Elastic energy per area [J/m^2]."""
        return 0.5 * self.model.bond_stiffness[b][1] * sliding.dot(sliding)


@ti.data_oriented
class NoDashpot(Effect):
    """Bonds without damping."""

    role = "dashpot"

    @ti.func
    def traction(self, velocity):
        """No traction at any velocity."""
        return vec3(0.0, 0.0, 0.0)


@ti.data_oriented
class NoFriction(Effect):
    """Frictionless sphere contacts."""

    role = "friction"
    remembers = False

    @ti.func
    def force(self, damping, force_normal, slide):
        """No force at any sliding velocity."""
        return vec3(0.0, 0.0, 0.0)


ABSENT = {
    "tension": ElasticTension,
    "shear": ElasticShear,
    "dashpot": NoDashpot,
    "friction": NoFriction,
}

__all__ = ["ABSENT", "MANY", "ROLES", "Effect", "along", "parameters"]
