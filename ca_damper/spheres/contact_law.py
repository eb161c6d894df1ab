"""Contact forces between two spheres, or a sphere and a wall (paper, eqs 3 to 6)."""

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
import taichi as ti

from ca_damper.spheres.restitution import damping
from taichi_dem.kit.allocation import assign_members
from taichi_dem.kit.elementary import fifth_root

if TYPE_CHECKING:
    from ca_damper.spheres.options import Spheres

# Exponents p of the dashpot k d^(3/2) + c d^p d', by the name of the law.
POWERS = {"tsuji": 0.25, "printed": 0.5}

#: Friction by the present slip alone, or by springs as well (see ``friction_history``).
FRICTION_LAWS = ("viscous", "history")

# Integral of 2 / sqrt(1 - x^(5/2)) from 0 to 1.
_HERTZ = 2.0 * math.sqrt(math.pi) * math.gamma(1.4) / math.gamma(0.9)

# Part of a contact's slip that friction may take away in one step. Up to six contacts of a sphere
# act at once; at a quarter each they slow it down and never turn it round, so nothing chatters.
SLIP_SHARE = 0.25


@ti.dataclass
class Contact:
    """Numbers of one kind of contact.

    stiffness: k [N/m^(3/2)]. damping: c [N s/m^(1+p)]. friction: Coulomb's coefficient [-].
    reach: distance of a centre from the other, or from the wall, when they touch [m].
    yielding: half a step over the effective mass [s/kg]. grip: most friction per slip [N s/m].
    Of friction with history: shear, tangential stiffness over the root of the overlap [N/m^(3/2)];
    shear_damping: tangential over normal dashpot [-]; shear_yielding: half a step over the mass
    that resists a tangential impulse [s/kg]; since: time that positions have moved on [s]. dt [s].
    """

    stiffness: ti.f64
    damping: ti.f64
    friction: ti.f64
    reach: ti.f64
    yielding: ti.f64
    grip: ti.f64
    shear: ti.f64
    shear_damping: ti.f64
    shear_yielding: ti.f64
    since: ti.f64
    dt: ti.f64


def hertz_stiffness(
    radius: float, young: float, poisson: float, other_young: float, other_poisson: float
) -> float:
    """Stiffness k [N/m^(3/2)] of a Hertz contact (eqs 5, 6); radius: effective [m]; moduli [Pa]."""
    soft = (1.0 - poisson * poisson) / young
    modulus = 1.0 / (soft + (1.0 - other_poisson * other_poisson) / other_young)
    return 4.0 / 3.0 * math.sqrt(radius) * modulus


def shear_ratio(young: float, poisson: float, other_young: float, other_poisson: float) -> float:
    """Tangential over normal stiffness of a contact, 4 G* / E* (Mindlin 1949); moduli [Pa].

    For two bodies of one material 2 (1 - poisson) / (2 - poisson), whatever the overlap.
    """
    sides = ((young, poisson), (other_young, other_poisson))
    shear = sum(2.0 * (2.0 - nu) * (1.0 + nu) / modulus for modulus, nu in sides)
    normal = sum((1.0 - nu * nu) / modulus for modulus, nu in sides)
    return 4.0 * normal / shear


def contact_duration(mass: float, stiffness: float, speed: float) -> float:
    """Time [s] that bodies of an effective mass [kg] touch, undamped, at an impact speed [m/s].

    Hertz (1882): 2.943 D / v, D the deepest overlap, from k D^(5/2) 2/5 = m v^2 / 2.
    """
    root = fifth_root(1.25 * mass * speed * speed / stiffness)
    return _HERTZ * root * root / speed


def pair_numbers(options: "Spheres", one: int = 0, other: int = 0) -> dict[str, float]:
    """Numbers of a contact of two spheres, of these of the sizes.

    Dict of stiffness, shear_ratio, damping, friction, mass, reach.
    """
    moduli = (options.young, options.poisson, options.young, options.poisson)
    stiffness = hertz_stiffness(_reduced(options.radii, one, other), *moduli)
    return _numbers(
        options,
        options.restitution,
        options.friction,
        stiffness=stiffness,
        shear_ratio=shear_ratio(*moduli),
        mass=_reduced(options.masses, one, other),
        reach=options.radii[one] + options.radii[other],
    )


def _reduced(values: tuple[float, ...], one: int, other: int) -> float:
    """Product over sum of two of the values, half of each where they are equal."""
    first, second = values[one], values[other]
    return 0.5 * first if first == second else first * second / (first + second)


