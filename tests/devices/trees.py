"""Field trees of drawn kinds and lengths on a device, and how many of their fields are damaged.

    python -m tests.devices.trees ARCH

A field is damaged where it does not hold what was written to it before all others were written.
"""

import json
import sys

import numpy as np
import taichi as ti

from taichi_dem.kit import runtime
from taichi_dem.kit.allocation import FieldTree

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
    kind, entry = KINDS[random.integers(len(KINDS))], random.integers(4)
    if entry == 0:
        return ti.Vector.field(int(random.integers(2, 7)), kind, **shape)
    if entry == 1:
        return ti.Matrix.field(3, 3, kind, **shape)
    return ti.field(kind, **shape)


def damaged(seed):
    """Number of damaged fields of a tree."""
    random = np.random.default_rng(seed)
    with FieldTree():
        fields = [field for _ in range(FIELDS) for field in drawn(random)]
    for number, field in enumerate(fields):
        field.fill(number + 1)
    return sum(int((field.to_numpy() != number + 1).any()) for number, field in enumerate(fields))


if __name__ == "__main__":
    runtime.start(sys.argv[1])
    print(json.dumps({"trees": TREES, "damaged": sum(map(damaged, range(TREES)))}))
