"""The two trivial fillings: nothing, and a mass that is fixed to the container."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import taichi as ti

from ca_damper.filling import Action, Fillings, FillingStructure
from ca_damper.scenes.scene_fields import SceneFields
from taichi_dem.kit.effect_table import EffectUse
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.validation import plain_fields, positive, shown, whole


class _Fixed:
    """What both have in common: nothing moves in the container."""

    step_bound: ClassVar[None] = None
    order: ClassVar[int] = 1
    default_dt: ClassVar[float] = 1e-4

    def divergence(self, code: int, particles: int, dt: float) -> tuple[str, float]:
        return "is fixed", dt

    @property
    def structure(self) -> FillingStructure:
        return FillingStructure(())

    def bind(self, table: SceneFields) -> "FixedMass":
        return FixedMass(table)


@dataclass(frozen=True)
class Empty(_Fixed):
    """A container without particles."""

    label: ClassVar[str] = "empty"
    effects: ClassVar[tuple] = ()
    capacity: ClassVar[int] = 0
    particle_mass: ClassVar[float] = 0.0
    gravity: ClassVar[float] = 9.8

    def check(self, particles: int, dt: float) -> None:
        """InputError unless there are no particles."""
        if particles != 0:
            raise InputError(f"particles must be 0 in an empty container, got {shown(particles)}")


@dataclass(frozen=True)
class RigidMass(_Fixed):
    """Particles glued to the container: N m more mass and nothing else, exactly.

    Parameters
    ----------
    particle_mass : float, default 0.0002
        Mass of a particle [kg].
    gravity : float, default 9.8
        Gravity, downwards [m/s^2].
    """

    particle_mass: float = 0.2e-3
    gravity: float = 9.8

    label: ClassVar[str] = "rigid"
    effects: ClassVar[tuple] = ("fixed mass",)
    capacity: ClassVar[int] = 1_000_000

    def __post_init__(self) -> None:
        plain_fields(self)
        positive("particle_mass", self.particle_mass)
        positive("gravity", self.gravity, zero_allowed=True)

    def check(self, particles: int, dt: float) -> None:
        """InputError for more than a million particles."""
        whole("particles", particles, 0, self.capacity)


@ti.data_oriented
class FixedMass:
    """Particles of a mass [kg] each that never leave the container's floor."""

    def __init__(self, table: SceneFields):
        self.table = table
        self.particle_mass, self.velocity = table.field(ti.f64), table.field(ti.f64)

    def upload(self, fillings: Fillings) -> None:
        """Take over the mass of a particle of each scene."""
        fillings.write(self.particle_mass, lambda filling: filling.particle_mass)

    @ti.func
    def mass(self, s):
        """Mass of all particles of scene s [kg]."""
        return self.table.particles[s] * self.particle_mass[s]

    @ti.func
    def reset(self, s):
        """At rest."""
        self.velocity[s] = 0.0

    @ti.func
    def advance(self, s, step, motion):
        """No impacts; the whole mass is carried."""
        self.velocity[s] = motion.v
        return Action(0.0, self.mass(s))

    @ti.func
    def energy(self, s):
        """Kinetic energy at the start of the last step [J]; the height is zero."""
        return 0.5 * self.mass(s) * self.velocity[s] * self.velocity[s]

    @ti.func
    def momentum(self, s):
        """Momentum at the start of the last step [kg m/s]."""
        return self.mass(s) * self.velocity[s]

    @ti.func
    def divergence_code(self, s):
        """Always fine."""
        return 0

    def uses(self, effects: tuple[str, ...]) -> tuple[EffectUse, ...]:
        """Nothing to count: a fixed mass acts in every step."""
        return ()

    def snapshot(self, s: int) -> dict[str, np.ndarray]:
        """All particles on the floor, in the corner."""
        count = self.table.particles[s]
        velocity = np.column_stack([np.zeros(count), np.full(count, self.velocity[s])])
        return {"position": np.zeros((count, 2)), "velocity": velocity}
