"""What is computed on a CPU and on a device: short runs of all methods and fillings, as arrays.

    python -m tests.devices.work ARCH FOLDER

writes FOLDER/ARCH.npz, and a checkpoint there if it lacks: that of a CPU, which comes first.
"""

import sys
from pathlib import Path

import numpy as np

from ca_damper import Automaton, Batch, Paper, SceneTable, Spheres
from taichi_dem import (
    CONCRETE,
    Checkpoint,
    ImplicitDashpots,
    Multirate,
    Scene,
    Simulation,
    StepControl,
    Uniform,
    effects,
    runtime,
    simulate,
)
from taichi_dem.mesh.shapes import bar
from tests.scenes import paper_effects

#: Where explicit dashpots are limited, a few hundred steps are enough to break bonds.
LIMITED = {"dashpot": "limited"}
#: Sweeps are counted: a residual beside its bound would make one more of them here or there.
METHODS = {
    "uniform": Uniform(5e-8, **LIMITED),
    "drifted": Multirate(8e-8, 1e-5, neighbour="drifted", **LIMITED),
    "controlled": Multirate(8e-8, 1e-5, control=StepControl(dashpot_floor=1e-8), **LIMITED),
    "implicit": ImplicitDashpots(4e-7, sweeps=(4, 4)),
}
UNTIL = 4.8e-6
FILLINGS = {
    "automaton of places": (Automaton(), 60),
    "automaton of the paper": (Automaton(Paper()), 60),
    "spheres": (Spheres(), 30),
}


def scene():
    """A bar of 72 bodies, blown hard enough to break within UNTIL."""
    listed = paper_effects(kind=effects.SphereContact)[:-1]
    gas = effects.GasPressure("left", peak=2e10, rise=1e-6)
    return Scene(bar(0.1, 0.05, (3, 2, 2)), CONCRETE, [*listed, gas])


def write(arch, folder):
    """Compute all and write it to a file of a folder."""
    runtime.start(arch, threads=2)
    found = {f"resumed {key}": one for key, one in resumed(Path(folder, "half.npz")).items()}
    for name, method in METHODS.items():
        found.update({f"{name} {key}": one for key, one in blast(method).items()})
    for name, (filling, steps) in FILLINGS.items():
        found[name] = damper(filling, steps)
    np.savez(Path(folder, f"{arch}.npz"), **found)


def blast(method):
    """Motion, breaks and counts at the end of a run by the parallel driver."""
    simulation = Simulation(scene(), method, "parallel")
    simulation.advance_to(round(UNTIL / method.dt0))
    counted = {"broken_tick": simulation.values(simulation.state.broken_tick)}
    counted["evaluations"] = simulation.values(simulation.schedule.evaluations)
    return {**simulation.state.motion(), **counted}


def resumed(half):
    """History of a run of which a CPU has made the first half."""
    job = {"method": METHODS["controlled"], "samples": 6, "frames": 2}
    if not half.exists():
        simulate(scene(), until=0.5 * UNTIL, checkpoint=Checkpoint(half), **job)
    return simulate(scene(), until=UNTIL, resume=half, **job).series


def damper(filling, steps):
    """Speed of the container after some steps."""
    batch = Batch(filling, SceneTable([20, 50], 1, 1e-4, 6.0, 0.6e-3))
    batch.start("empty")
    batch.advance(steps)
    return batch.sample()["v"]


if __name__ == "__main__":
    write(*sys.argv[1:])
