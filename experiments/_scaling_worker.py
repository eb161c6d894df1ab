"""Time of whole steps of one blast in a process of its own: threads cannot change within one.

    python _scaling_worker.py JOB.json

Prints seconds a step, one a repeat, and a digest of where the bodies are in the end, as JSON.
"""

import json
import sys
import time

import numpy as np

from _blast import METHODS, paper_effects
from taichi_dem import CONCRETE, Scene, Simulation, effects, read_mesh, runtime
from taichi_dem.checkpoint import digest
from taichi_dem.mesh_shapes import bar

#: Length and width of the bar that stands for a block [m].
BAR = (2.0, 1.0)


def scene_of(mesh, cells):
    """The paper's effects on a mesh file, or on a bar of some boxes under the same gas."""
    if mesh:
        return Scene(read_mesh(mesh), CONCRETE, paper_effects())
    blown = [e for e in paper_effects() if e.name != "gas_pressure"]
    gas = effects.GasPressure(group="left")
    return Scene(bar(*BAR, cells), CONCRETE, [*blown, gas])


def timed(simulation, warm, steps, repeats):
    """Seconds a step of some steps, one a repeat, after warm ones."""
    simulation.advance_to(warm)
    seconds = []
    for k in range(repeats):
        started = time.perf_counter()
        simulation.advance_to(warm + (k + 1) * steps)
        seconds.append((time.perf_counter() - started) / steps)
    return seconds


def main(path):
    """Do a job and print what it measured."""
    with open(path, encoding="utf-8") as handle:
        job = json.load(handle)
    runtime.start("cpu", job["threads"])
    make, step = METHODS[job["method"]]
    scene = scene_of(job["mesh"], job["cells"])
    simulation = Simulation(scene, make(step), job["driver"])
    seconds = timed(simulation, job["warm"], job["steps"], job["repeats"])
    motion = simulation.state.motion()
    found = {
        "seconds": seconds,
        "bodies": simulation.model.body_count,
        "broken": int((simulation.state.broken_tick.to_numpy() >= 0).sum()),
        "digest": digest(*(np.ascontiguousarray(motion[key]) for key in ("position", "velocity"))),
    }
    print(json.dumps(found))


if __name__ == "__main__":
    main(sys.argv[1])
