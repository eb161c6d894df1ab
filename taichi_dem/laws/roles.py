"""Roles of effects as typed contracts: the members that each must have.

All members are ``ti.func`` methods of the bound effect. b is a bond, u one of its three contact
units (3 b, 3 b + 1, 3 b + 2), i a body, k a sphere pair, m a pair of materials, whose numbers a law
reads as ``self.law[m, 0]`` and on.
"""

import inspect
from typing import Any, Protocol

import taichi as ti

from taichi_dem.kit.errors import InputError
from taichi_dem.physics.wrench import Block
from taichi_dem.state.body_motion import BodyMotion


class BondLaw(Protocol):
    """Law of a bond's contact units, opening and sliding together; role "bond".

    jump: normal opening and two components of the sliding [m]; stiffness: normal and shear [Pa/m].
    Beside its members it says ``rubs``, whether slip may spend energy, ``remembers_slip``, whether
    ``residual_slip(u)`` stays when the traction is gone, and ``is_whole``, whether it serves both
    the limit in tension and that in shear.
    """

    def traction(
        self, m: int, u: int, stiffness: ti.Vector, jump: ti.Vector
    ) -> tuple[ti.Vector, float]:
        """Traction [Pa], three components, and energy per area slipped away now [J/m^2]."""

    def failed(self, m: int, u: int, traction: ti.Vector) -> int:
        """1 once the unit transmits nothing any more at a traction [Pa], else 0."""

    def stored(self, b: int, u: int, jump: ti.Vector) -> tuple[float, float]:
        """Elastic energy per area of opening and of sliding [J/m^2]."""

    def spent(self, b: int, u: int) -> float:
        """Energy per area [J/m^2] that damage has spent in the unit."""

    def damage(self, b: int, u: int) -> float:
        """0 intact to 1 failed."""

    def acted(self, b: int, u: int) -> int:
        """Bits of the parts of the law that have changed the unit: 1, or 1 and 2."""

    def begins(self, m: int, stiffness: ti.Vector, jump: ti.Vector) -> int:
        """Bits of the parts near whose limit a unit comes that the law never changed.

        Elsewhere the traction must be stiffness times jump to the bit, and nothing else may happen.
        """


class TensionLaw(Protocol):
    """Normal law of a bond's contact units, for itself; role "tension".

    For effects="auto" it also says in words when it acts, ``activation``, as laws of contact,
    friction and damping do, and by ``begins(m, stiffness, opening)`` where a unit that it never
    changed comes near its limit: below, the traction must be stiffness times opening, and nothing
    else may happen. A shear law has ``begins(m, stiffness, sliding, pressure)``.
    """

    def traction(self, m: int, stiffness: float, u: int, opening: float) -> float:
        """Traction [Pa] at a normal opening [m]."""

    def failed(self, m: int, u: int) -> int:
        """1 once the unit transmits nothing any more, else 0."""

    def stored(self, b: int, u: int, opening: float) -> float:
        """Elastic energy per area [J/m^2]."""

    def spent(self, b: int, u: int) -> float:
        """Energy per area [J/m^2] that has been spent in the unit."""

    def damage(self, b: int, u: int) -> float:
        """0 intact to 1 failed."""


class ShearLaw(Protocol):
    """Tangential law of a bond's contact units, for itself; role "shear".

    One with ``remembers_slip = True`` also keeps the contract ``SlipMemory``, one with ``releases =
    True`` the contract ``ShearFailure``.
    """

    def traction(
        self, m: int, stiffness: float, u: int, sliding: ti.Vector, pressure: float
    ) -> tuple[ti.Vector, float]:
        """Traction [Pa], two components, and energy per area slipped away now [J/m^2]."""

    def stored(self, b: int, u: int, sliding: ti.Vector) -> float:
        """Elastic energy per area [J/m^2]."""


class SlipMemory(Protocol):
    """Slip that stays when the traction is gone."""

    def residual_slip(self, u: int) -> ti.Vector:
        """Residual slip in the face frame [m], two components."""


class ShearFailure(Protocol):
    """Failure of a bond's contact units in shear."""

    def failed(self, m: int, u: int, pressure: float) -> int:
        """1 once the unit transmits nothing any more at a pressure [Pa], else 0."""


