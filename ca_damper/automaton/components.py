"""Components that the rules of an automaton share."""

from dataclasses import dataclass
from typing import Any

import taichi as ti

from ca_damper.automaton.accounting import ACCOUNTINGS, Accounting
from ca_damper.automaton.accumulator import Accumulator
from ca_damper.automaton.conflict_resolution import ConflictResolution
from ca_damper.automaton.event_counts import EventCounts
from ca_damper.automaton.impulse_balance import ImpulseBalance, NoImpulseBalance
from ca_damper.automaton.lattice import Lattice
from ca_damper.automaton.state import Cells
from ca_damper.automaton.static_contact import NoStaticContact, StaticContact
from ca_damper.automaton.traversal import traversal_of
from ca_damper.scenes.scene_fields import SceneFields
from taichi_dem.kit.allocation import assign


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
        friction, wall_friction = options.frictions
        for field, value in (
            (self.width, options.width),
            (self.mass, options.particle_mass),
            (self.gravity, options.gravity),
            (self.particle, options.restitution),
            (self.wall, options.wall_restitution),
            (self.threshold, options.static_threshold),
            (self.friction, friction),
            (self.wall_friction, wall_friction),
        ):
            assign(field, value)


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
