"""The rules of the paper (Komatsuzaki et al., section 5): options, range, and the device."""

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import taichi as ti

from ca_damper.automaton.accounting import ACCOUNTINGS, Accounting
from ca_damper.automaton.cells import Cells
from ca_damper.automaton.device import LatticeDevice
from ca_damper.automaton.lattice import DIRECTIONS, DOWN, EMPTY, HELD, WALL, unit_vectors
from ca_damper.automaton.paper.collisions import PaperCollisions
from ca_damper.automaton.paper.transport import READINGS, Accumulator, PaperTransport
from ca_damper.automaton.rules.contract import Rules
from ca_damper.automaton.static_contact import StaticContact
from ca_damper.report.certificate import CheckedRange, Driven
from ca_damper.scenes.scene_fields import SceneFields
from taichi_dem.kit.validation import choice, flag, plain_fields

_G = 9.81
_CHECKED = (
    "11 to 50 grains of at most 0.1 of the container's mass, gravity, restitution from 0.5 on, "
    "motions above 1 g and half a cell: peaks at resonance within 3 % of spheres"
)


@ti.data_oriented
class PaperDevice(LatticeDevice):
    """Particles fly in six directions, at most a cell a step, and collide with what is ahead."""

    def __init__(self, automaton: object, table: SceneFields):
        super().__init__(automaton, table, looks_ahead=True)
        rules = automaton.rules
        accounting = Accounting(rules.accounting, self.lattice)
        accumulator = Accumulator(rules.accumulator, self.lattice)
        listed = automaton.traversal == "list"
        cells = Cells(self.lattice, self.parameters, listed, accounting)
        resting = StaticContact(cells, accumulator, rules.particles_rest)
        self.fill(automaton, cells, resting, DOWN)
        self.transport = PaperTransport(resting, accounting, self.event_counts)
        self.collisions = PaperCollisions(self.transport, rules.pair_rule == "both")

    @ti.func
    def energy(self, s):
        """Kinetic and potential energy [J]; held particles move as the container did last."""
        total = 0.0
        for cell in range(self.lattice.size.cells[s]):
            kind = self.cells.at(s, cell)
            if kind != EMPTY and kind != WALL:
                speed = self.velocity[s] if kind == HELD else self.cells.speed[s, cell]
                height = self.lattice.height_of(s, cell) * self.parameters.width[s]
                height += self.cells.travelled[s, cell] * self.lattice.upward(kind)
                total += 0.5 * speed * speed + self.parameters.gravity[s] * height
        return self.parameters.mass[s] * total

    @ti.func
    def divergence_code(self, s):
        """1 when a particle would cross more than one cell a step, which no rule allows."""
        fastest = 0.0
        for cell in range(self.lattice.size.cells[s]):
            fastest = max(fastest, self.cells.speed[s, cell])
        return 0 if fastest * self.table.dt[s] < self.parameters.width[s] else 1

    def motion_of(self, s: int, kind: np.ndarray, travelled: np.ndarray, speed: np.ndarray) -> Any:
        """Places off the centres of cells, and velocities, along the direction of each particle."""
        direction = np.zeros((len(kind), 2))
        direction[kind < DIRECTIONS] = unit_vectors()[kind[kind < DIRECTIONS]]
        return direction * travelled[:, None], direction * speed[:, None]