class DashpotLaw(Protocol):
    """Damping of a bond's contact units; role "dashpot"."""

    def traction(self, b: int, velocity: ti.Vector) -> ti.Vector:
        """Traction [Pa] of a bond at a relative velocity in the face frame [m/s]."""


class ContactLaw(Protocol):
    """Normal law of contact spheres; role "contact"."""

    def normal(self, m: int, overlap: float, opening_rate: float) -> float:
        """Repulsion [N] at an overlap [m] of spheres that part at a rate [m/s]."""

    def elastic(self, m: int, overlap: float) -> float:
        """Part of it that is stored [N]."""

    def damping(self, m: int) -> float:
        """Coefficient of the dashpot [N s/m], which friction shares."""

    def stored(self, m: int, overlap: float) -> float:
        """Energy [J]."""

    @property
    def meets_faces(self) -> bool:
        """Whether spheres meet faces, with ``corner`` of each in the frame of its body."""

    def spheres(self, model: Any) -> Any:
        """Contact spheres of a scene.

        Parameters
        ----------
        model : Model
            Arrays of the scene.

        Returns
        -------
        ContactSpheres
            Spheres of all faces.
        """

    def watch_faces(self, exposed_faces: ti.Field) -> None:
        """Take note of the field with a bit for each face of a body that is free.

        Parameters
        ----------
        exposed_faces : Field
            Field of the bits of each body.
        """

    def nearest(self, a: int, b: int, turn: ti.Matrix, offset: ti.Vector) -> Any:
        """Where two bodies are nearest by an entry of the pair store (``SphereContact``)."""

    def face_of(self, a: int) -> int:
        """Face of one side of an entry of the pair store."""


class FrictionLaw(Protocol):
    """Tangential law of contact spheres; role "friction".

    One with ``remembers = True`` also keeps the contract ``FrictionMemory``.
    """

    def limit(self, m: int, force_normal: float) -> float:
        """Largest friction [N] at a normal force [N]; of impulses likewise."""

    def force(self, m: int, damping: float, force_normal: float, slide: ti.Vector) -> ti.Vector:
        """Force [N] on the second sphere against its sliding velocity [m/s]."""


class FrictionMemory(Protocol):
    """Springs across contacts, of which each sphere pair keeps its own.

    Vectors are in the first body's frame.
    """

    def follow(self, k: int, normal: ti.Vector, way: ti.Vector) -> None:
        """Turn the spring of pair k into the plane of contact and stretch it by ``way`` [m]."""

    def slip(self, m: int, k: int, limit: float, way: ti.Vector) -> float:
        """Shorten the spring to a limit [N]; return the energy dissipated [J]."""

    def spring(self, m: int, k: int) -> ti.Vector:
        """Force [N] on the second sphere."""

    def stored(self, m: int, k: int) -> float:
        """Energy [J]."""

    def part(self, m: int, k: int) -> float:
        """Forget the spring as the spheres part; energy [J] that it had."""


class Load(Protocol):
    """Force on bodies; role "load".

    One with ``varies = True`` also keeps the contract ``VaryingLoad``.
    """

    def acts_on(self, i: int) -> int:
        """Nonzero for a body on which it acts."""

    def wrench(self, i: int, motion: BodyMotion) -> tuple[ti.Vector, ti.Vector]:
        """Force [N] and torque about the centre [N m]; motion: a ``body_motion.BodyMotion``."""


class VaryingLoad(Protocol):
    """A load whose ``wrench`` is its mean from motion.since to motion.until."""

    def changes(self, since: float, until: float) -> int:
        """Nonzero where it changes between two times [s]."""


class Support(Protocol):
    """Constraint of bodies; role "support"."""

    def acts_on(self, i: int) -> int:
        """Nonzero for a body that it holds."""

    def held(
        self,
        i: int,
        t: float,
        step: float,
        rotation: ti.Matrix,
        velocity: ti.Vector,
        angular_momentum: ti.Vector,
    ) -> tuple[ti.Vector, ti.Vector]:
        """Mean velocity [m/s] and angular momentum [kg m^2/s] that it allows in a step [s].

        t: middle of the step [s]; a step of 0 asks for the values at that time.
        """


class Ground(Protocol):
    """Dashpots between bodies and ground at rest; role "ground".

    The step solves them in the body's own update, so that they limit no step.
    """

    def acts_on(self, i: int) -> int:
        """Nonzero for a body that is joined to the ground."""

    def resistance(self, i: int) -> Block:
        """Force [N] and moment [N m] by which the ground resists velocity and spin, a ``Block``.

        World axes, about the centre, positive semidefinite.
        """


