"""Components that the rules of an automaton share."""

from dataclasses import dataclass

import taichi as ti

from ca_damper.automaton.accounting import AllImpulses, Landings
from ca_damper.automaton.accumulator import Accumulator
from ca_damper.automaton.conflict_resolution import ConflictResolution
from ca_damper.automaton.event_counts import EventCounts
from ca_damper.automaton.impulse_balance import ImpulseBalance, NoImpulseBalance
from ca_damper.automaton.state import Cells
from ca_damper.automaton.static_contact import NoStaticContact, StaticContact
from ca_damper.automaton.traversal import ParticleList, Scan
from ca_damper.lattice import Geometry, Lattice


@ti.data_oriented
class Parameters:
    """Parameters that kernels read; in fields, so that another value compiles nothing anew.

    width of a cell [m], mass of a particle [kg], gravity [m/s^2], restitution of particle and wall;
    threshold of static contact in units of g dt.
    """

    def __init__(self, options):
        self.options = options
        for name in ("width", "mass", "gravity", "particle", "wall", "threshold"):
            setattr(self, name, ti.field(ti.f64, shape=()))

    def load(self):
        """Take the values from the options."""
        options = self.options
        self._load(options.width, options.particle_mass, options.gravity)
        self._load_collisions(
            options.restitution, options.wall_restitution, options.static_threshold
        )

    @ti.kernel
    def _load(self, width: ti.f64, mass: ti.f64, gravity: ti.f64):
        self.width[None], self.mass[None], self.gravity[None] = width, mass, gravity

    @ti.kernel
    def _load_collisions(self, particle: ti.f64, wall: ti.f64, threshold: ti.f64):
        self.particle[None], self.wall[None] = particle, wall
        self.threshold[None] = threshold


@dataclass(frozen=True, eq=False)
class Components:
    """State and choices of an automaton, put together by ``assemble``."""

    parameters: Parameters
    lattice: Lattice
    cells: Cells
    conflict_resolution: ConflictResolution
    accumulator: Accumulator
    accounting: object
    resting: object
    impulse_balance: object
    event_counts: EventCounts


def assemble(options, table):
    """Components for a user's options; those left out are neither stored nor evaluated."""
    scenes = table.count
    static = options.accounting == "static"
    lattice = Lattice(Geometry(options.columns, options.rows))
    traversal = (Scan if options.traversal == "scan" else ParticleList)(lattice, table)
    impulse_balance = ImpulseBalance(scenes) if options.ledger else NoImpulseBalance()
    accounting = AllImpulses()
    if not static:
        pushes = options.accounting == "landing+ejection"
        accounting = Landings(lattice, scenes, impulse_balance, pushes)
    cells = Cells(lattice, traversal, accounting, scenes)
    parameters = Parameters(options)
    accumulator = Accumulator(options.accumulator, lattice)
    resting = NoStaticContact()
    if static:
        resting = StaticContact(cells, accumulator, parameters)
    return Components(
        parameters=parameters,
        lattice=lattice,
        cells=cells,
        conflict_resolution=ConflictResolution(lattice, scenes),
        accumulator=accumulator,
        accounting=accounting,
        resting=resting,
        impulse_balance=impulse_balance,
        event_counts=EventCounts(scenes),
    )
