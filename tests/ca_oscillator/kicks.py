"""A filling that does what a test asks: blows, a mass that is carried now and then, divergence."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import taichi as ti

from ca_damper.filling import Action, FillingStructure
from taichi_dem.kit.allocation import assign

#: The seed whose scene diverges.
BAD_SEED = 13
CODE = 7


@dataclass(frozen=True)
class Kicks:
    """strength: largest impulse [N s]. mass: carried in every other hundred steps [kg].

    diverges_at: step from which the scene of BAD_SEED reports CODE.
    traced: steps of which motion and action are kept.
    """

    strength: float = 0.0
    mass: float = 0.0
    diverges_at: int = -1
    traced: int = 450

    label: ClassVar[str] = "kicks"
    effects: ClassVar[tuple] = ("kicks",)
    step_bound: ClassVar[None] = None
    default_dt: ClassVar[float] = 1e-4
    capacity: ClassVar[int] = 10
    particle_mass: ClassVar[float] = 0.2e-3
    gravity: ClassVar[float] = 9.8

    def check(self, particles, dt):
        pass

    def divergence(self, code, particles, dt):
        return f"went wrong with code {code}", 0.25 * dt

    @property
    def structure(self):
        return FillingStructure((), {"traced": self.traced})

    def bind(self, table):
        return DeviceKicks(table)


@ti.data_oriented
class DeviceKicks:
    def __init__(self, table):
        self.table = table
        self.numbers = ti.field(ti.f64, shape=2)
        self.steps = ti.field(ti.i32, shape=2)
        self.trace = table.vector(5, ti.f64, "traced")
        self.now = table.field(ti.i32)

    def upload(self, fillings):
        kicks = fillings.one
        assign(self.numbers, np.array([kicks.strength, kicks.mass]))
        assign(self.steps, np.array([kicks.diverges_at, kicks.traced]))

    def trace_of(self, s):
        """Motion and action in the steps that were to be kept, (traced, 5)."""
        return self.table.row(self.trace, s)[: self.steps[1]]

    @ti.func
    def reset(self, s):
        self.now[s] = 0

    @ti.func
    def advance(self, s, step, motion):
        impulse = self.numbers[0] * ti.sin(1.7 * step + self.table.seed[s])
        carried = 0.0
        if (step // 100) % 2 == 1:
            carried = self.numbers[1]
        if step < self.steps[1]:
            self.trace[s, step] = ti.Vector([motion.x, motion.v, motion.a, impulse, carried])
        self.now[s] = step
        return Action(impulse, carried)

    @ti.func
    def energy(self, s):
        return 1.0 * self.now[s]

    @ti.func
    def momentum(self, s):
        return -1.0 * self.now[s]

    @ti.func
    def divergence_code(self, s):
        code = 0
        if self.table.seed[s] == BAD_SEED and 0 <= self.steps[0] <= self.now[s]:
            code = CODE
        return code

    def uses(self, effects):
        return ()

    def snapshot(self, s):
        return {"position": np.zeros((2, 2)), "velocity": np.ones((2, 2))}
