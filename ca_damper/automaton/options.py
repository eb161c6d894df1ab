"""Options of the automaton."""

from dataclasses import dataclass, replace
from typing import ClassVar

from ca_damper.automaton.accounting import ACCOUNTINGS, Uncounted
from ca_damper.automaton.conflict_resolution import MOST_CELLS
from ca_damper.automaton.device import LatticeDevice
from ca_damper.automaton.known_range import range_of
from ca_damper.automaton.paper import PaperAutomaton
from ca_damper.automaton.place.device import PlaceAutomaton
from ca_damper.automaton.transport import READINGS
from ca_damper.filling import Structure
from ca_damper.report.certificate import CheckedRange, Driven
from ca_damper.scenes.gravity import checked_gravity, gravity_across
from ca_damper.scenes.scene_fields import SceneFields
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.likely_units import GRAIN, GRAIN_MASS, in_unit
from taichi_dem.kit.validation import (
    choice,
    flag,
    fraction,
    plain_fields,
    positive,
    shown,
    told_apart,
    whole,
)

RULES = ("paper", "place")
#: Options that only the rules of the paper have; the others want these values.
_OF_THE_PAPER = {"accounting": "all", "pair_rule": "both", "accumulator": "signed"}
#: Friction by the rules of place unless the user says otherwise, that of the spheres.
_FRICTION = 0.5


