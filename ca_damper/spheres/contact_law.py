"""Contact forces between two spheres, or a sphere and a wall (paper, eqs 3 to 6).

The dashpot follows from the wanted restitution. Two spheres meet head on: m d'' = -max(0, k d^(3/2)
+ c d^p d'); d: overlap, m: effective mass. In units of D = (m v^2 / k)^(2/5) and of the speed v,
c becomes alpha = c D^(p+1) / (m v): for p = 1/4 restitution is one number, for p = 1/2 it holds at
one speed only. The contact ends with the force, before the overlap: spheres do not pull.
"""

import math
from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Any

import numpy as np
import taichi as ti

from taichi_dem.kit.elementary import fifth_root

# Exponents p of the dashpot k d^(3/2) + c d^p d', by the name of the law.
POWERS = {"tsuji": 0.25, "printed": 0.5}

#: Friction by the present slip alone, or by springs as well (see ``friction_history``).
FRICTION_LAWS = ("viscous", "history")

# Integral of 2 / sqrt(1 - x^(5/2)) from 0 to 1.
_HERTZ = 2.0 * math.sqrt(math.pi) * math.gamma(1.4) / math.gamma(0.9)

# Part of a contact's slip that friction may take away in one step. Up to six contacts of a sphere
# act at once; at a quarter each they slow it down and never turn it round, so nothing chatters.
SLIP_SHARE = 0.25


# Step in the solver's variable: fourth order, errors of restitution below 1e-7.
_STEP = 1.0 / 256.0
_BISECTIONS = 40


@ti.dataclass
class Contact:
    """Numbers of one kind of contact.

    reach: distance of a centre from the other, or from the wall, when they touch [m]. yielding:
    half a step over the effective mass [s/kg]. grip: most friction per slip [N s/m]. shear:
    tangential stiffness over the root of the overlap [N/m^(3/2)]. since: time moved on [s].
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
    """Tangential over normal stiffness of a contact, 4 G* / E* (Mindlin 1949); moduli [Pa]."""
    sides = ((young, poisson), (other_young, other_poisson))
    shear = sum(2.0 * (2.0 - nu) * (1.0 + nu) / modulus for modulus, nu in sides)
    normal = sum((1.0 - nu * nu) / modulus for modulus, nu in sides)
    return 4.0 * normal / shear


def contact_duration(mass: float, stiffness: float, speed: float) -> float:
    """Time [s] that bodies of an effective mass [kg] touch, undamped, at an impact speed [m/s]."""
    # Hertz (1882): 2.943 D / v, D the deepest overlap, from k D^(5/2) 2/5 = m v^2 / 2.
    root = fifth_root(1.25 * mass * speed * speed / stiffness)
    return _HERTZ * root * root / speed


def pair_numbers(options: Any, one: int = 0, other: int = 0) -> dict[str, float]:
    """Numbers of a contact of two spheres, of these of the sizes."""
    radius, mass = (_reduced(of, one, other) for of in (options.radii, options.masses))
    partner = options.young, options.poisson, options.restitution, options.friction
    return _numbers(options, partner, radius, mass, options.radii[one] + options.radii[other])


def _reduced(values: tuple[float, ...], one: int, other: int) -> float:
    """Product over sum of two of the values, half of each where they are equal."""
    first, second = values[one], values[other]
    return 0.5 * first if first == second else first * second / (first + second)


def wall_numbers(options: Any, kind: int = 0) -> dict[str, float]:
    """Numbers of a contact of a sphere of a size with the container: as of ``pair_numbers``."""
    moduli, radius = (options.wall_young, options.wall_poisson), options.radii[kind]
    partner = (*moduli, options.wall_restitution, options.wall_friction)
    return _numbers(options, partner, radius, options.masses[kind], radius)


def _numbers(options, partner, radius, mass, reach):
    """Numbers of a contact with a partner: modulus, Poisson's ratio, restitution, friction."""
    *moduli, restitution, friction = partner
    stiffness = hertz_stiffness(radius, options.young, options.poisson, *moduli)
    power, speed = POWERS[options.damping], options.reference_speed
    return {
        "stiffness": stiffness,
        "shear_ratio": shear_ratio(options.young, options.poisson, *moduli),
        "damping": damping(restitution, power, mass, stiffness, speed),
        "friction": friction,
        "mass": mass,
        "reach": reach,
    }


