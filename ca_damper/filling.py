"""Interface of a filling of the container: its input is the motion, its output the load.

A filling is a frozen dataclass of a user's options (``Filling``). It binds itself to the scenes of
an engine (``DeviceFilling``), which then runs every batch of the same ``FillingStructure``.
"""

from collections.abc import Hashable
from dataclasses import dataclass, field
from typing import Any, Protocol, runtime_checkable

import numpy as np
import taichi as ti
from taichi.lang.util import to_numpy_type

from ca_damper.scenes.scene_fields import SceneFields
from taichi_dem.kit.allocation import assign
from taichi_dem.kit.checkpoint import identity_of
from taichi_dem.kit.display import counted
from taichi_dem.kit.effect_table import EffectUse, Estimate
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.field_memory import shape_of
from taichi_dem.kit.validation import shown


@ti.dataclass
class Motion:
    """The container at the beginning of a step, along x (up positive): x [m], v [m/s], a [m/s^2].

    a: by spring, dashpot, base and the mass carried in the step before, without its impacts.
    """

    x: ti.f64
    v: ti.f64
    a: ti.f64


@ti.dataclass
class Action:
    """Action of a filling on the container during a step.

    impulse: of the impacts, along x [N s]. carried: mass that moves as one with the container [kg].
    Over the step the container obeys
    (M + carried) x'' + C x' + K x = K y + C y' + impulse / dt - carried g.
    The mass is carried instead of last step's force, whose lag dt would damp like N m w^2 dt.
    """

    impulse: ti.f64
    carried: ti.f64


@ti.dataclass
class Blows:
    """Impacts of a filling on the container in a step, before any is carried out.

    impulse: of those on floor and ceiling, on a container that they would not move, along x [N s].
    struck: mass of what meets floor and ceiling [kg]. rubbed: of what side walls drag.
    """

    impulse: ti.f64
    struck: ti.f64
    rubbed: ti.f64
    carried: ti.f64


@ti.dataclass
class Recoil:
    """Response of a container to the impacts of a step, with all that moves with it.

    velocity: along x at the end of the step, after all blows on floors and ceilings [m/s]. share:
    sum of the rubbed masses, each times the speed that a unit impulse on it gives the container.
    """

    velocity: ti.f64
    share: ti.f64


#: Places of a scene that an engine has at least.
LEAST_PLACES = 256


@dataclass(frozen=True)
class FillingStructure:
    """Compiled structure of a filling; fillings of equal ``key`` share their compiled kernels.

    Parameters
    ----------
    key : Hashable
        Options that decide what is compiled.
    sizes : dict, optional
        Number of places that a scene needs, by name, for ``SceneFields.field``, those for particles
        first. An engine has more, so that smaller ones compile nothing.
    """

    key: Hashable
    sizes: dict[str, int] = field(default_factory=dict)


class Fillings:
    """The filling of each scene of a batch: of one class and compiled structure, of any numbers."""

    def __init__(self, given: Any, scenes: int):
        """Of one filling for all scenes, or a sequence with one for each; InputError."""
        each = given if isinstance(given, (list, tuple)) else [given]
        if each is given and len(given) != scenes:
            raise InputError(
                f"filling must be one, or one for each of {counted(scenes, 'scene')}, got "
                f"{counted(len(given), 'filling')}"
            )
        # By their words, as those of a user may be without a hash.
        own = {id(filling): filling for filling in each}
        own_words = {k: f"{type(own[k])} {identity_of(check_filling(own[k]))}" for k in own}
        words = [own_words[id(filling)] for filling in each]
        kinds = dict(zip(words, each))
        self.kinds, places = tuple(kinds.values()), {word: k for k, word in enumerate(kinds)}
        self.which = np.resize([places[word] for word in words], scenes)
        first = self.kinds[0]
        for filling in self.kinds:
            if (type(filling), filling.structure.key) != (type(first), first.structure.key):
                raise InputError(
                    "filling must be of one class, with the same rules and effects, in all scenes "
                    f"of a batch, got {_difference(first, filling)}"
                )

    @property
    def structure(self) -> "FillingStructure":
        """What is compiled, with room for the largest."""
        sizes = [filling.structure.sizes for filling in self.kinds]
        most = {name: max(size[name] for size in sizes) for name in sizes[0]}
        return FillingStructure(self.kinds[0].structure.key, most)

    def activated(self, particles: int) -> tuple["Fillings", tuple[Estimate, ...]]:
        """The fillings with the effects that are needed, and estimates of those decided on."""
        if not hasattr(self.kinds[0], "activated"):
            return self, ()
        chosen, estimates = zip(*(filling.activated(particles) for filling in self.kinds))
        if len({filling.structure.key for filling in chosen}) > 1:
            raise InputError(
                'effects must be "listed" where "auto" finds other effects in some fillings of a '
                "batch than in others, got 'auto'"
            )
        return Fillings([chosen[k] for k in self.which], len(self.which)), _largest(estimates)

    def left_out(self, particles: int) -> tuple[Estimate, ...]:
        """Estimates of the effects that are not computed."""
        kinds = [filling for filling in self.kinds if hasattr(filling, "left_out")]
        return _largest([filling.left_out(particles) for filling in kinds])

    @property
    def one(self) -> Any:
        """The filling of all scenes; InputError where they differ."""
        if len(self.kinds) > 1:
            raise InputError(
                "filling must be the same in all scenes of a batch for this, got "
                f"{len(self.kinds)} different ones"
            )
        return self.kinds[0]

    @property
    def identity(self) -> Any:
        """What tells them from others, for the identity of a checkpoint."""
        return self.kinds[0] if len(self.kinds) == 1 else (self.kinds, self.which)

    def of(self, s: int) -> Any:
        """The filling of a scene."""
        return self.kinds[self.which[s]]

    def of_scenes(self, value: Any) -> np.ndarray:
        """What a function finds of the filling of each scene, (scenes, ...)."""
        return np.array([value(filling) for filling in self.kinds])[self.which]

    def write(self, field: Any, value: Any) -> None:
        """Write what a function finds of each scene to a field, with zeros where it finds fewer."""
        values = [value(filling) for filling in self.kinds]
        if hasattr(field, "field_dict"):
            for name in values[0]:
                self._write(field.get_member_field(name), [numbers[name] for numbers in values])
        else:
            self._write(field, values)

    def _write(self, field, values):
        parts = [np.asarray(value) for value in values]
        rows = np.zeros((len(parts), *shape_of(field)[1:]), to_numpy_type(field.dtype))
        for k, part in enumerate(parts):
            place: tuple[Any, ...] = (k, *map(slice, part.shape))
            rows[place] = part
        assign(field, rows[self.which])


