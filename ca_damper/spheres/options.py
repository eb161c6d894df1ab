"""Options of the spheres, and quantities that follow from them."""

import math
from dataclasses import dataclass, replace
from operator import mul
from typing import ClassVar

from ca_damper.filling import LEAST_PLACES, DeviceFilling, FillingStructure
from ca_damper.scenes.gravity import checked_gravity, gravity_across, gravity_along
from ca_damper.scenes.scene_fields import SceneFields
from ca_damper.spheres.contact_law import FRICTION_LAWS, POWERS, contact_duration, pair_numbers
from ca_damper.spheres.dynamics import DIVERGENCES, DeviceSpheres
from ca_damper.spheres.effect_activity import air_estimate, rotation_estimate
from ca_damper.spheres.expected_contacts import SEARCHES
from ca_damper.spheres.search import listed_pairs
from ca_damper.spheres.start_values import (
    checked_sizes,
    checked_start,
    checked_start_velocity,
)
from taichi_dem.kit.effect_table import NEGLIGIBLE, Estimate
from taichi_dem.kit.engine_pool import power_of_two
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.likely_units import BOX, GRAIN, GRAIN_MASS, MODULUS, in_unit
from taichi_dem.kit.validation import (
    between,
    choice,
    flag,
    plain_fields,
    positive,
    shown,
    whole,
)

# Spheres part ever more slowly the stronger the dashpot, but none keeps them from parting.
_LEAST_RESTITUTION = 0.01
# Below, a modulus over 1 - poisson^2 has lost its digits; -1 itself has none.
_LEAST_POISSON = -0.999999

# Steps in a contact of two spheres that met at the speed of a fall through the box.
_STEPS_PER_CONTACT = 5.0

# Spheres of a box: steps grow with their number, memory with its scenes too.
_MOST_SPHERES = 1_000_000
#: Options whose number tells by its size when another unit is meant.
_QUANTITIES = {
    **{"young": MODULUS, "wall_young": MODULUS},
    **{"diameter": GRAIN, "width": BOX, "height": BOX},
}

# Room that rounding may take from a row of spheres that fits exactly.
_ROUNDING = 1e-9