def contact_members(
    kinds: Sequence[Mapping[str, float]], tangential_share: float
) -> dict[str, np.ndarray]:
    """Members of Contacts of several kinds, (kinds,) each, before a step is known."""
    found = {name: np.array([one[name] for one in kinds]) for name in kinds[0]}
    return {
        **{name: found[name] for name in ("stiffness", "damping", "friction", "reach")},
        "yielding": 0.5 / found["mass"],
        "grip": SLIP_SHARE * tangential_share * found["mass"],
        # The normal stiffness at an overlap is 3/2 k d^(1/2).
        "shear": 1.5 * found["shear_ratio"] * found["stiffness"],
        "shear_damping": np.sqrt(tangential_share * found["shear_ratio"]),
    }


@lru_cache(maxsize=64)
def damping_number(restitution: float, power: float) -> float:
    """Number alpha of a dashpot d^power with which spheres part at a restitution."""
    low, high = 0.0, 1.0
    while restitution_of(high, power) > restitution:
        low, high = high, 2.0 * high
    for _ in range(_BISECTIONS):
        middle = 0.5 * (low + high)
        if restitution_of(middle, power) > restitution:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


def restitution_of(alpha: float, power: float) -> float:
    """Speed of parting over speed of impact for a dashpot of number alpha."""
    # Integrates y = overlap^(1/4) over a time in which y' is the speed: all terms are then smooth,
    # as overlap^(1/4) is not (classical Runge-Kutta method).
    y, u = 0.0, 1.0
    while True:
        rate = _rate(y, u, alpha, power)
        y_new, u_new = _runge_kutta(y, u, alpha, power)
        rate_new = _rate(y_new, u_new, alpha, power)
        if u_new < 0.0 <= rate_new:
            # The force falls to zero within this step, and with it the rate, about linearly.
            share = rate / (rate - rate_new) if rate < 0.0 else 0.0
            return -(u + 0.5 * share * _STEP * rate)
        y, u = y_new, u_new


def damping(restitution: float, power: float, mass: float, stiffness: float, speed: float) -> float:
    """Coefficient c [N s/m^(1+power)] that gives ``restitution`` at an impact speed [m/s]."""
    root = fifth_root(mass * speed * speed / stiffness)
    depth = root * root
    more = math.sqrt(depth) if power == 0.5 else math.sqrt(math.sqrt(depth))
    return damping_number(restitution, power) * mass * speed / (depth * more)


def _rate(y, u, alpha, power):
    """Change of the speed u: -4 y^3 (d^(3/2) + alpha d^p u), d = y^4."""
    damped = y * u if power == 0.25 else y * y * u
    cube = y * y * y
    return -4.0 * cube * (cube * cube + alpha * damped)


def _runge_kutta(y, u, alpha, power):
    h = _STEP
    y1, u1 = u, _rate(y, u, alpha, power)
    y2, u2 = u + 0.5 * h * u1, _rate(y + 0.5 * h * y1, u + 0.5 * h * u1, alpha, power)
    y3, u3 = u + 0.5 * h * u2, _rate(y + 0.5 * h * y2, u + 0.5 * h * u2, alpha, power)
    y4, u4 = u + h * u3, _rate(y + h * y3, u + h * u3, alpha, power)
    return (
        y + h / 6.0 * (y1 + 2.0 * y2 + 2.0 * y3 + y4),
        u + h / 6.0 * (u1 + 2.0 * u2 + 2.0 * u3 + u4),
    )


@ti.data_oriented
class SphereContactLaw:
    """Forces of a contact under a damping law: "tsuji" (p = 1/4) or "printed" (p = 1/2)."""

    def __init__(self, name: str):
        self.printed = name == "printed"

    @ti.func
    def damping_ratio(self, share):
        """Ratio of damping for the same restitution with a share of the effective mass."""
        # Damping grows with the power 1 - 2 (1 + p) / 5 of the mass.
        ratio = ti.sqrt(share)
        if ti.static(self.printed):
            root = fifth_root(share)
            ratio = root * root
        return ratio

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
        """Repulsion [N] at a positive overlap [m] that grows by approach [m/s]; never a pull."""
        # The dashpot acts on the approach at mid-step, which the force has slowed already: this
        # keeps the order of the leapfrog.
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
