"""Members that an effect must have, by its role, and checks of them; laws that "auto" chooses.

All are ``ti.func`` methods of the bound effect, but for attributes, which are written without
arguments, and functions of the model. b is a bond, u one of its three contact units (3 b, 3 b + 1,
3 b + 2), i a body, k a sphere pair, m a pair of materials (``self.law[m, 0]`` and on).
"""

from collections.abc import Iterable
from typing import Any

from taichi_dem.kit.errors import InputError
from taichi_dem.kit.validation import shown
from taichi_dem.laws.base import (
    PARTS_OF_BOND,
    Effect,
    ElasticShear,
    ElasticTension,
    NoDashpot,
    asked_of,
)
from taichi_dem.laws.bond import BondDamping, ShearSlip, Softening
from taichi_dem.laws.contact import BodyContact
from taichi_dem.laws.contact_contracts import ONCE_BROKEN
from taichi_dem.laws.friction import NoFriction, StickingFriction
from taichi_dem.materials.body_materials import BodyMaterials
from taichi_dem.mesh.mesh import Mesh
from taichi_dem.mesh.topology import parts_of
from taichi_dem.state.model import ROLES, SINGLE

#: Members of each role as they are called, then those of an effect that says so by an attribute.
MEMBERS = {
    # Law of a bond's contact units, opening and sliding together. jump: normal opening and two
    # components of the sliding [m]; stiffness: normal and shear [Pa/m]. It also says ``rubs``,
    # whether slip may spend energy, ``remembers_slip``, whether ``residual_slip(u)`` stays when the
    # traction is gone, and ``is_whole``, whether it serves both the limit in tension and that in
    # shear.
    "bond": (
        # Traction [Pa], three components, and energy per area slipped away now [J/m^2].
        "traction(m, u, stiffness, jump)",
        # 1 once the unit transmits nothing any more at a traction [Pa], else 0.
        "failed(m, u, traction)",
        # Elastic energy per area of opening and of sliding [J/m^2].
        "stored(b, u, jump)",
        # Energy per area [J/m^2] that damage has spent in the unit.
        "spent(b, u)",
        # 0 intact to 1 failed.
        "damage(b, u)",
        # Bits of the parts of the law that have changed the unit: 1, or 1 and 2.
        "acted(b, u)",
        # Bits of the parts near whose limit a unit comes that the law never changed. Elsewhere the
        # traction must be stiffness times jump to the bit, and nothing else may happen.
        "begins(m, stiffness, jump)",
    ),
    # Normal law of a bond's contact units, for itself. For effects="auto" it also says in words
    # when it acts, ``activation``, as laws of contact, friction and damping do, and by
    # ``begins(m, stiffness, opening)`` where a unit that it never changed comes near its limit:
    # below, the traction must be stiffness times opening, and nothing else may happen. A shear law
    # has ``begins(m, stiffness, sliding, pressure)``.
    "tension": (
        # Traction [Pa] at a normal opening [m].
        "traction(m, stiffness, u, opening)",
        # 1 once the unit transmits nothing any more, else 0.
        "failed(m, u)",
        # Elastic energy per area [J/m^2].
        "stored(b, u, opening)",
        # Energy per area [J/m^2] that has been spent in the unit.
        "spent(b, u)",
        # 0 intact to 1 failed.
        "damage(b, u)",
    ),
    # Tangential law of a bond's contact units, for itself.
    "shear": (
        # Traction [Pa], two components, and energy per area slipped away now [J/m^2].
        "traction(m, stiffness, u, sliding, pressure)",
        # Elastic energy per area [J/m^2].
        "stored(b, u, sliding)",
    ),
    # Damping of a bond's contact units: traction [Pa] at a relative velocity in the face frame
    # [m/s].
    "dashpot": ("traction(b, velocity)",),
    # Force on bodies.
    "load": (
        # Nonzero for a body on which it acts.
        "acts_on(i)",
        # Force [N] and torque about the centre [N m]; motion: a ``state.BodyMotion``.
        "wrench(i, motion)",
    ),
    # Constraint of bodies.
    "support": (
        # Nonzero for a body that it holds.
        "acts_on(i)",
        # Mean velocity [m/s] and angular momentum [kg m^2/s] that it allows in a step [s] with its
        # middle at a time t [s]; a step of 0 asks for the values at that time.
        "held(i, t, step, rotation, velocity, angular_momentum)",
    ),
    # Dashpots between bodies and ground at rest. The step solves them in the body's own update, so
    # that they limit no step.
    "ground": (
        # Nonzero for a body that is joined to the ground.
        "acts_on(i)",
        # Force [N] and moment [N m] by which the ground resists velocity and spin, a ``Block``, in
        # world axes, about the centre, positive semidefinite.
        "resistance(i)",
    ),
    # Slip of shear that stays when the traction is gone: in the face frame [m], two components.
    "remembers_slip": ("residual_slip(u)",),
    # Failure in shear: 1 once the unit transmits nothing any more at a pressure [Pa], else 0.
    "releases": ("failed(m, u, pressure)",),
    # A load whose ``wrench`` is its mean from motion.since to motion.until: nonzero where it
    # changes between two times [s].
    "varies": ("changes(since, until)",),
}

