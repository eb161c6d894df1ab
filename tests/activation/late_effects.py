"""Loads and a support that set in late, and laws of bonds that record the largest traction."""

import math

import numpy as np
import taichi as ti

from taichi_dem.kit.allocation import assign
from taichi_dem.kit.elementary import sine_and_cosine
from taichi_dem.kit.types import vec3
from taichi_dem.laws.base import Effect, ElasticShear, ElasticTension

NOWHERE = ((1.0, 1.0, 1.0), (0.0, 0.0, 0.0))


def within(model, box):
    """1 for bodies with their centre in a box, lowest and highest corner, else 0."""
    low, high = np.array(box)
    inside = ((model.centre > low) & (model.centre < high)).all(axis=1)
    return inside.astype(np.int32)


@ti.data_oriented
class Marked(Effect):
    """Base of effects that act on bodies with their centre in a box."""

    def __init__(self, box=NOWHERE, start=0.0, vector=(0.0, 0.0, 0.0)):
        self.box, self.start, self.vector = box, start, vector

    def declare(self, capacity):
        """Marks of the bodies."""
        self.marked = ti.field(ti.i32, shape=capacity.bodies)

    def load(self, model):
        """Mark the bodies."""
        assign(self.marked, within(model, self.box))

    @ti.func
    def acts_on(self, i):
        """1 for a marked body, else 0."""
        return self.marked[i]


@ti.data_oriented
class Push(Marked):
    """Acceleration of bodies in a box [m/s^2], a squared sine from a start for a duration [s]."""

    role = "load"

    def __init__(self, box=NOWHERE, start=0.0, vector=(0.0, 0.0, 0.0), duration=1.0):
        super().__init__(box, start, vector)
        self.duration = duration

    def numbers(self, material):
        """Acceleration, start and duration."""
        return (*self.vector, self.start, self.duration)

    @ti.func
    def wrench(self, i, motion):
        """Force [N] and no torque."""
        share, phase = 0.0, (motion.time - self.law[3]) / self.law[4]
        if 0.0 < phase and phase < 1.0:
            swing, _ = sine_and_cosine(math.pi * phase)
            share = swing * swing
        push = share * self.tables.mass[i] * vec3(self.law[0], self.law[1], self.law[2])
        return push, vec3(0.0)


@ti.data_oriented
class Mover(Marked):
    """Bodies in a box are held, and from a start on move at a velocity [m/s]."""

    role = "support"

    def numbers(self, material):
        """Velocity and start."""
        return (*self.vector, self.start)

    @ti.func
    def held(self, i, t, step, rotation, velocity, angular_momentum):
        """Velocity at a time and no spin."""
        allowed = vec3(0.0)
        if t > self.law[3]:
            allowed = vec3(self.law[0], self.law[1], self.law[2])
        return allowed, vec3(0.0)


@ti.data_oriented
class PeakTension(ElasticTension):
    """Elastic, and every unit records its largest pull [Pa]."""

    is_null = False
    name = "peak_tension"

    def declare(self, capacity):
        """Largest pull of every unit."""
        self.peak = ti.field(ti.f64, shape=capacity.units)

    @ti.func
    def traction(self, m, stiffness, u, opening):
        """Linear traction [Pa]."""
        self.peak[u] = ti.max(self.peak[u], stiffness * opening)
        return stiffness * opening


@ti.data_oriented
class PeakShear(ElasticShear):
    """Elastic, and every unit records the largest cohesion that it needed [Pa]."""

    is_null = False
    name = "peak_shear"

    def numbers(self, material):
        """Friction coefficient."""
        return (material.friction,)

    def declare(self, capacity):
        """Largest cohesion needed by every unit."""
        self.peak = ti.field(ti.f64, shape=capacity.units)

    @ti.func
    def traction(self, m, stiffness, u, sliding, pressure):
        """Linear traction [Pa]; nothing slips."""
        needed = stiffness * sliding.norm() - self.law[m, 0] * pressure
        self.peak[u] = ti.max(self.peak[u], needed)
        return stiffness * sliding, 0.0
