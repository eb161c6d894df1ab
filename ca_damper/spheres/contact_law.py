"""Contact forces between two spheres, or a sphere and a wall (paper, eqs 3 to 6)."""

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

import taichi as ti

from ca_damper.spheres.restitution import damping
from taichi_dem.kit.elementary import fifth_root

if TYPE_CHECKING:
    from ca_damper.spheres.options import Spheres

# Exponents p of the dashpot k d^(3/2) + c d^p d', by the name of the law.
POWERS = {"tsuji": 0.25, "printed": 0.5}

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
    """

    stiffness: ti.f64
    damping: ti.f64
    friction: ti.f64
    reach: ti.f64
    yielding: ti.f64
    grip: ti.f64


def hertz_stiffness(
    radius: float, young: float, poisson: float, other_young: float, other_poisson: float
) -> float:
    """Stiffness k [N/m^(3/2)] of a Hertz contact (eqs 5, 6); radius: effective [m]; moduli [Pa]."""
    soft = (1.0 - poisson * poisson) / young
    modulus = 1.0 / (soft + (1.0 - other_poisson * other_poisson) / other_young)
    return 4.0 / 3.0 * math.sqrt(radius) * modulus


def contact_duration(mass: float, stiffness: float, speed: float) -> float:
    """Time [s] that bodies of an effective mass [kg] touch, undamped, at an impact speed [m/s].

    Hertz (1882): 2.943 D / v, D the deepest overlap, from k D^(5/2) 2/5 = m v^2 / 2.
    """
    root = fifth_root(1.25 * mass * speed * speed / stiffness)
    return _HERTZ * root * root / speed


def pair_numbers(options: "Spheres") -> dict[str, float]:
    """Numbers of a contact of two spheres: dict of stiffness, damping, friction, mass, reach."""
    stiffness = hertz_stiffness(
        0.5 * options.radius, options.young, options.poisson, options.young, options.poisson
    )
    return _numbers(
        options,
        options.restitution,
        options.friction,
        stiffness=stiffness,
        mass=0.5 * options.particle_mass,
        reach=options.diameter,
    )


def wall_numbers(options: "Spheres") -> dict[str, float]:
    """Numbers of a contact of a sphere with the container: dict as of ``pair_numbers``."""
    stiffness = hertz_stiffness(
        options.radius, options.young, options.poisson, options.wall_young, options.wall_poisson
    )
    return _numbers(
        options,
        options.wall_restitution,
        options.wall_friction,
        stiffness=stiffness,
        mass=options.particle_mass,
        reach=options.radius,
    )


def _numbers(options, restitution, friction, *, stiffness, mass, reach):
    power = POWERS[options.damping]
    c = damping(restitution, power, mass, stiffness, options.reference_speed)
    numbers = {"stiffness": stiffness, "damping": c, "friction": friction}
    return {**numbers, "mass": mass, "reach": reach}


@ti.data_oriented
class ContactLaw:
    """Forces of a contact under one of the two damping laws.

    name: "tsuji" (p = 1/4) or "printed" (p = 1/2).
    """

    def __init__(self, name: str):
        self.printed = name == "printed"

    def load(self, field: ti.Field, numbers: Mapping[str, float], tangential_share: float) -> None:
        """Write the numbers of a contact, before a step is known, to a Contact field of shape ().

        tangential_share: part of the effective mass that resists a tangential impulse.
        """
        for name in ("stiffness", "damping", "friction", "reach"):
            setattr(field[None], name, numbers[name])
        field[None].yielding = 0.5 / numbers["mass"]
        field[None].grip = SLIP_SHARE * tangential_share * numbers["mass"]

    @ti.func
    def over_step(self, contact, dt):
        """The numbers of a contact for a step [s]."""
        contact.yielding *= dt
        contact.grip /= dt
        return contact

    @ti.func
    def normal(self, contact, overlap, approach):
        """Repulsion [N] at a positive overlap [m] that grows by approach [m/s]; never a pull.

        The dashpot acts on the approach in the middle of the step, which the force itself has
        slowed down by then: so the order of the leapfrog is kept.
        """
        root = ti.sqrt(overlap)
        # d^(3/2) and d^(1/4) by square roots: a power costs ten times as much.
        dashpot = contact.damping * (root if ti.static(self.printed) else ti.sqrt(root))
        force = self.elastic(contact, overlap) + dashpot * approach
        return ti.max(0.0, force) / (1.0 + dashpot * contact.yielding)

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