@dataclass(frozen=True)
class Paper(Rules):
    """Rules of Komatsuzaki et al., to reproduce the paper.

    Particles fly in six directions and collide with what is in the cell ahead.

    Parameters
    ----------
    accounting : str, default "all"
        Impulses that act on the container: ``"landing"`` (of particles that hit a wall after a
        change of cell), ``"landing+ejection"`` (also of those that a wall pushes along), ``"all"``,
        also what the six directions of the lattice take.
    static_contact : bool, optional
        Whether particles come to rest on the floor and on the heap there, move with the container
        and weigh on it. None: True with accounting ``"all"``, False with the others.
    pair_rule : str, default "both"
        ``"both"``: both particles of a pair change and momentum along its line is conserved;
        ``"one_sided"``: as printed in the paper, each particle that looks at another changes alone.
    accumulator : str, default "signed"
        Effect of a turn on the distance travelled: ``"signed"``, ``"signed_through_walls"``,
        ``"reset"`` or ``"kept"``.

    References
    ----------
    Komatsuzaki, Sato, Iwata, Morishita, section 5.
    """

    accounting: str = "all"
    static_contact: bool | None = None
    pair_rule: str = "both"
    accumulator: str = "signed"

    device: ClassVar = PaperDevice
    by_cells: ClassVar[bool] = True

    def __post_init__(self) -> None:
        plain_fields(self)
        choice("accounting", self.accounting, ACCOUNTINGS)
        choice("pair_rule", self.pair_rule, ("both", "one_sided"))
        choice("accumulator", self.accumulator, READINGS)
        if self.static_contact is not None:
            flag("static_contact", self.static_contact)

    @property
    def particles_rest(self) -> bool:
        """As asked for, or where all impulses count."""
        return self.accounting == "all" if self.static_contact is None else self.static_contact

    @property
    def label(self) -> str:
        """By accounting and static contact."""
        return ACCOUNTINGS[self.accounting][self.particles_rest]

    @property
    def effects(self) -> tuple[str, ...]:
        """Effects by accounting and static contact."""
        ejection = () if self.accounting == "landing" else ("ejection",)
        return (
            "pairs",
            "landing",
            *ejection,
            *(("static contact",) if self.particles_rest else ()),
        )

    @property
    def order(self) -> int | None:
        """Without some of the impulses there is none."""
        return 1 if self.accounting == "all" else None

    def known_range(self, automaton: object, driven: Driven) -> CheckedRange:
        """The range, with a warning before a run outside of it."""
        outside = tuple(_beyond(automaton, driven))
        warning = (
            f"rules 'paper' of the automaton are known to fail with {'; with '.join(outside)}: use "
            "rules=Place(), the default"
        )
        return CheckedRange(_CHECKED, outside, warning if outside else "")


def _beyond(automaton, driven):
    """Where the rules of the paper are known to fail, with a figure each."""
    some = driven.particles > 0
    heaviest = automaton.particle_mass / driven.mass[some].min(initial=np.inf)
    fewest = driven.particles[some].min(initial=11)
    if heaviest > 0.1:
        yield (
            f"a grain of {heaviest:.3g} of the container's mass, above 0.1 (one of 0.2 makes "
            "the energy grow 36-fold)"
        )
    if fewest <= 10:
        yield (
            f"{fewest} grain{'' if fewest == 1 else 's'}, ten or fewer (one is off by up to "
            "824 % in 76 published cases)"
        )
    if some.any() and automaton.gravity == 0.0:
        yield "no gravity (40 grains at 6 Hz and 20 mm lose eight times too much)"
    yield from _beyond_motions(automaton, driven, some & (driven.amplitude > 0.0))
    least = min(automaton.restitution, automaton.wall_restitution)
    if some.any() and least < 0.5:
        yield f"restitution {least:g}, below 0.5"


def _beyond_motions(automaton, driven, moved):
    """Motions of a driven container too small for the lattice; moved: scenes, (scenes,)."""
    slow = driven.acceleration[moved].min(initial=np.inf) / _G
    small, cell = driven.amplitude[moved].min(initial=np.inf), automaton.width
    if slow < 1.0:
        yield (
            f"a motion of {slow:.2g} g, below 1 g (at 0.6 g and 12 Hz the loss is 0.07 of N m w, "
            "not 0)"
        )
    if small < 0.5 * cell:
        yield (
            f"a motion of {1e3 * small:.2g} mm, below half a cell of {1e3 * cell:g} mm (at 2 g and "
            "25 Hz the loss is 0.20 of N m w, not 0.57)"
        )
