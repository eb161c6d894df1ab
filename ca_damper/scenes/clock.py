"""Time of a scene: whole steps, a whole number of them a cycle of the base."""

import math

import numpy as np
import taichi as ti

from ca_damper.scenes.scene_fields import SceneFields
from taichi_dem.kit.allocation import assign
from taichi_dem.kit.elementary import sine_and_cosine
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.validation import positive, told_apart

#: Fewer would leave first harmonics, and the series of ``small_turn``, to chance.
LEAST_STEPS_PER_CYCLE = 40
MOST_STEPS_PER_CYCLE = 10_000_000


def steps_per_cycle(frequency: float, largest_dt: float) -> int:
    """Least number of equal steps that make a cycle, none longer than largest_dt [s]."""
    positive("frequency", frequency)
    positive("dt", largest_dt)
    # A step that fits but for rounding is not shortened.
    count = math.ceil(1.0 / (frequency * largest_dt) * (1.0 - 1e-12))
    if not LEAST_STEPS_PER_CYCLE <= count <= MOST_STEPS_PER_CYCLE:
        low = 1.0 / (frequency * MOST_STEPS_PER_CYCLE)
        high = 1.0 / (frequency * LEAST_STEPS_PER_CYCLE)
        got, bound = told_apart(largest_dt, low if largest_dt < low else high)
        low_s, high_s = (bound, f"{high:.3g}") if largest_dt < low else (f"{low:.3g}", bound)
        raise InputError(f"dt must lie in [{low_s}, {high_s}] s at {frequency:g} Hz, got {got}")
    return count


def automatic_dt(default_dt: float, highest: float) -> float:
    """Step [s]: the default, or shorter where a cycle of the highest frequency [Hz] demands it."""
    return min(default_dt, 1.0 / (LEAST_STEPS_PER_CYCLE * highest))


@ti.data_oriented
class CycleClock:
    """Phase of the base of every scene, as a count of steps in the cycle, with sine and cosine."""

    def __init__(self, table: SceneFields):
        self.table = table
        self.steps, self.position = table.field(ti.i32), table.field(ti.i32)
        self.circle = table.vector(2, ti.f64)
        self.turn = table.vector(2, ti.f64)
        self.half_turn = table.vector(2, ti.f64)

    def set(self, steps: np.ndarray) -> None:
        """Set the steps a cycle of every scene, (scenes,); the phase stays as it is."""
        angle = 2.0 * np.pi / np.asarray(steps, dtype=np.float64)
        assign(self.steps, steps)
        for field, share in ((self.turn, 1), (self.half_turn, 2)):
            assign(field, [sine_and_cosine(a / share) for a in angle.tolist()])

    @ti.func
    def start(self, s):
        """The base passes upwards through zero."""
        self.position[s] = 0
        self.circle[s] = ti.Vector([0.0, 1.0])

    @ti.func
    def tick(self, s):
        """One step on; returns whether a cycle is full."""
        self.position[s] = self.position[s] + 1
        self.circle[s] = added(self.circle[s], self.turn[s])
        full = self.position[s] == self.steps[s]
        if full:
            self.start(s)
        return full

    @ti.func
    def middle(self, s):
        """Sine and cosine of the phase in the middle of the present step."""
        return added(self.circle[s], self.half_turn[s])


@ti.func
def added(a, b):
    """Sine and cosine of the sum of two angles, each given as (sine, cosine)."""
    return ti.Vector([a[0] * b[1] + a[1] * b[0], a[1] * b[1] - a[0] * b[0]])


@ti.func
def small_turn(angle):
    """Sine and cosine of an angle up to a sixth, see ``small_sine_and_cosine``."""
    sine, cosine = small_sine_and_cosine(angle)
    return ti.Vector([sine, cosine])


@ti.pyfunc
def small_sine_and_cosine(angle):
    """Of an angle up to a sixth, by their series to round-off (angle^11 / 11! < 1e-16)."""
    # Faster than the library's, which must serve every angle.
    q = angle * angle
    sine = angle * (1 - q / 6 * (1 - q / 20 * (1 - q / 42 * (1 - q / 72))))
    cosine = 1 - q / 2 * (1 - q / 12 * (1 - q / 30 * (1 - q / 56 * (1 - q / 90))))
    return sine, cosine
