"""Checks that an effect gives what its role asks for, and laws that "auto" chooses."""

from collections.abc import Iterable
from inspect import signature
from typing import Any

from taichi_dem.kit.errors import InputError
from taichi_dem.kit.validation import shown
from taichi_dem.laws.base import Effect
from taichi_dem.laws.bond import BondDamping, ShearSlip, Softening
from taichi_dem.laws.cohesive_crack import CohesiveCrack
from taichi_dem.laws.contact import BodyContact
from taichi_dem.laws.contact_contracts import ONCE_BROKEN, ContactLaw, FrictionLaw
from taichi_dem.laws.contracts import (
    PARTS_OF_BOND,
    BondLaw,
    Dashpot,
    ElasticShear,
    ElasticTension,
    Ground,
    Load,
    NoDashpot,
    ShearLaw,
    Support,
    TensionLaw,
    UnitLaw,
)
from taichi_dem.laws.friction import NoFriction, StickingFriction
from taichi_dem.materials.body_materials import BodyMaterials
from taichi_dem.mesh.mesh import Mesh
from taichi_dem.mesh.topology import parts_of
from taichi_dem.state.model import ROLES, SINGLE

#: Contracts by role.
CONTRACTS: dict[str, Any] = {
    kind.role: kind
    for kind in (
        *(BondLaw, TensionLaw, ShearLaw, Dashpot, FrictionLaw, ContactLaw),
        *(Load, Support, Ground),
    )
}
#: Classes of the null objects by role.
ABSENT: dict[str, Any] = {
    kind.role: kind for kind in (ElasticTension, ElasticShear, NoDashpot, NoFriction)
}
AUTO, ALL, LISTED = "auto", "all", "listed"
#: Words for the effects of a scene.
WORDS = (AUTO, ALL)


def check_activation(effect: Any) -> None:
    """Raise InputError for a law of bonds that effects="auto" cannot leave out below its limits."""
    if not isinstance(effect, UnitLaw):
        return
    if effect.is_silent:
        raise InputError(
            "effects 'auto' must have laws of bonds that act, as it checks the limits of these "
            f"laws only, got a silent {type(effect).name}: list the effects, or take 'all'"
        )
    said, *changed = (_first(type(effect), method) for method in ("begins", "traction", "failed"))
    if said > min(changed):
        raise InputError(
            "effects 'auto' must have laws of bonds that say when they begin to act: "
            f"{type(effect).__name__} has no begins of its own; give it one, or list the effects"
        )


def _first(kind, member):
    """Place in the order of its bases of the class that has a member."""
    return next(k for k, base in enumerate(kind.__mro__) if member in vars(base))


def check_effect(effect: Any) -> None:
    """Raise InputError unless an effect has a known role and gives what its contract asks for."""
    kind, role = type(effect).__name__, effect.role
    if role not in ROLES:
        raise InputError(
            f"role of effect {kind} must be one of {', '.join(ROLES)}, got {role!r}: derive it "
            "from a class of taichi_dem.effects that has the role"
        )
    contract = CONTRACTS[role]
    if not isinstance(effect, contract):
        raise InputError(
            f"effect {kind} of the role {role} must derive from taichi_dem.effects."
            f"{contract.__name__}, got {type(effect).__mro__[1].__name__}"
        )
    parts = (effect, effect.geometry) if role == "contact" else (effect,)
    lacking = [method for part in parts for method in _lacking(part)]
    if role == "contact" and _declares(effect) and not effect.has_memory:
        lacking.append("keep(m, k, touch), which fills its columns,")
    if lacking:
        raise InputError(
            f"effect {kind} must have {' and '.join(lacking)}, as its role {role} asks for"
        )


def _declares(law):
    """Whether a law declares columns of its contacts."""
    return type(law).declare_columns is not Effect.declare_columns


def _lacking(effect):
    """Abstract methods of its contract that an effect does not give, as they are called."""
    methods = ((name, getattr(type(effect), name)) for name in dir(type(effect)))
    asked = ((n, method) for n, method in methods if getattr(method, "__isabstractmethod__", False))
    return [f"{name}({', '.join([*signature(method).parameters][1:])})" for name, method in asked]


class ChosenEffects(tuple):
    """Effects of a scene. word: "auto", "all", or "listed" where the user listed them."""

    word: str

    def __new__(cls, effects: Iterable[Effect], word: str = LISTED) -> "ChosenEffects":
        """Keep the word with the effects."""
        chosen = super().__new__(cls, effects)
        chosen.word = word
        return chosen


def chosen_effects(
    word: Any, mesh: Mesh, material: BodyMaterials, given: Iterable[Effect]
) -> ChosenEffects:
    """Effects for a word, "auto" or "all": laws that any of the materials needs, and those given.

    Raises InputError for an unknown word, or, with "auto", a law that does not say when it acts.
    """
    if word not in WORDS:
        raise InputError(
            f"effects must be a list of effects or one of {', '.join(map(repr, WORDS))}, "
            f"got {shown(word)}"
        )
    given = tuple(given)
    taken = {getattr(effect, "role", "") for effect in given}
    by_role = {law.role: law for law in usual_laws(mesh, material, taken)}
    chosen = [by_role[role] for role in SINGLE if role in by_role]
    effects = ChosenEffects((*chosen, *given), word)
    if word == AUTO:
        for effect in effects:
            check_activation(effect)
    return effects


def usual_laws(mesh: Mesh, material: BodyMaterials, taken: Iterable[str]) -> list[Effect]:
    """The laws that a material has numbers for, but for roles that are taken.

    Coefficients of zero need no law.
    """
    taken = {*taken, *(PARTS_OF_BOND if "bond" in taken else ())}
    whole = material.is_elastic and taken.isdisjoint(PARTS_OF_BOND)
    laws: list[Effect] = [CohesiveCrack()] if whole else [Softening(), ShearSlip()]
    if material.has_bond_damping:
        laws.append(BondDamping())
    if "contact" not in taken:
        # Nothing meets a solid of one piece at its outer faces before something has come loose.
        meets = parts_of(mesh).max() > 0 or mesh.has_open_faces
        laws.append(BodyContact(outer_faces=True if meets else ONCE_BROKEN))
    if material.friction > 0.0:
        laws.append(StickingFriction())
    return [law for law in laws if law.role not in taken]