@dataclass(frozen=True)
class Spheres:
    """Spheres of one size, or of several, in a box, by discrete elements (section 4 of the paper).

    Parameters
    ----------
    damping : str, default "tsuji"
        ``"tsuji"``: a dashpot with d^(1/4), d the overlap, for one restitution at every speed.
        ``"printed"``: with d^(1/2) as in eq. (3), for the restitution at ``reference_speed`` only.
    restitution : float, default 0.75
        Restitution coefficient between spheres, from 0.01 to 1; not in the paper, 0.75 is ours.
    wall_restitution : float, default 0.75
        Restitution coefficient between sphere and container, likewise.
    friction : float, default 0.5
        Friction coefficient between spheres.
    wall_friction : float, default 0.5
        Friction coefficient between sphere and container.
    reference_speed : float, default 0.5
        Speed at which ``"printed"`` has its restitution [m/s]. Not printed in the paper.
    young : float, default 500000000.0
        Young's modulus of the spheres [Pa].
    wall_young : float, default 500000000.0
        Young's modulus of the container [Pa].
    poisson : float, default 0.3
        Poisson's ratio of the spheres.
    wall_poisson : float, default 0.3
        Poisson's ratio of the container.
    diameter : float, default 0.006
        Diameter of a sphere [m]; with ``sizes`` it becomes the largest one.
    particle_mass : float, default 0.0002
        Mass of a sphere [kg]; with ``sizes`` the mean of all spheres, which are of one density.
    width : float, default 0.06
        Inner width of the box [m].
    height : float, default 0.096
        Inner height of the box [m].
    gravity : float or tuple of (float, float), default 9.8
        Gravity [m/s^2]: downwards, or (to the right, downwards), as for a box that is tilted.
    rotation : bool, default False
        Whether spheres rotate; the paper leaves it out.
    search : str, default "cells"
        ``"cells"``, or ``"all_pairs"`` as in the paper: the same bits, but slower above 10 spheres.
    start : array_like, optional
        Positions of the spheres from the lower left inner corner [m], (particles, 2); None: random.
    friction_law : str, default "viscous"
        ``"viscous"``: small slip creeps. ``"history"``: a spring each, which holds heaps at rest.
    sizes : sequence of (int, float), optional
        (number, diameter [m]) of each size; the box holds as many as there would be of the largest.
    start_velocity : array_like, optional
        Velocities of the spheres relative to the container [m/s], shape (particles, 2).
    """

    damping: str = "tsuji"
    restitution: float = 0.75
    wall_restitution: float = 0.75
    friction: float = 0.5
    wall_friction: float = 0.5
    reference_speed: float = 0.5
    young: float = 0.5e9
    wall_young: float = 0.5e9
    poisson: float = 0.3
    wall_poisson: float = 0.3
    diameter: float = 6e-3
    particle_mass: float = 0.2e-3
    width: float = 60e-3
    height: float = 96e-3
    gravity: float | tuple = 9.8
    rotation: bool = False
    search: str = "cells"
    start: tuple | None = None
    friction_law: str = "viscous"
    sizes: tuple | None = None
    start_velocity: tuple | None = None

    label: ClassVar[str] = "dem"
    default_dt: ClassVar[float] = 2e-5
    order: ClassVar[int] = 1

    def __post_init__(self) -> None:
        """InputError for a number or word outside its range."""
        plain_fields(self)
        if self.sizes is not None:
            object.__setattr__(self, "sizes", checked_sizes(self.sizes))
            object.__setattr__(self, "diameter", max(size for _, size in self.sizes))
        choice("damping", self.damping, POWERS)
        choice("friction_law", self.friction_law, FRICTION_LAWS)
        choice("search", self.search, SEARCHES)
        flag("rotation", self.rotation)
        for name in ("reference_speed", "young", "wall_young", "diameter", "particle_mass"):
            positive(name, getattr(self, name))
        for name in ("friction", "wall_friction"):
            positive(name, getattr(self, name), zero_allowed=True)
        object.__setattr__(self, "gravity", checked_gravity(self.gravity))
        for name in ("restitution", "wall_restitution"):
            between(name, getattr(self, name), _LEAST_RESTITUTION, 1.0)
        for name in ("poisson", "wall_poisson"):
            between(name, getattr(self, name), _LEAST_POISSON, 0.5)
        for name in ("width", "height"):
            value = positive(name, getattr(self, name))
            if value < self.diameter * (1.0 - _ROUNDING):
                raise InputError(
                    f"{name} must be at least the diameter {self.diameter}, got {value!r}"
                )
        self._check_capacity()
        for name, quantity in _QUANTITIES.items():
            in_unit(name, getattr(self, name), quantity)
        ball = math.pi / 6.0 * self.diameter**3
        in_unit("particle_mass", self.particle_mass, GRAIN_MASS, self.particle_mass / ball)
        if self.sizes is not None:
            whole("spheres in sizes", sum(count for count, _ in self.sizes), 1, self.capacity)
        if self.start is not None:
            object.__setattr__(self, "start", checked_start(self))
        if self.start_velocity is not None:
            object.__setattr__(self, "start_velocity", checked_start_velocity(self))

    @property
    def rubs(self) -> bool:
        """Whether there is any friction; without it none is compiled."""
        return self.friction > 0.0 or self.wall_friction > 0.0

    @property
    def remembers(self) -> bool:
        """Whether friction has a history."""
        return self.rubs and self.friction_law == "history"

    @property
    def effects(self) -> tuple[str, ...]:
        """Effects that are computed, in words for the report."""
        asked = {"friction": self.rubs, "rotation": self.rotation}
        return ("normal contact", *(name for name, there in asked.items() if there))

    def activated(self, particles: int) -> tuple["Spheres", tuple[Estimate, ...]]:
        """Return these spheres with the effects that a number of them calls for, and estimates.

        Notes
        -----
        Friction is computed unless its coefficients are zero; rotation unless it is negligible.
        """
        estimate = rotation_estimate(self, particles)
        chosen = replace(self, rotation=estimate.verdict != NEGLIGIBLE)
        return chosen, (estimate,)

    def left_out(self, particles: int) -> tuple[Estimate, ...]:
        """Estimates of the effects that are not computed."""
        found = () if self.rotation else (rotation_estimate(self, particles),)
        return (*found, air_estimate(self))

    @property
    def radius(self) -> float:
        """Radius of a sphere [m], the largest one of several sizes."""
        return 0.5 * self.diameter

    @property
    def radii(self) -> tuple[float, ...]:
        """Radius of the spheres of each size [m]."""
        return tuple(0.5 * size for _, size in self.sizes or ((1, self.diameter),))

    @property
    def masses(self) -> tuple[float, ...]:
        """Mass of a sphere of each size [kg], of one density."""
        if len(self.radii) == 1:
            return (self.particle_mass,)
        volumes = [(size / self.diameter) ** 3 for _, size in self.sizes or ()]
        counts = [count for count, _ in self.sizes or ()]
        mean = sum(map(mul, counts, volumes)) / sum(counts)
        return tuple(self.particle_mass * (volume / mean) for volume in volumes)

    @property
    def fall(self) -> tuple[float, float]:
        """Acceleration by gravity [m/s^2], to the right and downwards."""
        return gravity_across(self), gravity_along(self)

    @property
    def lattice(self) -> tuple[int, int]:
        """Columns and rows of the spheres that fit into the box in a square packing."""
        columns, rows = (int(x / self.diameter + _ROUNDING) for x in (self.width, self.height))
        return columns, rows

    @property
    def capacity(self) -> int:
        """Most spheres: those of the square packing."""
        return self.lattice[0] * self.lattice[1]

    def clearance(self, particles: int) -> float:
        """Distance from settled spheres to the lid [m].

        Parameters
        ----------
        particles : int
            Number of spheres.
        """
        whole("particles", particles, 0, 2**31 - 1)
        return self.height - self.diameter * particles / self.lattice[0]

    def with_clearance(self, particles: int, clearance: float) -> "Spheres":
        """Return a copy with a box as high as a clearance needs.

        Parameters
        ----------
        particles : int
            Number of settled spheres.
        clearance : float
            Distance from the settled spheres to the lid [m].
        """
        layers = whole("particles", particles, 0, 2**31 - 1) / self.lattice[0]
        free = positive("clearance", clearance, zero_allowed=True)
        return replace(self, height=self.diameter * layers + free)

    def check(self, particles: int, dt: float) -> None:
        """Refuse an invalid number of spheres or step [s]; too long a step diverges in the run."""
        whole("particles", particles, 0, self.capacity)
        positive("dt", dt)
        for name, what in (("start", "places"), ("start_velocity", "velocities")):
            given = getattr(self, name)
            if given is not None and particles != len(given):
                raise InputError(
                    f"particles must be {len(given)}, as many as {what} in {name}, got {particles}"
                )
        if self.sizes is not None and particles != sum(count for count, _ in self.sizes):
            total = sum(count for count, _ in self.sizes)
            raise InputError(f"particles must be {total}, as many as in sizes, got {particles}")

    def divergence(self, code: int, particles: int, dt: float) -> tuple[str, float]:
        """Meaning of a code of ``divergence_code``, and a step that avoids it [s]."""
        return DIVERGENCES[code], min(self.safe_step(), 0.5 * dt)

    def safe_step(self) -> float:
        """Step [s] that resolves the contact of two spheres that fell through the box."""
        smallest = min(range(len(self.radii)), key=self.radii.__getitem__)
        numbers = pair_numbers(self, smallest, smallest)
        across, down = self.fall
        drop = abs(across) * self.width + abs(down) * self.height
        speed = math.sqrt(2.0 * max(drop, self.height))
        duration = contact_duration(numbers["mass"], numbers["stiffness"], speed)
        return float(f"{duration / _STEPS_PER_CONTACT:.1e}")

    @property
    def step_bound(self) -> tuple[float, str]:
        """Step [s] to stay at or below, and why; see ``safe_step``."""
        return self.safe_step(), "five steps in a contact"

    @property
    def structure(self) -> FillingStructure:
        """Effects, laws and the search are compiled; numbers, box and places of start are not."""
        key = (self.damping, self.rubs, self.remembers, self.rotation, self.search)
        given = self.start is not None, self.start_velocity is not None
        # As many as go with the spheres of an engine, so that both find room or neither.
        pairs = listed_pairs(power_of_two(self.capacity, LEAST_PLACES))
        return FillingStructure(
            (*key, *given, len(self.radii)), {"spheres": self.capacity, "pairs": pairs}
        )

    def bind(self, table: SceneFields) -> DeviceFilling:
        """The spheres on the device, for all scenes of a table."""
        return DeviceSpheres(self, table)

    def _check_capacity(self) -> None:
        if self.capacity > _MOST_SPHERES:
            columns, rows = self.lattice
            raise InputError(
                f"width and height must hold at most {_MOST_SPHERES} spheres of the diameter "
                f"{self.diameter}, got {shown(columns)} x {shown(rows)}"
            )
