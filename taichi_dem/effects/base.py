"""What an effect is, and the null objects that stand where a scene lists none.

A user's effect holds numbers on the host. In an engine stands a bound copy of it, which has its
fields and kernels, and into which every scene that the engine runs loads its numbers. Its ``role``
says where ``step/advance.py`` asks for it, and which members it must have (``effects.roles``):
tension, shear and dashpot are laws of the contact units of bonds, contact and friction those of
contact spheres, loads push bodies, supports hold them. Roles ``load`` and ``support`` take any
number of effects, the others at most one.
"""

import copy

import numpy as np
import taichi as ti
from taichi.lang import impl

from taichi_dem.kit.allocation import assign
from taichi_dem.kit.display import by_arguments
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.types import real, vec3

MANY = ("load", "support")
#: Roles that take one effect, in the order in which effects are listed, bound and reported.
SINGLE = ("tension", "shear", "dashpot", "friction", "contact")
ROLES = (*SINGLE, *MANY)
#: Times its strength that no bond reaches; a power of two, so that no digit changes.
HARMLESS = 2.0**40


class Effect:
    """Base of all effects.

    role: where the step asks for it. name: the word used in reports and on the command line.
    Kernels of a bound effect read its numbers in the field ``self.law``, constants of the scene in
    ``self.tables`` (engine.tables.Tables), and what ``declare`` has declared.
    """

    role = ""
    name = ""
    #: Whether a friction law keeps a spring for each sphere pair (``roles.FrictionMemory``).
    remembers = False

    def __repr__(self):
        return by_arguments(self)

    def silent(self):
        """A copy that is compiled like this effect and never acts.

        All bits, reports and findings are those of a scene that does not list it, which would be
        compiled anew. Raises InputError for an effect that cannot be silent.
        """
        if type(self).harmless is Effect.harmless:
            raise InputError(f"effect {self.name} cannot be silent: leave it out of the scene")
        made = copy.copy(self)
        made.name, made.is_silent = "", True
        return made

    def harmless(self, material):
        """The material with which the effect never acts, as ``silent`` needs it."""
        return material

    def numbers(self, material) -> tuple:
        """Numbers that kernels read as ``self.law[0]`` and on: to change them compiles nothing."""
        return ()

    def declare(self, capacity):
        """Declare further fields, with the capacity of an engine; no field may be used here."""

    def declare_columns(self, store):
        """Declare what it keeps of a pair of bodies, or of two spheres, in a ``PairStore``.

        ``store.column`` and ``store.sphere_column`` give fields. Asked in scenes with contact.
        """

    def load(self, model):
        """Fill the declared fields for a scene; they are zero before. Raises InputError."""

    def state(self):
        """Fields that change in a run, by name; a checkpoint holds them."""
        return {}

    def travel(self):
        """How far it may carry bodies along x, y and z [m]: lowest and highest, two rows.

        Asked of loads and supports, whether parts of a mesh may meet: without bounds unless an
        effect knows better.
        """
        return (-np.inf,) * 3, (np.inf,) * 3

    def stand_for(self, given):
        """Let the attributes of this bound effect be those of a scene's; None changes nothing."""
        if given is not None:
            self.__dict__["_given"] = vars(given)

    def load_scene(self, model):
        """Load the numbers of the effect that this bound one stands for."""
        if self._given.get("is_silent"):
            model = copy.copy(model)
            model.material = self.harmless(model.material)
        if self._count:
            assign(self.law, np.array(self.numbers(model.material), dtype=np.float64))
        self.load(model)

    def accepts(self, given) -> bool:
        """Whether kernels that were compiled for this one serve for a scene's effect ``given``.

        They do unless they have read one of its values where they should have read a field.
        """
        return given is None or all(
            _same(vars(given).get(name), value) for name, value in self._frozen.items()
        )

    def __getattr__(self, name):
        given = self.__dict__.get("_given", {})
        if name not in given:
            raise AttributeError(f"{type(self).__name__} has no {name}")
        if impl.inside_kernel():
            # The compiler takes the value as a constant: kernels serve no other value from now on.
            self._frozen[name] = copy.copy(given[name])
        return given[name]


def bound(effect, tables):
    """A copy of an effect with its own fields, which belongs to an engine and serves its scenes."""
    made = object.__new__(type(effect))
    made.__dict__.update(_given=vars(effect), _frozen={}, tables=tables)
    made._count = len(effect.numbers(_AnyMaterial()))
    if made._count:
        made.law = ti.field(real, shape=made._count)
    made.declare(tables.capacity)
    return made


class _AnyMaterial:
    """Stands for a material where only the number of its constants is asked for."""

    def __getattr__(self, name):
        return 1.0


def _same(first, second):
    try:
        return bool(np.array_equal(first, second))
    except (TypeError, ValueError):
        return first is second


def along(direction):
    """Travel without end in a direction, for ``Effect.travel``."""
    low = tuple(-np.inf if x < 0.0 else 0.0 for x in direction)
    return low, tuple(np.inf if x > 0.0 else 0.0 for x in direction)


@ti.data_oriented
class ElasticTension(Effect):
    """No softening: a unit stays elastic in tension and compression and never fails."""

    role = "tension"

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
        return 0.5 * self.tables.bond_stiffness[b][0] * opening * opening

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

    @ti.func
    def traction(self, stiffness, u, sliding, pressure):
        """Linear shear traction [Pa] (eq. 1) and no energy slipped away."""
        return stiffness * sliding, 0.0

    @ti.func
    def stored(self, b, u, sliding):
        """Elastic energy per area [J/m^2]."""
        return 0.5 * self.tables.bond_stiffness[b][1] * sliding.dot(sliding)


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

    @ti.func
    def limit(self, force_normal):
        """No friction at any normal force."""
        return 0.0

    @ti.func
    def force(self, damping, force_normal, slide):
        """No force at any sliding velocity."""
        return vec3(0.0, 0.0, 0.0)


ABSENT = {
    "tension": ElasticTension,
    "shear": ElasticShear,
    "dashpot": NoDashpot,
    "friction": NoFriction,
    "contact": None,
}

__all__ = ["ABSENT", "HARMLESS", "MANY", "ROLES", "SINGLE", "Effect", "along", "bound"]