_OF_BONDS = ("bond", "tension", "shear")
#: What a law does, by role: a class that changes it has to say anew when it begins to act.
_DOES = {
    "bond": ("traction", "failed"),
    "tension": ("traction", "failed"),
    "shear": ("traction", "failed"),
    "dashpot": ("traction",),
    "contact": ("push",),
    "friction": ("limit", "force", "spring"),
}
#: Classes of the null objects by role.
ABSENT: dict[str, Any] = {
    kind.role: kind for kind in (ElasticTension, ElasticShear, NoDashpot, NoFriction)
}
AUTO, ALL, LISTED = "auto", "all", "listed"
#: Words for the effects of a scene.
WORDS = (AUTO, ALL)


def check_activation(effect: Any) -> None:
    """Raise InputError for a law that has no rule for effects="auto"; loads and supports act."""
    if effect.role in _OF_BONDS and effect.is_silent:
        raise InputError(
            "effects 'auto' must have laws of bonds that act, as it checks the limits of these "
            f"laws only, got a silent {type(effect).name}: list the effects, or take 'all'"
        )
    rules = ("activation", "begins") if effect.role in _OF_BONDS else ("activation",)
    for rule in rules if effect.role in _DOES else ():
        said = _first(type(effect), rule)
        changed = min(_first(type(effect), member) for member in _DOES[effect.role])
        if not getattr(effect, rule, None) or said > changed:
            raise InputError(
                "effects 'auto' must have laws that say when they begin to act: "
                f"{type(effect).__name__} has no {rule} of its own; give it one, or list the "
                "effects"
            )


def _first(kind, member):
    """Place in the order of its bases of the class that has a member."""
    places = [k for k, base in enumerate(kind.__mro__) if member in vars(base)]
    return places[0] if places else len(kind.__mro__)


def check_effect(effect: Any) -> None:
    """Raise InputError unless an effect has a known role and every member of that role."""
    if effect.role not in ROLES:
        raise InputError(
            f"role of effect {type(effect).__name__} must be one of {', '.join(ROLES)}, got "
            f"{effect.role!r}"
        )
    further = [key for key in MEMBERS if key not in ROLES and getattr(effect, key, False)]
    wanted = [member for key in (effect.role, *further) for member in MEMBERS.get(key, ())]
    own = asked_of(type(effect))
    if own:
        raise InputError(
            f"effect {type(effect).__name__} must have {', '.join(own)}, as its role "
            f"{effect.role} asks (taichi_dem/laws/contact_contracts.py)"
        )
    for member in wanted:
        if not hasattr(type(effect), member.partition("(")[0]):
            raise InputError(
                f"effect {type(effect).__name__} must have a member {member}, as its role "
                f"{effect.role} asks for {', '.join(wanted)}"
            )


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

    Raises InputError for an unknown word, or, with "auto", a law that does not say when it acts.
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