def _largest(estimates):
    """Of the estimates of each filling, in one order of the effects, the largest of each effect."""
    return tuple(max(of_one, key=lambda estimate: estimate.group) for of_one in zip(*estimates))


def _difference(first, second):
    """Two fillings in words, those of one class by the options in which they differ."""
    if type(first) is not type(second):
        return f"{type(first).__name__} and {type(second).__name__}"
    mine, others = vars(first), vars(second)
    names = [name for name in mine if identity_of(mine[name]) != identity_of(others[name])]
    return f"some that differ in {', '.join(names)}"


@runtime_checkable
class Filling(Protocol):
    """Interface of a filling of the container: options of a user, checked when they are made.

    Optional members: ``order``, that of the error in the step; ``activated(particles)``, the
    filling with the effects that at most so many particles call for and an Estimate of each that it
    decided on, and ``left_out(particles)``, an Estimate of each effect that it does not compute;
    ``clearance(particles)`` [m] and ``with_clearance(particles, clearance)``, for ``damper_map``;
    ``checked_range(driven)``, for the report and the warning before a run.
    """

    @property
    def label(self) -> str:
        """Short word for tables and CSV files, such as "ca_static"."""

    @property
    def default_dt(self) -> float:
        """Default step [s]."""

    @property
    def capacity(self) -> int:
        """Most particles that fit."""

    @property
    def particle_mass(self) -> float:
        """Mass of a particle [kg]."""

    @property
    def gravity(self) -> float | tuple:
        """Gravity on the particles [m/s^2]: downwards, or (to the right, downwards)."""

    @property
    def effects(self) -> tuple[str, ...]:
        """Effects that it computes, in words for the report."""

    @property
    def step_bound(self) -> tuple[float, str] | None:
        """Longest step that it allows or advises [s], and why; None for no limit."""

    @property
    def structure(self) -> FillingStructure:
        """What is compiled; fillings of a class and an equal structure share it."""

    def check(self, particles: int, dt: float) -> None:
        """Refuse a number of particles or a step that the filling cannot run."""

    def divergence(self, code: int, particles: int, dt: float) -> tuple[str, float]:
        """Meaning of a code of divergence, and a step that avoids it.

        Parameters
        ----------
        code : int
            Code of ``DeviceFilling.divergence_code``, from 1.
        particles : int
            Number of particles of the scene.
        dt : float
            Step [s].

        Returns
        -------
        tuple of (str, float)
            Words that follow "it", and a step [s].
        """

    def bind(self, table: SceneFields) -> "DeviceFilling":
        """Declare the fields of the filling for all scenes of a table; no field may be used yet."""


class DeviceFilling(Protocol):
    """A filling on the device, for all scenes of a table; data oriented.

    ``upload``, ``uses`` and ``snapshot`` are Python, the others ti.funcs. ``table.dt`` may change
    between two steps. ``first_steps(effects)``, in Python, may say when each effect first acted.

    A filling whose impacts depend on the recoil of the container splits ``advance``, so that boxes
    on one structure resolve their impacts together: ``find_blows(s, step, motion)`` returns Blows,
    and ``carry_out(s, step, motion, recoil)`` with a Recoil returns the Action.
    """

    def upload(self, fillings: Fillings) -> None:
        """Take over the numbers of the filling of each scene, all of the same structure."""

    def reset(self, s: int) -> None:
        """Place the particles of scene s at their start, from its seed."""

    def advance(self, s: int, step: int, motion: Motion) -> Action:
        """Take the particles of scene s over a step that starts with ``motion``."""

    def energy(self, s: int) -> float:
        """Kinetic and potential energy [J]; heights count from the container's floor."""

    def momentum(self, s: int) -> float:
        """Momentum along x [kg m/s]."""

    def divergence_code(self, s: int) -> int:
        """Code of divergence of a scene, from 1 up, or 0; evaluated every few steps."""

    def uses(self, effects: tuple[str, ...]) -> tuple[EffectUse, ...]:
        """Activity of each of the named effects, for those that can be counted."""

    def snapshot(self, s: int) -> dict[str, np.ndarray]:
        """Positions [m] from the lower left inner corner, velocities [m/s], (particles, 2) each."""


def check_filling(filling: object) -> Any:
    """Return the filling; InputError unless it has all members of the contract."""
    if isinstance(filling, type) or not isinstance(filling, Filling):
        raise InputError(
            "filling must be one such as Automaton(), Spheres() or RigidMass(), with all members "
            f"of ca_damper.filling.Filling, got {shown(filling)}"
        )
    return filling
