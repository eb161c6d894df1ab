"""What a device must not do: let fields of a tree overlap, or end a loop early without a word.

    python -m tests.devices.checks ARCH

prints as JSON of how many drawn trees of fields and how many of their fields are damaged, which
then do not hold what was written to them before all others were written; the rounds of a loop that
the driver allows, 0 for any; and the sentences with which longer ones are refused, by package.
"""

import functools
import json
import math
import sys

import numpy as np
import taichi as ti

from ca_damper import Automaton, Batch, SceneTable
from taichi_dem import CONCRETE, InputError, Scene, Simulation, Uniform, effects, runtime
from taichi_dem.kit import backend
from taichi_dem.kit.allocation import FieldTree
from taichi_dem.kit.types import vec3
from taichi_dem.mesh.shapes import bar

KINDS = (ti.i32, ti.i64, ti.f64)
TREES, FIELDS = 12, 25


def drawn(random):
    """Fields of drawn kinds and entries: one of a drawn shape, or some that share entries."""
    if random.random() < 0.2:
        fields = [entry_of(random) for _ in range(random.integers(2, 5))]
        ti.root.dense(ti.i, int(random.integers(1, 10))).place(*fields)
        return fields
    shape = () if random.random() < 0.2 else int(random.integers(1, 10))
    return [entry_of(random, shape=shape)]


def entry_of(random, **shape):
    """A field of numbers, vectors or matrices."""
    vector = functools.partial(ti.Vector.field, int(random.integers(2, 7)))
    makers = ti.field, vector, functools.partial(ti.Matrix.field, 3, 3)
    return makers[random.integers(3)](KINDS[random.integers(len(KINDS))], **shape)


def damaged(seed):
    """Number of damaged fields of a tree."""
    random = np.random.default_rng(seed)
    with FieldTree():
        fields = [field for _ in range(FIELDS) for field in drawn(random)]
    for number, field in enumerate(fields):
        field.fill(number + 1)
    return sum(int((field.to_numpy() != number + 1).any()) for number, field in enumerate(fields))


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
    found = {"trees": TREES, "damaged": sum(map(damaged, range(TREES)))}
    found |= {"rounds": backend.most_rounds(), "blast": said(blast), "damper": said(damper)}
    print(json.dumps(found))
