"""Excitation on the device: what moves the base and what pushes the container, at any time."""

from typing import Any

import numpy as np
import taichi as ti

from ca_damper.excitation.excitation import Excitation, ExcitationKind
from ca_damper.excitation.signal import Signal
from ca_damper.scenes.clock import CycleClock, added, small_turn
from ca_damper.scenes.scene_fields import SceneFields
from taichi_dem.kit.allocation import assign


@ti.data_oriented
class DeviceSignal:
    """A Signal on the device, the "base" or "force"; nodes: value and second derivative."""

    # Written by ``upload``, so that a checkpoint leaves them out.
    constant_fields = ("nodes", "last", "step")

    def __init__(self, table: SceneFields, clock: CycleClock, role: str):
        self.role = role
        self.nodes = ti.Vector.field(2, ti.f64, shape=table.length(f"{role}_nodes"))
        self.last, self.step = ti.field(ti.i32, shape=()), ti.field(ti.f64, shape=())

    def upload(self, excitation: Excitation) -> None:
        """Take over the signal of a batch."""
        signal: Signal = getattr(excitation, self.role)
        assign(self.nodes, np.column_stack([signal.value, signal.bend]))
        assign(self.last, len(signal.value) - 2)
        assign(self.step, signal.step)

    @ti.func
    def at(self, s, start, t):
        """Of the spline, see ``Signal``."""
        h, place = self.step[None], (start + t) / self.step[None]
        k = ti.max(0, ti.min(ti.cast(ti.floor(place), ti.i32), self.last[None]))
        u = place - k
        w = 1.0 - u
        low, high = self.nodes[k], self.nodes[k + 1]
        bent = (w * w * w - w) * low[1] + (u * u * u - u) * high[1]
        leaning = (3.0 * u * u - 1.0) * high[1] - (3.0 * w * w - 1.0) * low[1]
        value = w * low[0] + u * high[0] + h * h / 6.0 * bent
        slope = (high[0] - low[0]) / h + h / 6.0 * leaning
        return ti.Vector([value, slope, w * low[1] + u * high[1]])

    @ti.func
    def now(self, s, start):
        """Of the spline."""
        return self.at(s, start, 0.0)


@ti.data_oriented
class SineBase:
    """A base that moves by the sine of the scenes' table."""

    def __init__(self, table: SceneFields, clock: CycleClock, role: str):
        self.table, self.clock = table, clock

    def upload(self, excitation: Excitation) -> None:
        """Nothing to upload beside the table."""

    @ti.func
    def at(self, s, start, t):
        """The clock's phase, turned on by the time since the step began."""
        omega, y0 = 2.0 * ti.math.pi * self.table.frequency[s], self.table.base_amplitude[s]
        phase = added(self.clock.circle[s], small_turn(omega * t))
        return y0 * ti.Vector([phase[0], omega * phase[1], -omega * omega * phase[0]])

    @ti.func
    def now(self, s, start):
        """The clock's phase."""
        omega, y0 = 2.0 * ti.math.pi * self.table.frequency[s], self.table.base_amplitude[s]
        circle = self.clock.circle[s]
        return ti.Vector([y0 * circle[0], omega * y0 * circle[1], -omega * omega * y0 * circle[0]])


@ti.data_oriented
class NoForce:
    """No force but those of spring, dashpot and filling."""

    def __init__(self, *parts: Any):
        pass

    def upload(self, excitation: Excitation) -> None:
        """Nothing to upload."""

    @ti.func
    def at(self, s, start, t):
        """None."""
        return ti.Vector([0.0, 0.0, 0.0])


_BASES = {"sine": SineBase, "signal": DeviceSignal}
_FORCES = {"none": NoForce, "signal": DeviceSignal}


@ti.data_oriented
class DeviceExcitation:
    """Base and force of an excitation of some kind."""

    def __init__(self, table: SceneFields, clock: CycleClock, kind: ExcitationKind):
        self.base = _BASES[kind.base](table, clock, "base")
        self.force = _FORCES[kind.force](table, clock, "force")

    def upload(self, excitation: Excitation) -> None:
        """Take over the excitation of a batch."""
        self.base.upload(excitation)
        self.force.upload(excitation)
