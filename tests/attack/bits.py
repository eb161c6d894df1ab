"""Digests of prepared tables and of short runs as JSON; ``test_same_bits`` runs it as a program.

The word "runs" adds the runs. "control" in the answer changes with the processor's kind.
"""

import json
import math
import sys

import numpy as np

from ca_damper import Batch, Oscillator, SceneTable, Spheres
from taichi_dem import CONCRETE, ImplicitDashpots, Multirate, Scene, StepControl, runtime, simulate
from taichi_dem import effects as listed
from taichi_dem.engine.model import Model
from taichi_dem.kit.checkpoint import digest
from taichi_dem.kit.elementary import fifth_root, sine_and_cosine
from taichi_dem.kit.fixed_order import inverse
from taichi_dem.mesh.shapes import bar
from taichi_dem.output.hole_monitor import HoleMonitor
from taichi_dem.stability.mesh_limits import dashpots_of, inverse_root, springs_of, subset_rates
from taichi_dem.stability.step_report import contact_eigenvalues
from tests.scenes import brisk_scene, paper_effects


def tables():
    """Digests of all that a run of the block is computed from."""
    scene = brisk_scene()
    model = Model(scene.mesh, scene.material, scene.effects)
    shape = model.mesh, model.topology, model.material.density
    hole, spheres = HoleMonitor(model, "hole"), vars(model.spheres)
    made = {
        "bodies": (model.body_mass, model.centre, model.body_inertia, model.body_radius),
        "inverse": (inverse(model.body_inertia), inverse_root(model.body_mass, model.body_inertia)),
        "bonds": tuple(model.bonds.values()),
        "spheres": tuple(spheres.values()),
        "rates": [subset_rates(*shape, of(model.material)) for of in (dashpots_of, springs_of)],
        "contacts": contact_eigenvalues(model.mesh, 2400.0, 5, True),
        "hole": (hole.axis, hole.axis_point, hole.outward, hole.bodies),
    }
    return {name: digest(*arrays) for name, arrays in made.items()}


def functions():
    """Digests of the elementary functions, and of others that depend on the processor."""
    at = np.random.default_rng(1).uniform(0.0, 7.0, 20000)
    blocks = np.random.default_rng(2).normal(size=(500, 6, 6))
    inverses, plain = np.linalg.inv(blocks), [math.sin(x) for x in at.tolist()]
    return {
        "circle": digest([sine_and_cosine(x) for x in at.tolist()]),
        "fifth_root": digest([fifth_root(x) for x in at.tolist()]),
        "control_blas": digest(inverses),
        "control_libm": digest(plain),
        "control_numpy": digest(at**-0.45),
    }


def blown():
    """A bar that is blown at one end, on a roller, with all effects of the paper."""
    gas = listed.GasPressure("left", peak=2e9, rise=1e-5)
    held = listed.Roller("right", (1.0, 0.0, 0.0))
    return Scene(bar(0.1, 0.05, (3, 2, 2)), CONCRETE, [*paper_effects()[:-1], gas, held])


def blasts():
    """Digests of histories and last frames of runs of some hundred steps."""
    control = StepControl(dashpot_floor=1e-8)
    methods = {
        "solved": (ImplicitDashpots(2e-7), 4e-5),
        "controlled": (Multirate(8e-8, 1e-5, control=control, dashpot="limited"), 2e-5),
    }
    found = {}
    for name, (method, until) in methods.items():
        result = simulate(blown(), method=method, until=until, samples=3, frames=1, progress=None)
        last = result.frames[-1]
        moved = (last.position, last.rotation, last.velocity, last.damage)
        found[name] = digest(*result.history.values(), *moved)
    return found


def dampers():
    """Digest of the last state of spheres on a spring, and of what was measured."""
    table = SceneTable([12, 30], [1, 2], 2e-5, [5.5, 6.0], Oscillator().base_amplitude)
    batch = Batch(Spheres(), table, measured_cycles=1)
    batch.start()
    cycles = batch.run(0, 1)
    measured = (cycles.record, cycles.rms, cycles.harmonic("f"), cycles.harmonic("x"))
    return {"damper": digest(*measured, batch.steps_per_cycle)}


if __name__ == "__main__":
    answer = {**tables(), **functions()}
    if "runs" in sys.argv:
        runtime.start(threads=1)
        answer.update(**blasts(), **dampers())
    print(json.dumps(answer))
