"""Samples of a run at even intervals, taken inside the kernel; or none."""

from typing import Any

import numpy as np
import taichi as ti

from ca_damper.scenes.scene_fields import SceneFields
from taichi_dem.kit.allocation import assign

#: Quantities of a sample: of container and base, and the filling's mean force since the last one.
SAMPLED = ("x", "v", "y", "force")


@ti.data_oriented
class NoRecorder:
    """Nothing is recorded, and nothing of it compiled."""

    active = False

    def aim(self, every: int) -> None:
        """Nothing to set."""


@ti.data_oriented
class Recorder:
    """Samples of every scene, every so many steps of a run from its beginning on.

    every: steps between samples, 0 for none. samples: (scenes, samples) of SAMPLED; the force is
    the mean over the steps since the sample before, in the first one that of the last step. pushed:
    sum of the forces since the last sample, but for that of the last step [N].
    """

    active = True

    def __init__(self, table: SceneFields):
        self.table = table
        self.every = ti.field(ti.i32, shape=())
        self.samples = table.vector(len(SAMPLED), ti.f64, "samples")
        self.pushed = table.field(ti.f64)

    def aim(self, every: int) -> None:
        """Set the steps between samples of the next run, 0 for none."""
        assign(self.every, every)

    @ti.func
    def note(self, s, step, motion, y, force):
        """Take a sample at the beginning of a step of the run, if one is due; force: before it."""
        every = self.every[None]
        if every > 0:
            total = self.pushed[s] + force
            if step % every == 0:
                mean = force if step == 0 else total / every
                self.samples[s, step // every] = ti.Vector([motion.x, motion.v, y, mean])
                total = 0.0
            self.pushed[s] = total

    def read(self, count: int) -> np.ndarray:
        """The first samples of all scenes in use, (scenes, count, SAMPLED)."""
        found: Any = self.table.in_use(self.samples)[:, :count]
        return np.array(found)

    def mean_force(self, last: np.ndarray, steps: int) -> np.ndarray:
        """Mean force since the last sample, so many steps ago; last: that of the last step."""
        pushed: np.ndarray = self.table.in_use(self.pushed)
        return (pushed + last) / steps
