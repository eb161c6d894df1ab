"""Containers whose motion is prescribed, around any filling: the time loop of its tests."""

import math

import numpy as np
import taichi as ti

from ca_damper.filling import LEAST_PLACES, Fillings, Motion
from ca_damper.scenes.scene_fields import SceneFields
from ca_damper.scenes.table import SceneTable
from taichi_dem.kit.allocation import values
from taichi_dem.kit.engine_pool import Engine, EnginePool

# A CPU loop gives every thread at least this many iterations.
_PAD = 512


@ti.data_oriented
class DrivenEngine(Engine):
    """Fillings in containers that move as x = A sin(2 pi f t).

    impulse: on each container since the reset [N s]. trace: after each of the first ``traced``
    steps impulse, carried mass, momentum and energy.
    """

    def declare(self):
        scenes, traced, *places = self.capacity
        filling = self.structure.fillings.kinds[0]
        sizes = dict(zip(filling.structure.sizes, places))
        self.table = SceneFields(scenes, {"traced": traced, **sizes})
        self.device = filling.bind(self.table)
        self.impulse = self.table.field(ti.f64)
        self.trace = self.table.vector(4, ti.f64, "traced")
        self.traced = ti.field(ti.i32, shape=())

    @ti.kernel
    def reset(self, traced: ti.i32):
        for _ in range(1):
            self.traced[None] = traced
        for s in range(self.table.scenes[None]):
            self.device.reset(s)
            self.impulse[s] = 0.0

    @ti.func
    def motion(self, s, step):
        omega = 2.0 * math.pi * self.table.frequency[s]
        phase, amplitude = omega * step * self.table.dt[s], self.table.base_amplitude[s]
        rate, bend = omega * ti.cos(phase), -omega * omega * ti.sin(phase)
        return Motion(amplitude * ti.sin(phase), amplitude * rate, amplitude * bend)

    @ti.kernel
    def run(self, start: ti.i32, end: ti.i32):
        for t in range(_PAD * self.table.scenes[None]):
            if t % _PAD == 0:
                s = t // _PAD
                for step in range(start, end):
                    action = self.device.advance(s, step, self.motion(s, step))
                    self.impulse[s] = self.impulse[s] + action.impulse
                    if step < self.traced[None]:
                        momentum, energy = self.device.momentum(s), self.device.energy(s)
                        self.trace[s, step] = [action.impulse, action.carried, momentum, energy]

    @ti.kernel
    def asked(self, s: ti.i32) -> ti.types.vector(3, ti.f64):
        code = ti.cast(self.device.divergence_code(s), ti.f64)
        return ti.Vector([self.device.energy(s), self.device.momentum(s), code])


class _Structure:
    """Compares as the structure of fillings, and holds them."""

    def __init__(self, fillings):
        self.fillings, self.key = fillings, (type(fillings.kinds[0]), fillings.structure.key)

    def __hash__(self):
        return hash(self.key)

    def __eq__(self, other):
        return self.key == other.key


_POOL = EnginePool(DrivenEngine, (8, 1, *(LEAST_PLACES,) * 32))


class Driven:
    """Scenes of a filling, or of one each, in containers that are driven, or stand still.

    done: steps taken, of all scenes.
    """

    def __init__(self, filling, particles, seed, dt, amplitude, frequency, traced=0):
        table = SceneTable(particles, seed, dt, frequency, amplitude)
        self.fillings, self.count, self.done = Fillings(filling, table.count), table.count, 0
        size = (table.count, traced, *self.fillings.structure.sizes.values())
        self.engine = _POOL.borrow(_Structure(self.fillings), size, filling, self)
        self.engine.clear()
        self.table.upload(table)
        self.device.upload(self.fillings)
        self.engine.reset(traced)

    @property
    def filling(self):
        return self.fillings.one

    @property
    def device(self):
        return self.engine.device

    @property
    def table(self):
        return self.engine.table

    @property
    def impulse(self):
        return self.engine.impulse

    def run(self, steps):
        """Take all scenes on by so many steps."""
        self.engine.run(self.done, self.done + steps)
        self.done += steps
        return self

    def drive(self, frequency, dt):
        """Change frequency [Hz] and step [s] of all scenes."""
        rows = [np.broadcast_to(x, self.count) for x in (frequency, dt)]
        self.table.drive(np.stack(rows))

    def traces(self):
        """The trace so far, NumPy, (steps, scenes, 4)."""
        return self.table.in_use(self.engine.trace)[:, : self.done].swapaxes(0, 1)

    def in_use(self, field):
        """Rows of the scenes, of a field."""
        return values(field)[: self.count]
