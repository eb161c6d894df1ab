"""Options of the automaton."""

import functools
import itertools
from dataclasses import dataclass, replace
from typing import ClassVar

from ca_damper.automaton.conflict_resolution import MOST_CELLS
from ca_damper.automaton.device import LatticeDevice
from ca_damper.automaton.rules.contract import Rules
from ca_damper.automaton.rules.paper import Paper
from ca_damper.automaton.rules.place import Place
from ca_damper.filling import FillingStructure
from ca_damper.report.certificate import CheckedRange, Driven
from ca_damper.scenes.gravity import checked_gravity, gravity_across
from ca_damper.scenes.scene_fields import SceneFields
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.likely_units import GRAIN, GRAIN_MASS, in_unit
from taichi_dem.kit.validation import (
    choice,
    fraction,
    plain_fields,
    positive,
    shown,
    told_apart,
    whole,
)


def _refusing_options_of_rules(made: type) -> type:
    """The class, which answers an option of its rule sets with a sentence."""
    plain_init = made.__init__  # type: ignore[misc]

    @functools.wraps(plain_init)
    def init(self, *values, **options):
        for owner, name in itertools.product((Place, Paper), options):
            if name in owner.__dataclass_fields__:
                raise InputError(
                    f"{name} must be an option of the rules, got Automaton({name}="
                    f"{shown(options[name])}): pass rules={owner.__name__}({name}=...)"
                )
        plain_init(self, *values, **options)

    made.__init__ = init  # type: ignore[misc]
    return made


_BY_DEFAULT = Place()


