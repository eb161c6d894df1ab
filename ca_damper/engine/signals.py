"""Excitation on the device: what moves the base and what pushes the container, at any time.

Bases and forces have ``load(excitation, scenes)`` for the numbers of a batch and the ti.func
``at(s, start, t)``: for a base its displacement, velocity and acceleration, for a force its value
[N], at a time t after the beginning of a step, which begins at ``start`` [s].
"""

from typing import Any

import numpy as np
import taichi as ti

from ca_damper.excitation.excitation import Excitation, packed
from ca_damper.oscillator import sine_and_cosine as of_small
from ca_damper.scenes.clock import Clock, added
from ca_damper.scenes.scene_fields import SceneFields
from taichi_dem.kit.allocation import assign
from taichi_dem.kit.elementary import sine_and_cosine


@ti.data_oriented
class SignalTable:
    """Signals of all scenes: nodes one after the other, and where those of a scene begin.

    role: "base" or "force". nodes: value and second derivative. place: first node of scene s and
    its last interval. step: between nodes [s].
    """

    # Written by ``load``, so that a checkpoint leaves them out.
    constant_fields = ("nodes",)

    def __init__(self, table: SceneFields, role: str):
        self.table, self.role = table, role
        self.nodes = ti.Vector.field(2, ti.f64, shape=table.length(f"{role}_nodes"))
        self.place, self.step = table.vector(2, ti.i32), table.field(ti.f64)

    def load(self, excitation: Excitation, scenes: int) -> None:
        """Take over the signals of a batch."""
        nodes, rows = packed(excitation.signals(self.role, scenes))
        assign(self.nodes, nodes)
        assign(self.place, rows[:, :2] - [0, 2])
        assign(self.step, rows[:, 2])

    @ti.func
    def spline(self, s, time):
        """Value, first and second derivative of the signal of scene s, see ``Signal``."""
        h, place = self.step[s], time / self.step[s]
        k = ti.max(0, ti.min(ti.cast(ti.floor(place), ti.i32), self.place[s][1]))
        u, first = place - k, self.place[s][0] + k
        w = 1.0 - u
        low, high = self.nodes[first], self.nodes[first + 1]
        bent = (w * w * w - w) * low[1] + (u * u * u - u) * high[1]
        leaning = (3.0 * u * u - 1.0) * high[1] - (3.0 * w * w - 1.0) * low[1]
        value = w * low[0] + u * high[0] + h * h / 6.0 * bent
        slope = (high[0] - low[0]) / h + h / 6.0 * leaning
        return ti.Vector([value, slope, w * low[1] + u * high[1]])


@ti.data_oriented
class SignalBase(SignalTable):
    """A base that moves by a Signal."""

    def __init__(self, table: SceneFields, clock: Clock):
        super().__init__(table, "base")

    @ti.func
    def at(self, s, start, t):
        """Of the Signal."""
        return self.spline(s, start + t)


@ti.data_oriented
class SineBase:
    """A base that moves by the sine of the scenes' table."""

    def __init__(self, table: SceneFields, clock: Clock):
        self.table, self.clock = table, clock

    def load(self, excitation: Excitation, scenes: int) -> None:
        """Nothing to load beside the table."""

    @ti.func
    def at(self, s, start, t):
        """The clock's phase, turned on by the time since the step began."""
        omega, y0 = 2.0 * ti.math.pi * self.table.frequency[s], self.table.base_amplitude[s]
        sine, cosine = of_small(omega * t)
        phase = added(self.clock.circle[s], ti.Vector([sine, cosine]))
        return y0 * ti.Vector([phase[0], omega * phase[1], -omega * omega * phase[0]])


@ti.data_oriented
class NoForce:
    """No force but those of spring, dashpot and filling."""

    def __init__(self, table: SceneFields):
        pass

    def load(self, excitation: Excitation, scenes: int) -> None:
        """Nothing to load."""

    @ti.func
    def at(self, s, start, t):
        """None."""
        return 0.0


@ti.data_oriented
class SignalForce(SignalTable):
    """A force by a Signal."""

    def __init__(self, table: SceneFields):
        super().__init__(table, "force")

    @ti.func
    def at(self, s, start, t):
        """Of the Signal."""
        return self.spline(s, start + t)[0]


@ti.data_oriented
class DeviceSineForce:
    """A force that is a sine of its own frequency; wave: amplitude [N], omega [rad/s], phase."""

    def __init__(self, table: SceneFields):
        self.wave = table.vector(3, ti.f64)

    def load(self, excitation: Excitation, scenes: int) -> None:
        """Take over the numbers of a batch."""
        force: Any = excitation.force
        amplitude, frequency, phase = force.rows(scenes)
        assign(self.wave, np.column_stack([amplitude, 2.0 * np.pi * frequency, phase]))

    @ti.func
    def at(self, s, start, t):
        """Of the sine."""
        wave = self.wave[s]
        sine, _ = sine_and_cosine(wave[1] * (start + t) + wave[2])
        return wave[0] * sine


#: Bases and forces by the words of ``ExcitationKind``.
BASES = {"sine": SineBase, "signal": SignalBase}
FORCES = {"none": NoForce, "sine": DeviceSineForce, "signal": SignalForce}
