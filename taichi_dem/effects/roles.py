"""Roles of effects as typed contracts: the members that the step asks of each.

All members are ``ti.func`` methods of the bound effect. b is a bond, u one of its three contact
units (3 b, 3 b + 1, 3 b + 2), i a body, k a sphere pair.
"""

from typing import Protocol

from taichi_dem.kit.errors import InputError


class TensionLaw(Protocol):
    """Normal law of a bond's contact units; role "tension"."""

    def traction(self, stiffness, u, opening):
        """Traction [Pa] at a normal opening [m]."""

    def failed(self, u):
        """1 once the unit transmits nothing any more, else 0."""

    def stored(self, b, u, opening):
        """Elastic energy per area [J/m^2]."""

    def spent(self, b, u):
        """Energy per area [J/m^2] that has been spent in the unit."""

    def damage(self, b, u):
        """0 intact to 1 failed."""


class ShearLaw(Protocol):
    """Tangential law of a bond's contact units; role "shear"."""

    def traction(self, stiffness, u, sliding, pressure):
        """Traction [Pa], two components, and energy per area slipped away now [J/m^2]."""

    def stored(self, b, u, sliding):
        """Elastic energy per area [J/m^2]."""


class DashpotLaw(Protocol):
    """Damping of a bond's contact units; role "dashpot"."""

    def traction(self, velocity):
        """Traction [Pa] at a relative velocity in the face frame [m/s]."""


class ContactLaw(Protocol):
    """Normal law of contact spheres; role "contact"."""

    def normal(self, overlap, opening_rate):
        """Repulsion [N] at an overlap [m] of spheres that part at a rate [m/s]."""

    def elastic(self, overlap):
        """Part of it that is stored [N]."""

    def damping(self):
        """Coefficient of the dashpot [N s/m], which friction shares."""

    def stored(self, overlap):
        """Energy [J]."""


class FrictionLaw(Protocol):
    """Tangential law of contact spheres; role "friction".

    One with ``remembers = True`` also keeps the contract ``FrictionMemory``.
    """

    def limit(self, force_normal):
        """Largest friction [N] at a normal force [N]; of impulses likewise."""

    def force(self, damping, force_normal, slide):
        """Force [N] on the second sphere against its sliding velocity [m/s]."""


class FrictionMemory(Protocol):
    """Springs across contacts, of which each sphere pair keeps its own.

    Vectors are in the first body's frame.
    """

    def follow(self, k, normal, way):
        """Turn the spring of pair k into the present contact plane and stretch it by a way [m]."""

    def slip(self, k, limit, way):
        """Let the spring slip beyond a limit [N]; energy [J] that this takes."""

    def spring(self, k):
        """Force [N] on the second sphere."""

    def stored(self, k):
        """Energy [J]."""

    def part(self, k):
        """Forget the spring as the spheres part; energy [J] that it had."""


class Load(Protocol):
    """Force on bodies; role "load"."""

    def acts_on(self, i):
        """Nonzero for a body on which it acts."""

    def wrench(self, i, motion):
        """Force [N] and torque about the centre [N m]; motion: a ``body_motion.BodyMotion``."""


class Support(Protocol):
    """Constraint of bodies; role "support"."""

    def acts_on(self, i):
        """Nonzero for a body that it holds."""

    def held(self, i, t, rotation, velocity, angular_momentum):
        """Velocity [m/s] and angular momentum [kg m^2/s] that it allows at a time [s]."""


#: Contract of each role.
CONTRACTS = {
    "tension": TensionLaw,
    "shear": ShearLaw,
    "dashpot": DashpotLaw,
    "contact": ContactLaw,
    "friction": FrictionLaw,
    "load": Load,
    "support": Support,
}


def members_of(contract) -> tuple:
    """Names of the members that a Protocol asks for."""
    return tuple(name for name in vars(contract) if not name.startswith("_"))


def check_effect(effect):
    """Raise InputError unless an effect has a known role and every member of its contract."""
    kind = type(effect).__name__
    if effect.role not in CONTRACTS:
        raise InputError(
            f"role of effect {kind} must be one of {', '.join(CONTRACTS)}, got {effect.role!r}"
        )
    wanted = members_of(CONTRACTS[effect.role])
    if getattr(effect, "remembers", False):
        wanted += members_of(FrictionMemory)
    missing = [name for name in wanted if not hasattr(type(effect), name)]
    if missing:
        raise InputError(
            f"effect {kind} must have a member {missing[0]}, as its role {effect.role} asks for "
            f"{', '.join(wanted)}"
        )