@_refusing_options_of_rules
@dataclass(frozen=True)
class Automaton:
    """Particles as a cellular automaton, by rules of place or those of Komatsuzaki et al.

    One particle a cell of a triangular lattice; a particle changes its cell when it has travelled
    the width of one. Instances are immutable and checked when they are made.

    Parameters
    ----------
    rules : Place or Paper, default Place()
        How particles fly, meet, rest and act on the container: a rule set, of place by default.
    restitution : float, default 0.75
        Restitution coefficient between particles, from 0 to 1.
    wall_restitution : float, default 0.75
        Restitution coefficient between particle and wall, from 0 to 1.
    static_threshold : float, default 5.0
        Relative speed, as a factor of g dt, below which a particle rests on the heap.
    width : float, default 0.006
        Width of a cell, the diameter of a particle [m].
    columns : int, default 10
        Number of columns of cells inside the walls.
    rows : int, default 16
        Number of rows of cells inside the walls.
    particle_mass : float, default 0.0002
        Mass of a particle [kg].
    gravity : float or tuple of (float, float), default 10.0
        Gravity [m/s^2]: downwards, or (to the right, downwards), for rules of place only.
    v_max : float, default 5.0
        Largest particle speed to expect [m/s]. It bounds the step: dt < width / v_max.
    start : tuple of (int, int), optional
        (column, row) of every particle, from 0 at the lower left. None: drawn from the seed.
    traversal : str, default "list"
        ``"list"`` of particles or ``"scan"`` of all cells; both give the same bits.
    """

    rules: Rules = _BY_DEFAULT
    restitution: float = 0.75
    wall_restitution: float = 0.75
    static_threshold: float = 5.0
    width: float = 6e-3
    columns: int = 10
    rows: int = 16
    particle_mass: float = 0.2e-3
    gravity: float | tuple = 10.0
    v_max: float = 5.0
    start: tuple | None = None
    traversal: str = "list"

    #: The paper's step [s].
    default_dt: ClassVar[float] = 1e-4

    def __post_init__(self) -> None:
        plain_fields(self)
        if not isinstance(self.rules, Rules):
            raise InputError(
                "rules must be a rule set such as Place(friction=0.5) or Paper(), got "
                f"{shown(self.rules)}"
            )
        choice("traversal", self.traversal, ("list", "scan"))
        for name in ("restitution", "wall_restitution"):
            fraction(name, getattr(self, name))
        for name in ("width", "particle_mass", "v_max"):
            positive(name, getattr(self, name))
        in_unit("width", self.width, GRAIN)
        in_unit("particle_mass", self.particle_mass, GRAIN_MASS, self.particle_mass / self.width**3)
        positive("static_threshold", self.static_threshold, zero_allowed=True)
        object.__setattr__(self, "gravity", checked_gravity(self.gravity))
        if gravity_across(self) and self.rules.by_cells:
            raise InputError(
                f"gravity must be one number with rules {type(self.rules).__name__}(), whose "
                f"lattice stands along it, got {shown(self.gravity)}"
            )
        self._check_lattice()

    def _check_lattice(self) -> None:
        for name in ("columns", "rows"):
            whole(name, getattr(self, name), 1, MOST_CELLS)
        cells = (self.columns + 2) * (self.rows + 2)
        if cells >= MOST_CELLS:
            raise InputError(
                f"columns and rows must make fewer than {MOST_CELLS} cells with the walls, "
                f"got {self.columns} x {self.rows}"
            )
        if self.start is not None:
            object.__setattr__(self, "start", self._checked_start())

    def _checked_start(self) -> tuple:
        try:
            cells = tuple((column, row) for column, row in self.start or ())
        except (TypeError, ValueError):
            raise InputError(
                f"start must hold (column, row) of each particle, got {shown(self.start)}"
            ) from None
        for column, row in cells:
            whole("column in start", column, 0, self.columns - 1)
            whole("row in start", row, 0, self.rows - 1)
        if len(set(cells)) < len(cells):
            raise InputError(f"start must not name a cell twice, got {shown(self.start)}")
        return cells

    @property
    def label(self) -> str:
        """Short word for tables and files."""
        return self.rules.label

    @property
    def effects(self) -> tuple[str, ...]:
        """Effects that are computed, in words for the report."""
        return self.rules.effects

    @property
    def capacity(self) -> int:
        """Most particles that fit: one a cell."""
        return self.columns * self.rows

    @property
    def longest_dt(self) -> float:
        """Step that a particle at v_max would need for a whole cell [s]."""
        return self.width / self.v_max

    @property
    def order(self) -> int | None:
        """Order of the error in the step; without some of the impulses there is none."""
        return self.rules.order

    @property
    def step_bound(self) -> tuple[float, str]:
        """Longest step [s], and why."""
        return self.longest_dt, "a cell crossed at v_max"

    def clearance(self, particles: int) -> float:
        """Distance from settled particles to the lid [m].

        Parameters
        ----------
        particles : int
            Number of particles.
        """
        whole("particles", particles, 0, 2**31 - 1)
        return self.width * (self.rows - particles / self.columns)

    def with_clearance(self, particles: int, clearance: float) -> "Automaton":
        """Return a copy with a box as high as a clearance needs.

        Parameters
        ----------
        particles : int
            Number of settled particles.
        clearance : float
            Distance from the settled particles to the lid [m]; a whole number of cells.

        Raises
        ------
        InputError
            The box would end within a cell.
        """
        whole("particles", particles, 0, 2**31 - 1)
        rows = positive("clearance", clearance, True) / self.width + particles / self.columns
        if abs(rows - round(rows)) > 1e-6:
            got, _ = told_apart(rows, round(rows), 4)
            raise InputError(
                f"clearances above {particles} particles must leave whole cells of "
                f"{self.width:g} m, got {clearance:g}: {got} rows"
            )
        return replace(self, rows=round(rows))

    def check(self, particles: int, dt: float) -> None:
        """Refuse particles that do not fit, or a step that is not below width / v_max."""
        whole("particles", particles, 0, self.capacity)
        if self.start is not None and particles != len(self.start):
            raise InputError(
                f"particles must be {len(self.start)}, the cells named by start, got {particles}"
            )
        positive("dt", dt)
        if not dt < self.longest_dt:
            got, most = told_apart(dt, self.longest_dt, 6)
            raise InputError(
                f"dt must lie in (0, {most}) s, in which no particle crosses a cell "
                f"of {self.width:g} m at v_max = {self.v_max:g} m/s, got {got}"
            )

    def checked_range(self, driven: Driven) -> CheckedRange:
        """Range in which the rules were checked, and what of the scenes lies outside it."""
        return self.rules.range_of(self, driven)

    def divergence(self, code: int, particles: int, dt: float) -> tuple[str, float]:
        """Meaning of the code of ``divergence_code``, and a step that avoids it [s]."""
        words = "holds a particle faster than one cell a step", "has lost a particle from its box"
        return words[code - 1], 0.2 * dt

    @property
    def structure(self) -> FillingStructure:
        """Rules are compiled; numbers, the size of the lattice and the cells of start are not."""
        tilted = gravity_across(self) != 0.0
        key = (self.rules.compiled, self.traversal, self.start is None, tilted)
        # One more for the cell beyond the lattice.
        return FillingStructure(key, {"cells": (self.columns + 2) * (self.rows + 2) + 1})

    def bind(self, table: SceneFields) -> LatticeDevice:
        """The automaton on the device, for all scenes of a table."""
        return self.rules.device(self, table)