@dataclass(frozen=True)
class Automaton:
    """Particles as a cellular automaton, by rules of place or those of Komatsuzaki et al.

    One particle a cell of a triangular lattice; a particle changes its cell when it has travelled
    the width of one. Instances are immutable and checked when they are made.

    Parameters
    ----------
    accounting : str, default "all"
        Impulses that act on the container: ``"landing"`` (of particles that hit a wall after a
        change of cell), ``"landing+ejection"`` (also of those that a wall pushes along), ``"all"``,
        or another key of ``accounting.ACCOUNTINGS``.
    static_contact : bool, optional
        Whether particles come to rest on the floor and on the heap there, move with the container
        and weigh on it. None: True with accounting ``"all"``, False with the others.
    restitution : float, default 0.75
        Restitution coefficient between particles, from 0 to 1.
    wall_restitution : float, default 0.75
        Restitution coefficient between particle and wall, from 0 to 1.
    pair_rule : str, default "both"
        ``"both"``: both particles of a pair change and momentum along its line is conserved;
        ``"one_sided"``: as printed in the paper, each particle that looks at another changes alone.
    accumulator : str, default "signed"
        Effect of a turn on the distance travelled: ``"signed"``, ``"signed_through_walls"``,
        ``"reset"`` or ``"kept"``.
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
        Gravity [m/s^2]: downwards, or (to the right, downwards) for a box that lies or is tilted,
        for rules ``"place"`` only.
    v_max : float, default 5.0
        Largest particle speed to expect [m/s]. It bounds the step: dt < width / v_max.
    start : tuple of (int, int), optional
        (column, row) of every particle, counted from 0 at the lower left. None: cells are drawn
        from the seed of the scene.
    traversal : str, default "list"
        ``"list"`` of particles or ``"scan"`` of all cells; both give the same bits.
    rules : str, default "place"
        ``"place"``: particles fly in any direction, collide where their positions meet, and the
        container takes all impacts of a step together; accounting, pair_rule and accumulator must
        have their defaults. ``"paper"``: rules of the paper, to reproduce it; a UserWarning before
        a run says where they are known to fail.
    friction : float, optional
        Friction coefficient between particles, for rules ``"place"`` only. None: 0.5 there, no
        friction by the rules of the paper.
    wall_friction : float, optional
        Friction coefficient between particle and wall, likewise.

    References
    ----------
    Komatsuzaki, Sato, Iwata, Morishita, "Modeling of granular damper using cellular automata",
    section 5.
    """

    accounting: str = "all"
    static_contact: bool | None = None
    restitution: float = 0.75
    wall_restitution: float = 0.75
    pair_rule: str = "both"
    accumulator: str = "signed"
    static_threshold: float = 5.0
    width: float = 6e-3
    columns: int = 10
    rows: int = 16
    particle_mass: float = 0.2e-3
    gravity: float | tuple = 10.0
    v_max: float = 5.0
    start: tuple | None = None
    traversal: str = "list"
    rules: str = "place"
    friction: float | None = None
    wall_friction: float | None = None

    #: The paper's step [s].
    default_dt: ClassVar[float] = 1e-4

    def __post_init__(self) -> None:
        plain_fields(self)
        choice("accounting", self.accounting, ACCOUNTINGS)
        choice("pair_rule", self.pair_rule, ("both", "one_sided"))
        choice("accumulator", self.accumulator, READINGS)
        choice("traversal", self.traversal, ("list", "scan"))
        choice("rules", self.rules, RULES)
        for name in ("restitution", "wall_restitution"):
            fraction(name, getattr(self, name))
        for name in ("width", "particle_mass", "v_max"):
            positive(name, getattr(self, name))
        in_unit("width", self.width, GRAIN)
        in_unit("particle_mass", self.particle_mass, GRAIN_MASS, self.particle_mass / self.width**3)
        positive("static_threshold", self.static_threshold, zero_allowed=True)
        object.__setattr__(self, "gravity", checked_gravity(self.gravity))
        if self.static_contact is not None:
            flag("static_contact", self.static_contact)
        self._check_rules()
        self._check_lattice()

    def _check_rules(self) -> None:
        if gravity_across(self) and self.rules != "place":
            raise InputError(
                f"gravity must be one number with rules {self.rules!r}, whose lattice stands along "
                f"it, got {shown(self.gravity)}"
            )
        for name in ("friction", "wall_friction"):
            value = getattr(self, name)
            if value is not None:
                positive(name, value, zero_allowed=True)
                if self.rules != "place":
                    raise InputError(
                        f"{name} must be None with rules {self.rules!r}, whose impacts have no "
                        f"friction, got {value:g}"
                    )
        for name, value in _OF_THE_PAPER.items():
            if self.rules == "place" and getattr(self, name) != value:
                raise InputError(
                    f"{name} must be {value!r} with rules 'place', which leave no choice, got "
                    f"{getattr(self, name)!r}: pass rules='paper' for the rules that do"
                )

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
    def _accounting(self) -> type[Uncounted]:
        return ACCOUNTINGS[self.accounting]

    @property
    def particles_rest(self) -> bool:
        """Whether there is static contact."""
        asked = self.static_contact
        return self._accounting.static_contact if asked is None else asked

    @property
    def frictions(self) -> tuple[float, float]:
        """Friction coefficients between particles and at the wall; 0 by the paper's rules."""
        usual = _FRICTION if self.rules == "place" else 0.0
        asked = (self.friction, self.wall_friction)
        between, at_wall = (usual if value is None else value for value in asked)
        return between, at_wall

    @property
    def label(self) -> str:
        """Short word for tables and files."""
        if self.rules == "place":
            return "ca_place" if self.particles_rest else "ca_place_no_rest"
        return self._accounting.labels[self.particles_rest]

    @property
    def effects(self) -> tuple[str, ...]:
        """Effects that are computed, in words for the report."""
        resting = ("static contact",) if self.particles_rest else ()
        if self.rules == "place":
            return ("pairs", "landing", *resting)
        return ("pairs", "landing", *self._accounting.effects, *resting)

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
        return 1 if self.accounting == "all" else None

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
        return range_of(self, driven)

    def divergence(self, code: int, particles: int, dt: float) -> tuple[str, float]:
        """Meaning of the code of ``divergence_code``, and a step that avoids it [s]."""
        words = "holds a particle faster than one cell a step", "has lost a particle from its box"
        return words[code - 1], 0.2 * dt

    @property
    def structure(self) -> Structure:
        """Rules are compiled; numbers, the size of the lattice and the cells of start are not."""
        rules = self.rules, self._accounting, self.pair_rule, self.accumulator
        tilted = gravity_across(self) != 0.0
        key = (*rules, self.particles_rest, self.traversal, self.start is None, tilted)
        # One more for the cell beyond the lattice.
        return Structure(key, {"cells": (self.columns + 2) * (self.rows + 2) + 1})

    def bind(self, table: SceneFields) -> LatticeDevice:
        """The automaton on the device, for all scenes of a table."""
        return (PlaceAutomaton if self.rules == "place" else PaperAutomaton)(self, table)
