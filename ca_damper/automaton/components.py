"""Components that the rules of an automaton share."""

from dataclasses import dataclass
from typing import Any

import taichi as ti

from ca_damper.automaton.accounting import ACCOUNTINGS, Accounting
from ca_damper.automaton.accumulator import Accumulator
from ca_damper.automaton.conflict_resolution import ConflictResolution
from ca_damper.automaton.event_counts import EventCounts
from ca_damper.automaton.impulse_balance import ImpulseBalance, NoImpulseBalance
from ca_damper.automaton.state import Cells
from ca_damper.automaton.static_contact import NoStaticContact, StaticContact
from ca_damper.automaton.traversal import traversal_of
from ca_damper.lattice import Lattice
from ca_damper.scenes.scene_fields import SceneFields


@ti.data_oriented
class Parameters:
    """Parameters that kernels read; in fields, so that another value compiles nothing.

    width of a cell [m], mass of a particle [kg], gravity [m/s^2], restitution of particle and wall;
    threshold of static contact in units of g dt; friction of two particles, and wall_friction.
    """

    def __init__(self):
        for name in ("width", "mass", "gravity", "particle", "wall", "threshold"):
            setattr(self, name, ti.field(ti.f64, shape=()))
        for name in ("friction", "wall_friction"):
            setattr(self, name, ti.field(ti.f64, shape=()))

    def load(self, options: Any) -> None:
        """Take the values from the options."""
        self._load(options.width, options.particle_mass, options.gravity)
        self._load_collisions(
            options.restitution, options.wall_restitution, options.static_threshold
        )
        self._load_friction(*options.frictions)

    @ti.kernel
    def _load(self, width: ti.f64, mass: ti.f64, gravity: ti.f64):
        self.width[None], self.mass[None], self.gravity[None] = width, mass, gravity

    @ti.kernel
    def _load_collisions(self, particle: ti.f64, wall: ti.f64, threshold: ti.f64):
        self.particle[None], self.wall[None] = particle, wall
        self.threshold[None] = threshold

    @ti.kernel
    def _load_friction(self, friction: ti.f64, wall_friction: ti.f64):
        self.friction[None], self.wall_friction[None] = friction, wall_friction


@dataclass(frozen=True, eq=False)
class Components:
    """State and choices of an automaton, put together by ``assemble``."""

    parameters: Parameters
    lattice: Lattice
    cells: Cells
    conflict_resolution: ConflictResolution
    accumulator: Accumulator
    accounting: Accounting
    resting: object
    impulse_balance: object
    event_counts: EventCounts


def assemble(options: Any, table: SceneFields) -> Components:
    """Components for a user's options; those left out are neither stored nor evaluated."""
    lattice, parameters = Lattice(table), Parameters()
    traversal = traversal_of(options, lattice, table)
    impulse_balance = ImpulseBalance(table) if options.ledger else NoImpulseBalance()
    accounting = ACCOUNTINGS[options.accounting](table, lattice, impulse_balance)
    cells = Cells(table, lattice, traversal, accounting)
    accumulator = Accumulator(options.accumulator, lattice)
    resting: Any = NoStaticContact()
    if options.particles_rest:
        resting = StaticContact(table, cells, accumulator, parameters)
    return Components(
        parameters=parameters,
        lattice=lattice,
        cells=cells,
        conflict_resolution=ConflictResolution(table, lattice),
        accumulator=accumulator,
        accounting=accounting,
        resting=resting,
        impulse_balance=impulse_balance,
        event_counts=EventCounts(table),
    )
