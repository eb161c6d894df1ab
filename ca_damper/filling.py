"""What a filling of the container is, and the two trivial ones: nothing, and a mass that is fixed.

A filling is a frozen dataclass of a user's options, checked when it is made. It has

``label``          short word for tables and CSV files, such as "ca_static"
``default_dt``     step to take unless the user asks for another [s]
``capacity``       most particles that fit
``particle_mass``  [kg]             ``gravity``  that acts on the particles [m/s^2], downwards
``effects``        what it computes, in words for the report
``step_bound``     longest step it allows or advises [s] and why, in words; None where any will do
``check(particles, dt)``            raises InputError for what the filling cannot do
``divergence(code, particles, dt)`` what a ``divergence_code`` means, in words that follow "it", and
                                    a step that would do [s]
``bind(table)``    the filling on the device, for all scenes of a SceneTable

What ``bind`` returns is data oriented and has the ti.funcs

``reset(s)``               place the particles of scene s anew, from its seed
``advance(s, step, motion)`` takes the filling over step number ``step`` (i32, counted from the
                           reset without a gap), in which the container starts with ``motion``;
                           returns an Action. The container takes the step after this call.
``energy(s)``              kinetic and potential energy of the particles [J], heights counted from
                           the container's floor
``momentum(s)``            momentum of the particles along x [kg m/s]
``divergence_code(s)``     0, or the code of a divergence, 1 and up; asked every few steps

and in Python ``uses(effects)``, an EffectUse for each of the named effects that can be counted, and
``snapshot(s)``, a dict with ``position`` [m] and ``velocity`` [m/s], both (particles, 2) as
(horizontal, vertical), positions from the container's lower left inner corner.
``table.dt`` may change between two steps, when a sweep goes on to its next frequency.
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import taichi as ti

from taichi_dem.kit.errors import InputError
from taichi_dem.kit.validation import positive, shown, whole


@ti.dataclass
class Motion:
    """The container at the beginning of a step, along x (up positive).

    x: displacement [m]. v: velocity [m/s]. a: acceleration [m/s^2] by spring, dashpot, base and
    the mass carried in the step before, without the blows of that step: they lasted an instant.
    """

    x: ti.f64
    v: ti.f64
    a: ti.f64


@ti.dataclass
class Action:
    """What a filling does to the container during a step.

    impulse: of the blows, along x [N s]. carried: mass that moves as one with the container [kg].
    Over the step the container obeys
    (M + carried) x'' + C x' + K x = K y + C y' + impulse / dt - carried g.
    A mass and not the force of a step ago: a force that lags by dt damps like N m w^2 dt.
    """

    impulse: ti.f64
    carried: ti.f64


#: What a filling must have to be one.
_MEMBERS = ("label", "default_dt", "capacity", "particle_mass", "gravity", "check", "bind")
#: Places for particles in all scenes of a batch: a hundred bytes each, and counted in 32 bits.
_MOST_PLACES = 2**25


def check_filling(filling):
    """The filling; InputError unless it is an object that has what a filling must have."""
    if isinstance(filling, type) or not all(hasattr(filling, name) for name in _MEMBERS):
        raise InputError(
            f"filling must be one such as Automaton(), Spheres() or RigidMass(), "
            f"got {shown(filling)}"
        )
    return filling


def check_places(scenes, places):
    """InputError where so many scenes with so many places for particles each find no room."""
    if scenes * places > _MOST_PLACES:
        raise InputError(
            f"scenes x places for particles must be at most {_MOST_PLACES} in one batch, got "
            f"{scenes} x {places}: run fewer scenes at a time"
        )


@dataclass(frozen=True)
class Empty:
    """A container without particles."""

    label: ClassVar[str] = "empty"
    effects: ClassVar[tuple] = ()
    step_bound: ClassVar[None] = None
    default_dt: ClassVar[float] = 1e-4
    capacity: ClassVar[int] = 0
    particle_mass: ClassVar[float] = 0.0
    gravity: ClassVar[float] = 9.8

    def check(self, particles, dt):
        """InputError unless there are no particles."""
        if particles != 0:
            raise InputError(f"particles must be 0 in an empty container, got {shown(particles)}")

    def divergence(self, code, particles, dt):
        """Nothing that could diverge; named because the protocol asks for it."""
        return "is empty", dt

    def bind(self, table):
        """Nothing on the device but the table."""
        return FixedMass(table, 0.0)


@dataclass(frozen=True)
class RigidMass:
    """Particles glued to the container: N m more mass and nothing else, exactly.

    particle_mass [kg], gravity [m/s^2].
    """

    particle_mass: float = 0.2e-3
    gravity: float = 9.8

    label: ClassVar[str] = "rigid"
    effects: ClassVar[tuple] = ("fixed mass",)
    step_bound: ClassVar[None] = None
    default_dt: ClassVar[float] = 1e-4
    capacity: ClassVar[int] = 1_000_000

    def __post_init__(self):
        positive("particle_mass", self.particle_mass)
        positive("gravity", self.gravity, zero_allowed=True)

    def check(self, particles, dt):
        """InputError for more than a million particles."""
        whole("particles", particles, 0, self.capacity)

    def divergence(self, code, particles, dt):
        """A fixed mass has no state that could diverge; named because the protocol asks for it."""
        return "is rigid", dt

    def bind(self, table):
        """The mass of a particle on the device."""
        return FixedMass(table, self.particle_mass)


@ti.data_oriented
class FixedMass:
    """Particles of a mass [kg] each that never leave the container's floor."""

    def __init__(self, table, particle_mass):
        self.table = table
        self.particle_mass = ti.field(ti.f64, shape=())
        self.particle_mass[None] = particle_mass
        self.velocity = ti.field(ti.f64, shape=table.count)

    @ti.func
    def mass(self, s):
        """Mass of all particles of scene s [kg]."""
        return self.table.particles[s] * self.particle_mass[None]

    @ti.func
    def reset(self, s):
        """At rest."""
        self.velocity[s] = 0.0

    @ti.func
    def advance(self, s, step, motion):
        """No blows; the whole mass is carried."""
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

    def uses(self, effects):
        """Nothing to count: a fixed mass acts in every step."""
        return ()

    def snapshot(self, s):
        """All particles on the floor, in the corner."""
        count = self.table.particles[s]
        velocity = np.column_stack([np.zeros(count), np.full(count, self.velocity[s])])
        return {"position": np.zeros((count, 2)), "velocity": velocity}
