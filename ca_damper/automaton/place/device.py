"""Automaton by the rules of place on the device, and the order in which its rules act."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import taichi as ti

from ca_damper.automaton.components import Parameters
from ca_damper.automaton.conflict_resolution import ConflictResolution
from ca_damper.automaton.event_counts import EventCounts
from ca_damper.automaton.lattice import HELD, UP, Lattice
from ca_damper.automaton.lattice_device import LatticeDevice
from ca_damper.automaton.place.blows import Collisions
from ca_damper.automaton.place.changes import Changes
from ca_damper.automaton.place.grains import Grains
from ca_damper.automaton.place.heap import Heap
from ca_damper.automaton.place.transport import PlaceTransport
from ca_damper.automaton.placement import DrawnCells, NamedCells
from ca_damper.automaton.traversal import traversal_of
from ca_damper.engine.random_numbers import stream
from ca_damper.filling import Action
from ca_damper.scenes.scene_fields import SceneFields


@dataclass(frozen=True, eq=False)
class Components:
    """State and choices of the rules, put together by ``assemble``."""

    parameters: Parameters
    lattice: Lattice
    cells: Grains
    conflict_resolution: ConflictResolution
    resting: Heap
    event_counts: EventCounts


def assemble(options: Any, table: SceneFields) -> Components:
    """Components for a user's options."""
    lattice, parameters = Lattice(table), Parameters()
    grains = Grains(table, lattice, traversal_of(options, lattice, table), parameters)
    return Components(
        parameters=parameters,
        lattice=lattice,
        cells=grains,
        conflict_resolution=ConflictResolution(table, lattice),
        resting=Heap(table, grains, parameters, options.particles_rest),
        event_counts=EventCounts(table),
    )


@ti.data_oriented
class PlaceAutomaton(LatticeDevice):
    """Automata of all scenes of a table; the protocol is in ``ca_damper.filling``."""

    def __init__(self, options: Any, table: SceneFields):
        components = assemble(options, table)
        placement = DrawnCells if options.start is None else NamedCells
        super().__init__(table, components, placement(table, components.cells, UP))
        self.transport, self.changes = PlaceTransport(components), Changes(table, components)
        self.collisions = Collisions(table, components)

    @ti.func
    def reset(self, s):
        """Grains at rest in their first cells."""
        self.cells.clear_all(s)
        self.place_all(s)

    @ti.func
    def advance(self, s, step, motion):
        """One step of a container on its own."""
        self._meet(s, step, motion)
        return self.carry_out(s, step, motion, self.collisions.recoil(s))

    @ti.func
    def find_blows(self, s, step, motion):
        """First part of a step; returns the blows on the container."""
        self._meet(s, step, motion)
        return self.collisions.blows(s)

    @ti.func
    def carry_out(self, s, step, motion, recoil):
        """Second part of a step: blows on the container, and changes of cells."""
        impulse = self.collisions.strike_container(s, recoil)
        shared = stream(self.table.seed[s], step)
        self.changes.change_all(s, step, shared, self.table.dt[s])
        return Action(impulse, self.parameters.mass[None] * self.resting.count(s))

    @ti.func
    def _meet(self, s, step, motion):
        """The lattice follows, grains fly and meet."""
        dt = self.table.dt[s]
        pull = self.parameters.gravity[None] * dt
        shared = stream(self.table.seed[s], step)
        self.velocity[s], self.cells.container[s] = motion.v, motion.v + motion.a * dt
        self.cells.closing[s] = motion.a + self.parameters.gravity[None]
        self.event_counts.begin(s, step)
        self.transport.follow(s, step, motion)
        pressed = motion.a > -self.parameters.gravity[None]
        if not pressed:
            self.resting.release_all(s, motion.v)
        self.transport.fly_all(s, dt, pull, motion)
        self.collisions.find(s, step, shared, pull, pressed, motion.v - pull)

    @ti.func
    def energy(self, s):
        """Kinetic and potential energy [J]; held grains move as the container did last."""
        total = 0.0
        for cell in range(self.lattice.cell_count()):
            if self.cells.is_grain(s, cell):
                velocity = self.cells.velocity(s, cell)
                height = self.cells.height(s, cell) - self.cells.offset[s]
                total += 0.5 * velocity.dot(velocity) + self.parameters.gravity[None] * height
        return self.parameters.mass[None] * total

    @ti.func
    def divergence_code(self, s):
        """1 when a grain would cross more than one cell a step, which no rule allows.

        2 when one is more than a diameter outside the box: pushed beyond floor or ceiling by others
        more often than it could turn over there.
        """
        fastest, farthest, width = 0.0, 0.0, self.parameters.width[None]
        for cell in range(self.lattice.cell_count()):
            across = ti.abs(self.cells.across.velocity[s, cell])
            fastest = ti.max(fastest, ti.abs(self.cells.speed[s, cell]), across)
            if self.cells.is_grain(s, cell):
                farthest = ti.max(farthest, self.outside(s, cell))
        result = 0 if fastest * self.table.dt[s] < width else 1
        return 2 if farthest > width else result

    @ti.func
    def outside(self, s, cell):
        """By how much a grain is farther out than those at floor and ceiling can be [m]."""
        most = ti.cast(self.lattice.row_count(), ti.f64) * self.parameters.width[None]
        height = self.cells.height(s, cell) - self.cells.offset[s]
        return ti.max(-height, height - most)

    def snapshot(self, s: int) -> dict[str, np.ndarray]:
        """Positions and velocities of the grains, by cell (see ``ca_damper.filling``).

        Across, grains stand in the middle of their columns.
        """
        geometry, cells = self.lattice.geometry, self.cells
        kind, travelled, speed, across = (
            self.table.row(field, s)[: geometry.cells]
            for field in (cells.kind, cells.travelled, cells.speed, cells.across.velocity)
        )
        held, present = kind == HELD, (kind == UP) | (kind == HELD)
        offset = float(self.table.row(cells.offset, s))
        position = geometry.centres(self.parameters.width[None])
        position[:, 1] += np.where(held, 0.0, travelled - offset)
        speed = np.where(held, float(self.table.row(self.velocity, s)), speed)
        velocity = np.column_stack([across, speed])
        return {"position": position[present], "velocity": velocity[present]}
