"""Automaton on the device, and the order in which its rules act."""

from typing import Any

import numpy as np
import taichi as ti

from ca_damper.automaton.collisions import Collisions
from ca_damper.automaton.components import assemble
from ca_damper.automaton.ejection import Ejection
from ca_damper.automaton.impulse_balance import GRAVITY, QUANTUM
from ca_damper.automaton.lattice import DIRECTIONS, DOWN, EMPTY, HELD, WALL, unit_vectors
from ca_damper.automaton.lattice_device import LatticeDevice
from ca_damper.automaton.placement import DrawnCells, NamedCells
from ca_damper.automaton.transport import Transport
from ca_damper.engine.random_numbers import stream
from ca_damper.filling import Action
from ca_damper.scenes.scene_fields import SceneFields


@ti.data_oriented
class DeviceAutomaton(LatticeDevice):
    """Automata of all scenes of a table; the protocol is in ``ca_damper.filling``."""

    def __init__(self, options: Any, table: SceneFields):
        components = assemble(options, table)
        placement = DrawnCells if options.start is None else NamedCells
        super().__init__(table, components, placement(table, components.cells, DOWN))
        self.accounting, self.impulse_balance = components.accounting, components.impulse_balance
        self.transport, self.ejection = Transport(table, components), Ejection(table, components)
        both, pairs_first = options.pair_rule == "both", options.priority == "pairs_first"
        self.collisions = Collisions(table, components, both, pairs_first)

    @ti.func
    def reset(self, s):
        """Particles at rest in their first cells, headed down."""
        self.cells.clear(s)
        self.accounting.clear(s)
        self.place_all(s)

    @ti.func
    def advance(self, s, step, motion):
        """One step: the walls move, particles fly, meet, and change cells."""
        pull = self.parameters.gravity[None] * self.table.dt[s]
        shared = stream(self.table.seed[s], step)
        self.velocity[s] = motion.v
        self.event_counts.begin(s, step)
        pressed = motion.a > -self.parameters.gravity[None]
        impulse = self.ejection.follow(s, step, motion)
        if not pressed:
            self.resting.release(s, motion.v)
        contacts, due, oblique = self.transport.fly_all(
            s, self.table.dt[s], pull, self.collisions.contacts
        )
        impulse += self.collisions.resolve(s, step, shared, contacts, motion.v, pull, pressed)
        # On an oblique flight gravity acts by a quarter: the lattice holds the rest.
        impulse += self.accounting.lattice_impulse(s, GRAVITY, 0.75 * pull * oblique)
        self.transport.move_all(s, step, shared, due)
        mass = self.parameters.mass[None]
        return Action(-mass * QUANTUM * ti.cast(impulse, ti.f64), mass * self.resting.count(s))

    @ti.func
    def energy(self, s):
        """Kinetic and potential energy [J]; held particles move as the container did last."""
        total = 0.0
        for cell in range(self.lattice.cell_count()):
            kind = self.cells.at(s, cell)
            if kind != EMPTY and kind != WALL:
                speed = self.velocity[s] if kind == HELD else self.cells.speed[s, cell]
                height = self.lattice.height_of(cell) * self.parameters.width[None]
                height += self.cells.travelled[s, cell] * self.lattice.upward(kind)
                total += 0.5 * speed * speed + self.parameters.gravity[None] * height
        return self.parameters.mass[None] * total

    @ti.func
    def divergence_code(self, s):
        """1 when a particle would cross more than one cell a step, which no rule allows."""
        fastest = 0.0
        for cell in range(self.lattice.cell_count()):
            fastest = max(fastest, self.cells.speed[s, cell])
        return 0 if fastest * self.table.dt[s] < self.parameters.width[None] else 1

    def snapshot(self, s: int) -> dict[str, np.ndarray]:
        """Positions and velocities of the particles, by cell (see ``ca_damper.filling``)."""
        geometry = self.lattice.geometry
        kind, travelled, speed = (
            self.table.row(field, s)[: geometry.cells]
            for field in (self.cells.kind, self.cells.travelled, self.cells.speed)
        )
        flying, present = kind < DIRECTIONS, (kind != EMPTY) & (kind != WALL)
        way = np.zeros((len(kind), 2))
        way[flying] = unit_vectors()[kind[flying]]
        position = geometry.centres(self.parameters.width[None])
        position = position + way * travelled[:, None]
        velocity = way * speed[:, None]
        velocity[kind == HELD, 1] = self.velocity[s]
        return {"position": position[present], "velocity": velocity[present]}
