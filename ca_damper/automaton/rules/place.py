"""Rules of place: grains collide where their positions meet; options, range, and the device."""

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import taichi as ti

from ca_damper.automaton.device import LatticeDevice
from ca_damper.automaton.lattice import UP
from ca_damper.automaton.place.blows import Collisions
from ca_damper.automaton.place.contacts import GrainContacts
from ca_damper.automaton.place.grains import GrainCells, Heap
from ca_damper.automaton.place.transport import Transport
from ca_damper.automaton.rules.contract import Rules
from ca_damper.report.certificate import CheckedRange, Driven
from ca_damper.scenes.gravity import gravity_across
from ca_damper.scenes.scene_fields import SceneFields
from taichi_dem.kit.validation import flag, plain_fields, positive

_G = 9.81
_CHECKED = (
    "1 to 50 grains, 0.8 to 8 g, restitution up to 0.9: impedance within 20 % of that of spheres "
    "at four of five points, worst at five and ten grains; loss within 4 % in the median, 40 % at "
    "worst"
)


@ti.data_oriented
class PlaceDevice(LatticeDevice):
    """Grains fly in any direction, and collide where their positions meet."""

    def __init__(self, automaton: object, table: SceneFields):
        super().__init__(automaton, table, looks_ahead=False)
        tilted = gravity_across(automaton) != 0.0
        grains = GrainCells(self.lattice, self.parameters, automaton.traversal == "list")
        heap = Heap(grains, None, automaton.rules.static_contact)
        self.fill(automaton, grains, heap, UP)
        self.transport = Transport(grains, tilted)
        self.collisions = automaton.rules.collisions(GrainContacts(heap), self.event_counts, tilted)

    @ti.func
    def find_blows(self, s, step, motion):
        """First part of a step; returns the blows on the container."""
        self.meet(s, step, motion)
        return self.collisions.blows(s)

    @ti.func
    def energy(self, s):
        """Kinetic and potential energy [J]; held grains move as the container did last."""
        total, sideways = 0.0, self.parameters.sideways[s] * self.parameters.width[s]
        for cell in range(self.lattice.size.cells[s]):
            if self.cells.is_grain(s, cell):
                velocity = self.cells.velocity(s, cell)
                height = self.cells.height(s, cell) - self.cells.offset[s]
                total += 0.5 * velocity.dot(velocity) + self.parameters.gravity[s] * height
                total -= sideways * self.lattice.column_of(s, cell)
        return self.parameters.mass[s] * total

    @ti.func
    def divergence_code(self, s):
        """1 when a grain would cross more than one cell a step, which no rule allows."""
        # 2: others pushed a grain beyond floor or ceiling more often than it could turn over there.
        fastest, farthest, width = 0.0, 0.0, self.parameters.width[s]
        for cell in range(self.lattice.size.cells[s]):
            across = ti.abs(self.cells.across[s, cell])
            fastest = ti.max(fastest, ti.abs(self.cells.speed[s, cell]), across)
            if self.cells.is_grain(s, cell):
                farthest = ti.max(farthest, self.outside(s, cell))
        result = 0 if fastest * self.table.dt[s] < width else 1
        return 2 if farthest > width else result

    @ti.func
    def outside(self, s, cell):
        """By how much a grain is farther out than those at floor and ceiling can be [m]."""
        most = ti.cast(self.lattice.size.rows[s], ti.f64) * self.parameters.width[s]
        height = self.cells.height(s, cell) - self.cells.offset[s]
        return ti.max(-height, height - most)

    def motion_of(self, s: int, kind: np.ndarray, travelled: np.ndarray, speed: np.ndarray) -> Any:
        """Places off the centres of cells, and velocities; grains stand amid their columns."""
        across = self.table.row(self.cells.across, s)[: len(kind)]
        offset = float(self.table.row(self.cells.offset, s))
        shift = np.where(kind == UP, travelled - offset, 0.0)
        return np.column_stack([np.zeros(len(kind)), shift]), np.column_stack([across, speed])


@dataclass(frozen=True)
class Place(Rules):
    """Rules of place: particles fly in any direction, and collide where their positions meet.

    The container takes all impacts of a step together.

    Parameters
    ----------
    friction : float, default 0.5
        Friction coefficient between particles.
    wall_friction : float, default 0.5
        Friction coefficient between particle and wall.
    static_contact : bool, default True
        Whether particles come to rest on floor and heap, move with the container and weigh on it.
    """

    friction: float = 0.5
    wall_friction: float = 0.5
    static_contact: bool = True

    device: ClassVar = PlaceDevice
    #: Class that carries out the impacts of a step.
    collisions: ClassVar = Collisions

    def __post_init__(self) -> None:
        plain_fields(self)
        for name in ("friction", "wall_friction"):
            positive(name, getattr(self, name), zero_allowed=True)
        flag("static_contact", self.static_contact)

    @property
    def label(self) -> str:
        """By static contact."""
        return "ca_place" if self.static_contact else "ca_place_no_rest"

    @property
    def effects(self) -> tuple[str, ...]:
        """All impacts, and static contact if asked for."""
        return ("pairs", "landing", *(("static contact",) if self.static_contact else ()))

    @property
    def numbers(self) -> dict[str, float]:
        """Both coefficients."""
        return {"friction": self.friction, "wall_friction": self.wall_friction}

    def known_range(self, automaton: object, driven: Driven) -> CheckedRange:
        """The range, and what was not checked or is known to be off."""
        return CheckedRange(_CHECKED, tuple(_beyond(automaton, driven)))


def _beyond(automaton, driven):
    """What was not checked of the rules of place, or is known to be off."""
    some = driven.particles > 0
    most, moved = driven.particles.max(initial=0), some & (driven.amplitude > 0.0)
    if most > 50:
        yield f"{most} grains, more than 50"
    levels = driven.acceleration[moved] / _G
    for level in {levels.min(initial=0.8), levels.max(initial=8.0)}.difference({0.8, 8.0}):
        yield f"a motion of {level:.2g} g"
    if some.any() and gravity_across(automaton):
        yield (
            "gravity across the columns (a box on its side: loss within 5 % of that of spheres "
            "in the median of 135 points, 32 % at nine of ten, 76 % at worst, with beds of "
            "several layers, which interlock)"
        )
    highest = max(automaton.restitution, automaton.wall_restitution)
    if some.any() and highest > 0.9:
        yield (
            f"restitution {highest:g}, above 0.9 (of 1 without friction, two grains keep their "
            "energy in 3 s, five 0.5 to 0.9 of it, twenty 0.16 to 0.22, spheres 0.999)"
        )
