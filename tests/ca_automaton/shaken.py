"""A container whose motion is prescribed, and what the particles in it do."""

import numpy as np
import taichi as ti

from ca_damper.filling import Motion
from ca_damper.table import SceneTable


@ti.data_oriented
class Shaken:
    """Scenes of one filling in containers that move as x = A sin(w t), all at once.

    trace: after each step impulse, carried mass, momentum and energy, shape (steps, scenes, 4),
    when ``traced`` steps are asked for.
    """

    def __init__(self, filling, particles, seed=1, dt=1e-4, amplitude=0.0, frequency=6.0, traced=0):
        self.table = SceneTable(particles, seed, dt, frequency, amplitude)
        self.trace = ti.Vector.field(4, ti.f64, shape=(max(1, traced), self.table.count))
        self.traced = traced
        self.device = filling.bind(self.table)
        self.step = 0
        self._reset()

    @ti.kernel
    def _reset(self):
        for s in range(self.table.count):
            self.device.reset(s)

    @ti.func
    def motion(self, s, step):
        w = 2.0 * np.pi * self.table.frequency[s]
        phase = w * step * self.table.dt[s]
        x = self.table.base_amplitude[s] * ti.sin(phase)
        return Motion(x, w * self.table.base_amplitude[s] * ti.cos(phase), -w * w * x)

    @ti.kernel
    def _run(self, first: ti.i32, steps: ti.i32):
        for t in range(512 * self.table.count):
            if t % 512 == 0:
                s = t // 512
                for k in range(steps):
                    action = self.device.advance(s, first + k, self.motion(s, first + k))
                    if ti.static(self.traced > 0):
                        self.trace[first + k, s] = [
                            action.impulse,
                            action.carried,
                            self.device.momentum(s),
                            self.device.energy(s),
                        ]

    def run(self, steps):
        """Take all scenes on by so many steps."""
        self._run(self.step, steps)
        self.step += steps
        return self

    def traces(self):
        """The trace so far, NumPy, (steps, scenes, 4)."""
        return self.trace.to_numpy()[: self.step]

    def state(self):
        """Kind, speed, way and staircase of all scenes, to compare bits."""
        cells = self.device.cells
        return [field.to_numpy() for field in (cells.kind, cells.speed, cells.travelled)]
