"""What a device refuses in words: a launch whose loops the driver ends too early.

    python -m tests.devices.refusals ARCH

prints the sentence of each package, "" where nothing is refused.
"""

import json
import math
import sys

from ca_damper import Automaton, Batch, SceneTable
from taichi_dem import CONCRETE, InputError, Scene, Simulation, Uniform, effects, runtime
from taichi_dem.kit import backend
from taichi_dem.mesh.shapes import bar


def blast():
    """Lists of 41,472 bodies, which one thread fills."""
    gas = effects.GasPressure("left")
    simulation = Simulation(Scene(bar(2.0, 1.0, (48, 12, 12)), CONCRETE, [gas]), Uniform(1e-8))
    simulation.advance_to(2)


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