#: Contract of each role.
CONTRACTS = {
    "bond": BondLaw,
    "tension": TensionLaw,
    "shear": ShearLaw,
    "dashpot": DashpotLaw,
    "contact": ContactLaw,
    "friction": FrictionLaw,
    "load": Load,
    "support": Support,
    "ground": Ground,
}


#: Contracts that an effect keeps beside that of its role, by the attribute that says so.
FURTHER = {
    "remembers": FrictionMemory,
    "remembers_slip": SlipMemory,
    "releases": ShearFailure,
    "varies": VaryingLoad,
}


_OF_BONDS = ("bond", "tension", "shear")
#: What a law does, by role: a class that changes it has to say anew when it begins to act.
_DOES = {
    "bond": ("traction", "failed"),
    "tension": ("traction", "failed"),
    "shear": ("traction", "failed"),
    "dashpot": ("traction",),
    "contact": ("normal", "elastic", "nearest"),
    "friction": ("limit", "force", "spring"),
}


def check_activation(effect: Any) -> None:
    """Raise InputError for a law that has no rule for effects="auto"; loads and supports act."""
    if effect.role in _OF_BONDS and effect.is_silent:
        raise InputError(
            "effects 'auto' must have laws of bonds that act, as it looks for no limit beside "
            f"theirs, got a silent {type(effect).name}: list the effects, or take 'all'"
        )
    rules = ("activation", "begins") if effect.role in _OF_BONDS else ("activation",)
    order = [kind.__name__ for kind in type(effect).__mro__]
    for rule in rules if effect.role in _DOES else ():
        said = _first(type(effect), rule)
        changed = min(_first(type(effect), member) for member in _DOES[effect.role])
        rightly = callable if rule == "begins" else lambda words: isinstance(words, str) and words
        if not rightly(getattr(effect, rule, None)) or said > changed:
            what = "the words activation" if rule == "activation" else "a function begins"
            raise InputError(
                f"effects 'auto' must have laws that say when they begin to act: {order[0]} has no "
                f"{rule} of its own; give it {what}, or list the effects"
            )


def _first(kind, member):
    """Place in the order of its bases of the class that has a member."""
    places = [k for k, base in enumerate(kind.__mro__) if member in vars(base)]
    return places[0] if places else len(kind.__mro__)


def members_of(contract: type) -> tuple:
    """Names of the members of a Protocol."""
    return tuple(name for name in vars(contract) if not name.startswith("_"))


def _check_parameters(kind, contract, name):
    """Raise InputError where a member of an effect takes other arguments than its contract says."""
    wanted, given = (_parameters(getattr(owner, name, None)) for owner in (contract, kind))
    if wanted is None or given is None or len(wanted) == len(given):
        return
    raise InputError(
        f"effect {kind.__name__} must have a member {name}({', '.join(wanted)}), "
        f"got {name}({', '.join(given)})"
    )


def _parameters(member):
    """Names of the arguments of a function beside self; None where any number is taken."""
    if not callable(member):
        return None
    found = list(inspect.signature(member).parameters.values())
    if any(each.kind in (each.VAR_POSITIONAL, each.VAR_KEYWORD) for each in found):
        return None
    return [each.name for each in found[1:] if each.default is each.empty]


def check_effect(effect: Any) -> None:
    """Raise InputError unless an effect has a known role and every member of its contract."""
    kind = type(effect).__name__
    if effect.role not in CONTRACTS:
        raise InputError(
            f"role of effect {kind} must be one of {', '.join(CONTRACTS)}, got {effect.role!r}"
        )
    further = [contract for name, contract in FURTHER.items() if getattr(effect, name, False)]
    contracts = CONTRACTS[effect.role], *further
    wanted = [name for contract in contracts for name in members_of(contract)]
    missing = [name for name in wanted if not hasattr(type(effect), name)]
    if missing:
        raise InputError(
            f"effect {kind} must have a member {missing[0]}, as its role {effect.role} asks for "
            f"{', '.join(wanted)}"
        )
    for contract in contracts:
        for name in members_of(contract):
            _check_parameters(type(effect), contract, name)
