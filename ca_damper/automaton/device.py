"""Base of all automata on the device, and the order in which rules act."""

import numpy as np
import taichi as ti

from ca_damper.automaton.accounting import QUANTUM
from ca_damper.automaton.cells import Cells, Placement
from ca_damper.automaton.lattice import EMPTY, HELD, WALL, Lattice
from ca_damper.engine.random_numbers import stream
from ca_damper.engine.recorder import EventCounts
from ca_damper.filling import Action, Fillings
from ca_damper.scenes.gravity import gravity_across, gravity_along
from ca_damper.scenes.scene_fields import SceneFields
from taichi_dem.kit.effect_table import EffectUse

PAIRS, WALLS, PUSHES, HOLDS = range(4)
#: Counted events by the effect that they belong to.
_COUNTED = {
    "pairs": (PAIRS, "pairs met"),
    "landing": (WALLS, "impacts on walls"),
    "ejection": (PUSHES, "particles pushed along"),
    "static contact": (HOLDS, "particles came to rest"),
}
_BY = {name: (kind,) for name, (kind, _) in _COUNTED.items()}


def parameters_of(automaton: object) -> dict[str, float]:
    """Numbers that kernels read, and those of the rules.

    gravity down and to the right [m/s^2]; restitutions; threshold of static contact over g dt.
    """
    return {
        "width": automaton.width,
        "mass": automaton.particle_mass,
        "gravity": gravity_along(automaton),
        "sideways": gravity_across(automaton),
        "particle": automaton.restitution,
        "wall": automaton.wall_restitution,
        "threshold": automaton.static_threshold,
        **automaton.rules.numbers,
    }


@ti.data_oriented
class LatticeDevice:
    """Automata of all scenes of a table; the protocol is in ``ca_damper.filling``.

    Rules add ``transport`` (follow, fly_all, move_all), ``collisions`` (resolve, recoil,
    strike_container), and ``motion_of(s, kind, travelled, speed)``: places off the centres of cells
    [m] and velocities [m/s] of particles under way, (cells, 2) each.
    """

    constant_fields = ("parameters",)

    def __init__(self, automaton: object, table: SceneFields, looks_ahead: bool):
        self.table, self.lattice = table, Lattice(table, looks_ahead)
        numbers = ti.types.struct(**dict.fromkeys(parameters_of(automaton), ti.f64))
        self.parameters = table.structs(numbers)
        self.event_counts = EventCounts(table, len(_BY), _BY)
        self.velocity, self.gained = table.field(ti.f64), table.field(ti.i64)

    def fill(self, automaton: object, cells: Cells, resting: object, direction: int) -> None:
        """Add cells, what rests in them, and how they are filled."""
        self.cells, self.resting = cells, resting
        self.placement = Placement(cells, direction, automaton.start is not None)

    def upload(self, fillings: Fillings) -> None:
        """Take over the numbers of the automaton of each scene."""
        self.lattice.upload(fillings)
        fillings.write(self.parameters, parameters_of)
        self.placement.upload(fillings)

    @ti.func
    def reset(self, s):
        """Particles at rest in their first cells; nothing has happened."""
        self.cells.clear(s)
        self.cells.conflicts.clear(s)
        self.resting.held[s] = 0
        self.event_counts.clear(s)
        self.placement.fill(s)
        self.velocity[s] = 0.0

    @ti.func
    def advance(self, s, step, motion):
        """One step of a container on its own."""
        self.meet(s, step, motion)
        return self.carry_out(s, step, motion, self.collisions.recoil(s))

    @ti.func
    def meet(self, s, step, motion):
        """First part of a step: the lattice follows the container, particles fly and meet."""
        gravity = self.parameters.gravity[s]
        pull, pressed = gravity * self.table.dt[s], motion.a > -gravity
        shared = stream(self.table.seed[s], step)
        self.velocity[s], self.event_counts.step[s] = motion.v, step
        self.gained[s] = self.transport.follow(s, step, motion)
        if not pressed:
            self.resting.release(s, motion.v)
        self.gained[s] = self.gained[s] + self.transport.fly_all(s, motion, pull)
        met = self.collisions.resolve(s, step, shared, motion, pull, pressed)
        self.gained[s] = self.gained[s] + met

    @ti.func
    def carry_out(self, s, step, motion, recoil):
        """Second part of a step: blows that wait for the container's recoil, changes of cell."""
        gained = self.gained[s] + self.collisions.strike_container(s, recoil)
        self.transport.move_all(s, step, stream(self.table.seed[s], step))
        mass = self.parameters.mass[s]
        return Action(-mass * QUANTUM * ti.cast(gained, ti.f64), mass * self.resting.held[s])

    @ti.func
    def momentum(self, s):
        """Momentum along x [kg m/s]; held particles move as the container did last."""
        total = self.resting.held[s] * self.velocity[s]
        for cell in range(self.lattice.size.cells[s]):
            total += self.cells.vertical_speed(s, cell)
        return self.parameters.mass[s] * total

    def uses(self, effects: tuple[str, ...]) -> tuple[EffectUse, ...]:
        """How often each of the named effects acted; without their energy, all of them steer."""
        counted = [(name, *_COUNTED[name]) for name in effects if name in _COUNTED]
        total = self.event_counts.total
        return tuple(
            EffectUse(name, what, total(kind), steers=True) for name, kind, what in counted
        )

    def snapshot(self, s: int) -> dict[str, np.ndarray]:
        """Positions and velocities of the particles, by cell (see ``ca_damper.filling``)."""
        geometry, cells = self.lattice.geometry(s), self.cells
        kind, travelled, speed = (
            self.table.row(field, s)[: geometry.cells]
            for field in (cells.kind, cells.travelled, cells.speed)
        )
        shift, velocity = self.motion_of(s, kind, travelled, speed)
        velocity[kind == HELD, 1] = self.velocity[s]
        position = geometry.centres(self.parameters.width[s]) + shift
        present = (kind != EMPTY) & (kind != WALL)
        return {"position": position[present], "velocity": velocity[present]}

    def first_steps(self, effects: tuple[str, ...]) -> dict[str, np.ndarray]:
        """Step in which each counted effect first acted, infinite if never, (scenes,)."""
        return self.event_counts.first_steps(effects)
