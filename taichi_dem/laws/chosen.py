"""Laws that a scene takes from its material where it names none: effects="auto" and "all"."""

from collections.abc import Iterable
from typing import Any

from taichi_dem.kit.errors import InputError
from taichi_dem.kit.validation import shown
from taichi_dem.laws.base import PARTS_OF_BOND, Effect
from taichi_dem.laws.body_contact import BodyContact
from taichi_dem.laws.bond import BondDamping, ShearSlip, Softening
from taichi_dem.laws.friction import StickingFriction
from taichi_dem.laws.roles import check_activation
from taichi_dem.laws.sphere_contact import ONCE_BROKEN
from taichi_dem.materials.body_materials import BodyMaterials
from taichi_dem.mesh.mesh import Mesh
from taichi_dem.mesh.topology import parts_of
from taichi_dem.state.model import SINGLE

AUTO, ALL, LISTED = "auto", "all", "listed"
#: Words for the effects of a scene.
WORDS = (AUTO, ALL)


class ChosenEffects(tuple):
    """Effects of a scene. word: "auto", "all", or "listed" where the user listed them."""

    word: str

    def __new__(cls, effects: Iterable[Effect], word: str = LISTED) -> "ChosenEffects":
        """Keep the word with the effects."""
        made = super().__new__(cls, effects)
        made.word = word
        return made


def chosen_effects(
    word: Any, mesh: Mesh, material: BodyMaterials, given: Iterable[Effect]
) -> ChosenEffects:
    """Effects for a word, "auto" or "all": laws that any of the materials needs, and those given.

    given: loads, supports, and laws in place of the usual ones. Bodies may touch at outer faces
    from the start where the mesh has several parts, else once something has broken. Raises
    InputError for an unknown word, or, with "auto", a law whose author does not say when it begins
    to act.
    """
    if word not in WORDS:
        raise InputError(
            f"effects must be a list of effects or one of {', '.join(map(repr, WORDS))}, "
            f"got {shown(word)}"
        )
    given = tuple(given)
    taken = {getattr(effect, "role", "") for effect in given}
    laws = _laws(mesh, material, taken)
    if "bond" in taken:
        taken |= {*PARTS_OF_BOND}
    by_role = {effect.role: effect for effect in laws if effect.role not in taken}
    chosen = [by_role[role] for role in SINGLE if role in by_role]
    effects = ChosenEffects((*chosen, *given), word)
    if word == AUTO:
        for effect in effects:
            if isinstance(effect, Effect):
                check_activation(effect)
    return effects


def _laws(mesh, material, taken):
    """The laws that a material has numbers for; coefficients of zero need none."""
    laws = [Softening(), ShearSlip()]
    if material.has_bond_damping:
        laws.append(BondDamping())
    if "contact" not in taken:
        # Nothing meets a solid of one piece at its outer faces before something has come loose.
        meets = parts_of(mesh).max() > 0 or mesh.has_open_faces
        laws.append(BodyContact(outer_faces=True if meets else ONCE_BROKEN))
    if material.friction > 0.0:
        laws.append(StickingFriction())
    return laws
