"""A program like the experiments, of a second: kernels whose bits depend on Taichi's settings."""

import os
import sys

# First, out of order: it prepares the environment for ``import taichi``.
from taichi_dem.kit import study  # isort: skip

import numpy as np
import taichi as ti

from taichi_dem import effects
from taichi_dem.kit.checkpoint import digest
from taichi_dem.kit.files import write_text


@ti.kernel
def iterate(values: ti.types.ndarray(dtype=ti.f64, ndim=1)):
    for k in range(values.shape[0]):
        # Numbers without a type take the default one, and fast arithmetic would join the steps.
        total = 0.1
        for j in range(50):
            total = total * 1.0000001 + values[k] / (0.3 + j) - 0.7 * values[k] * total
        values[k] = total


def work(options):
    """Print a digest, and write it to the folder of the output."""
    path = study.output_paths(options.out)
    values = np.linspace(0.0, 1.0, 2000)
    iterate(values)
    pressure = effects.GasPressure("hole").pressure_at(np.linspace(0.0, 5e-4, 300))
    write_text(path("digest.txt"), digest(values, pressure))
    print("digest", digest(values, pressure), flush=True)


if __name__ == "__main__":
    name = os.path.splitext(os.path.basename(__file__))[0]
    sys.exit(study.main(work, study.parser(name, __doc__)))