def wall_numbers(options: "Spheres", kind: int = 0) -> dict[str, float]:
    """Numbers of a contact of a sphere of a size with the container: as of ``pair_numbers``."""
    moduli = (options.young, options.poisson, options.wall_young, options.wall_poisson)
    stiffness = hertz_stiffness(options.radii[kind], *moduli)
    return _numbers(
        options,
        options.wall_restitution,
        options.wall_friction,
        stiffness=stiffness,
        shear_ratio=shear_ratio(*moduli),
        mass=options.masses[kind],
        reach=options.radii[kind],
    )


def _numbers(options, restitution, friction, *, stiffness, shear_ratio, mass, reach):
    power = POWERS[options.damping]
    c = damping(restitution, power, mass, stiffness, options.reference_speed)
    numbers = {"stiffness": stiffness, "damping": c, "friction": friction}
    return {**numbers, "shear_ratio": shear_ratio, "mass": mass, "reach": reach}


@ti.data_oriented
class ContactLaw:
    """Forces of a contact under one of the two damping laws.

    name: "tsuji" (p = 1/4) or "printed" (p = 1/2).
    """

    def __init__(self, name: str):
        self.printed = name == "printed"

    @ti.func
    def damping_ratio(self, share):
        """Ratio of damping for the same restitution with a share of the effective mass.

        The damping grows with the power 1 - 2 (1 + p) / 5 of the mass (see ``restitution``).
        """
        ratio = ti.sqrt(share)
        if ti.static(self.printed):
            root = fifth_root(share)
            ratio = root * root
        return ratio

    def load(
        self, field: ti.Field, kinds: Sequence[Mapping[str, float]], tangential_share: float
    ) -> None:
        """Write the numbers of contacts, before a step is known, to a Contact field.

        kinds: numbers of each entry. tangential_share: part of the effective mass that resists a
        tangential impulse.
        """
        found = {name: np.array([one[name] for one in kinds]) for name in kinds[0]}
        given = {name: found[name] for name in ("stiffness", "damping", "friction", "reach")}
        assign_members(
            field,
            **given,
            yielding=0.5 / found["mass"],
            grip=SLIP_SHARE * tangential_share * found["mass"],
            # The normal stiffness at an overlap is 3/2 k d^(1/2).
            shear=1.5 * found["shear_ratio"] * found["stiffness"],
            shear_damping=np.sqrt(tangential_share * found["shear_ratio"]),
        )

    @ti.func
    def over_step(self, contact, dt, since):
        """The numbers of a contact for a step [s]; since: time that positions have moved on [s]."""
        contact.yielding *= dt
        contact.grip /= dt
        contact.shear_yielding = 0.5 * SLIP_SHARE / contact.grip
        contact.since, contact.dt = since, dt
        return contact

    @ti.func
    def normal(self, contact, overlap, approach):
        """Repulsion [N] at a positive overlap [m] that grows by approach [m/s]; never a pull.

        The dashpot acts on the approach in the middle of the step, which the force itself has
        slowed down by then: so the order of the leapfrog is kept.
        """
        dashpot = self.dashpot(contact, ti.sqrt(overlap))
        force = self.elastic(contact, overlap) + dashpot * approach
        return ti.max(0.0, force) / (1.0 + dashpot * contact.yielding)

    @ti.func
    def dashpot(self, contact, root):
        """Coefficient of the dashpot [N s/m] for the root of an overlap [m^(1/2)]."""
        # d^(3/2) and d^(1/4) by square roots: a power costs ten times as much.
        return contact.damping * (root if ti.static(self.printed) else ti.sqrt(root))

    @ti.func
    def elastic(self, contact, overlap):
        """The spring's part of the repulsion [N]."""
        return contact.stiffness * overlap * ti.sqrt(overlap)

    @ti.func
    def friction(self, contact, push, slip):
        """Friction [N] against a slip [m/s] (eq. 4), bounded by the grip at small slip."""
        most, wanted = contact.friction * push, contact.grip * slip
        # Not by ti.min and ti.max: what they do about NaN takes five instructions more.
        low = ti.select(wanted < most, wanted, most)
        return -ti.select(low > -most, low, -most)

    @ti.func
    def stored(self, contact, overlap):
        """Elastic energy [J] at an overlap [m]; none at a negative one."""
        depth = ti.max(0.0, overlap)
        return 0.4 * contact.stiffness * depth * depth * ti.sqrt(depth)
