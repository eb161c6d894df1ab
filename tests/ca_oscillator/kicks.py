"""A filling that does what a test asks: blows, a mass that is carried now and then, divergence."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import taichi as ti

from ca_damper.filling import Action

#: The seed whose scene diverges.
BAD_SEED = 13
CODE = 7


@dataclass(frozen=True)
class Kicks:
    """strength: largest impulse [N s]. mass: carried in every other hundred steps [kg].

    diverges_at, lost_at: step from which the scene of BAD_SEED reports CODE, or hits with NaN.
    traced: steps of which motion and action are kept.
    """

    strength: float = 0.0
    mass: float = 0.0
    diverges_at: int = -1
    lost_at: int = -1
    traced: int = 1

    label: ClassVar[str] = "kicks"
    effects: ClassVar[tuple] = ("kicks",)
    default_dt: ClassVar[float] = 1e-4
    capacity: ClassVar[int] = 10
    particle_mass: ClassVar[float] = 0.2e-3
    gravity: ClassVar[float] = 9.8

    def check(self, particles, dt):
        pass

    def divergence(self, code, particles, dt):
        return f"went wrong with code {code}", 0.25 * dt

    def bind(self, table):
        return BoundKicks(self, table)


@ti.data_oriented
class BoundKicks:
    def __init__(self, kicks, table):
        self.table = table
        self.strength, self.mass = kicks.strength, kicks.mass
        self.diverges_at, self.lost_at, self.traced = kicks.diverges_at, kicks.lost_at, kicks.traced
        self.trace = ti.Vector.field(5, ti.f64, shape=(table.count, kicks.traced))
        self.now = ti.field(ti.i32, shape=table.count)

    @ti.func
    def reset(self, s):
        self.now[s] = 0

    @ti.func
    def advance(self, s, step, motion):
        impulse = self.strength * ti.sin(1.7 * step + self.table.seed[s])
        if step == self.lost_at and self.table.seed[s] == BAD_SEED:
            impulse = ti.math.nan
        carried = 0.0
        if (step // 100) % 2 == 1:
            carried = self.mass
        if step < self.traced:
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
        if self.table.seed[s] == BAD_SEED and 0 <= self.diverges_at <= self.now[s]:
            code = CODE
        return code

    def uses(self, effects):
        return ()

    def snapshot(self, s):
        return {"position": np.zeros((2, 2)), "velocity": np.ones((2, 2))}
