"""Base class of effects, and what an engine does with one."""

import copy
import re
from typing import Any, ClassVar, NamedTuple

import numpy as np
import taichi as ti
from taichi.lang import impl

from taichi_dem.kit.allocation import assign
from taichi_dem.kit.display import by_arguments
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.types import real
from taichi_dem.kit.validation import shown, told_apart
from taichi_dem.materials import CONCRETE, Material
from taichi_dem.materials.body_materials import MOST, BodyMaterials
from taichi_dem.state.model import MANY, Model
from taichi_dem.state.pair_store import PairStore
from taichi_dem.state.tables import Capacity, Tables

#: Share of a limit from which on a law is evaluated: rounding is far below the rest.
NEAR = 1.0 - 1e-9


class Reported(NamedTuple):
    """What reports tell of an effect, beside what its methods say.

    events: what is counted of it, of "bonds" or "bodies". terms: those of the energy account that
    it books. since: name of its times in ``Simulation.acting_since``.
    """

    events: str = ""
    terms: tuple[str, ...] = ()
    since: str = ""


class Effect:
    """Base of all effects.

    role: its place in the step. name: the word used in reports and on the command line, by default
    that of the class. Kernels of a bound effect read its numbers in the field ``self.law``,
    constants of the scene in ``self.tables`` (``state.tables.Tables``), and the fields that
    ``declare`` has declared. Laws of bonds and contacts have a row of numbers for each pair of
    materials: they read ``self.law[m, k]``, m the pair, in a bond ``self.tables.bond_pair[b]``.
    """

    role = ""
    name = ""
    reported: ClassVar[Reported] = Reported()
    law: ti.Field
    tables: Tables
    _count: int

    #: Whether it stands for no effect, which no report lists.
    is_null = False
    #: Whether it never acts with a harmless material, as ``silent`` needs, and is such a copy.
    may_be_silent = False
    is_silent = False

    def __init_subclass__(cls, **options: Any) -> None:
        """Name a class that states no name of its own; reports list no null object."""
        super().__init_subclass__(**options)
        if "load" in vars(cls):
            raise InputError(f"{cls.__name__}.load is now called upload(model): rename the method")
        if "name" not in vars(cls):
            words = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", cls.__name__).strip("_").lower()
            cls.name = "" if cls.is_null else words

    def __repr__(self):
        return by_arguments(self)

    def silent(self) -> "Effect":
        """Return a copy that is compiled like this effect and never acts.

        All bits, reports and findings are those of a scene without it, but nothing compiles anew.
        """
        if not self.may_be_silent:
            raise InputError(f"effect {self.name} cannot be silent: leave it out of the scene")
        silent = copy.copy(self)
        vars(silent).update(name="", is_silent=True)
        return silent

    def check_material(self, material: Material) -> None:
        """Refuse a material with which the effect cannot act; a scene calls this."""

    def numbers(self, material: Material) -> tuple:
        """Numbers in SI units that kernels read; changing them compiles nothing.

        Loads, supports and ground read them as ``self.law[0]`` and on, laws of bonds and contacts
        as ``self.law[m, 0]`` and on, m a pair of materials.
        """
        return ()

    def declare(self, capacity: Capacity) -> None:
        """Declare further fields, with the capacity of an engine; no field may be used here."""

    def declare_columns(self, store: PairStore) -> None:
        """Declare data for each pair of bodies, or of spheres; called in scenes with contact."""

    def upload(self, model: Model) -> None:
        """Fill the declared fields for a scene; they are zero before."""

    def stand_for(self, given: "Effect") -> None:
        """Take the attributes of this bound effect from an effect of a scene."""
        self.__dict__["_given"] = vars(given)

    @property
    def stands_silent(self) -> bool:
        """Whether the effect that this bound one stands for is silent."""
        return bool(self._given.get("is_silent"))

    def upload_scene(self, model: Model) -> None:
        """Upload the numbers of the effect that this bound one stands for."""
        if self.stands_silent:
            model = model.harmless()
        if self._count:
            assign(self.law, _numbers_of(self, model.materials))
        self.upload(model)

    def accepts(self, given: "Effect") -> bool:
        """Whether kernels compiled for this effect are valid for an effect of a scene.

        They are valid until an attribute that kernels read, or the count of numbers, changes.
        """
        same = (np.array_equal(getattr(given, k, np.nan), v) for k, v in self._frozen.items())
        return _count_of(given) == self._count and all(same)

    def __getattr__(self, name):
        given = self.__dict__.get("_given", {})
        if name not in given:
            raise AttributeError(f"{type(self).__name__} has no {name}")
        if impl.inside_kernel():
            # The compiler takes the value as a constant: kernels serve no other value from now on.
            self._frozen[name] = copy.copy(given[name])
        return given[name]


def bound(effect: Effect, tables: Tables) -> Any:
    """A copy of an effect with its own fields, which belongs to an engine and serves its scenes."""
    copied = object.__new__(type(effect))
    copied.__dict__.update(_given=vars(effect), _frozen={}, tables=tables)
    copied._count = _count_of(effect)
    if copied._count:
        one_row = effect.role in MANY
        copied.law = ti.field(real, shape=copied._count if one_row else (MOST**2, copied._count))
    copied.declare(tables.capacity)
    return copied


def _count_of(effect):
    return len(effect.numbers(CONCRETE))


def _numbers_of(effect, materials):
    """Numbers of an effect; of laws a row for each pair of materials, ``Tables.pair``."""
    table = [[_checked_numbers(effect, pair) for pair in row] for row in materials.pairs]
    if effect.role in MANY:
        return table[0][0]
    rows = np.zeros((MOST * len(table), effect._count))
    for a, row in enumerate(table):
        rows[MOST * a : MOST * a + len(row)] = row
    return rows


def check_one_material(effect: Effect, materials: BodyMaterials) -> None:
    """Raise InputError where materials give a load, support or ground different numbers."""
    if effect.role in MANY and not materials.is_one:
        own = [tuple(effect.numbers(row[k])) for k, row in enumerate(materials.pairs)]
        if any(numbers != own[0] for numbers in own):
            raise InputError(
                f"effect {effect.name} has one row of numbers for all bodies, and must get "
                f"the same row from every material of a scene, got {shown(own[0])} and others"
            )


def _checked_numbers(effect, material):
    """Numbers of an effect with a material, as an array; InputError unless all are numbers."""
    given = effect.numbers(material)
    try:
        numbers = np.array(given, dtype=np.float64)
    except (TypeError, ValueError):
        numbers = np.array(np.nan)
    if numbers.shape != (effect._count,) or np.isnan(numbers).any():
        raise InputError(
            f"numbers of effect {effect.name or type(effect).__name__} must be {effect._count} "
            f"real numbers, got {shown(given)}"
        )
    return numbers


def check_sliding_energy(effect: Effect, option: str, material: Material) -> None:
    """Raise InputError for a material without cohesion, or too soft for a fracture energy G_II."""
    if not material.cohesion > 0.0:
        raise InputError(
            f"cohesion of the material must be more than 0 Pa with the effect {effect.name}, "
            "which degrades it, got 0"
        )
    energy = getattr(effect, option)
    least = material.cohesion**2 / (2.0 * float(material.shear_stiffness))
    if not energy > least:
        got, bound = told_apart(energy, least, 6)
        raise InputError(
            f"{option} of {effect.name} must be larger than cohesion^2 / (2 shear_stiffness) = "
            f"{bound} J/m2, or a bond would fail at once, got {got}"
        )
