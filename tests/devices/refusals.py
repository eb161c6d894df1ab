"""What a device refuses in words: a launch whose loops the driver ends too early.

    python -m tests.devices.refusals ARCH

prints the sentence of each package, "" where nothing is refused.
"""

import json
import math
import sys

import taichi as ti

from ca_damper import Automaton, Batch, SceneTable
from taichi_dem import CONCRETE, InputError, Scene, Simulation, Uniform, effects, runtime
from taichi_dem.kit import backend
from taichi_dem.kit.types import vec3
from taichi_dem.mesh.shapes import bar


@ti.data_oriented
class SlowGravity(effects.Gravity):
    """Weight that a loop of 70,000 rounds finds."""

    @ti.func
    def wrench(self, i, motion):
        """Force [N] and torque [N m] on body i."""
        force = vec3(0.0)
        for _ in range(70_000 * self.tables.body_count[None] // 6):
            force[1] -= 1e-4 * self.tables.mass[i]
        return force, vec3(0.0)


def blast():
    """A load with a long loop, on six bodies."""
    scene = Scene(bar(1.0, 1.0, (1, 1, 1)), CONCRETE, [SlowGravity()])
    Simulation(scene, Uniform(1e-8), "parallel").advance_to(2)


def damper():
    """More steps in a launch than its cap allows."""
    batch = Batch(Automaton(), SceneTable([50], 1, 1e-4, 6.0, 0.6e-3))
    batch.start("empty")
    batch.launches.most_steps, batch.launches.pace = math.inf, 1e6
    batch.advance(2000)


def said(work):
    """The sentence with which work is refused."""
    try:
        work()
    except InputError as error:
        return str(error)
    return ""


if __name__ == "__main__":
    runtime.start(sys.argv[1])
    print(
        json.dumps(
            {"rounds": backend.most_rounds(), **{w.__name__: said(w) for w in (blast, damper)}}
        )
    )
