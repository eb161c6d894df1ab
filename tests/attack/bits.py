"""Digests of prepared tables and of short runs as JSON; ``test_same_bits`` runs it as a program."""

import json

import numpy as np

from ca_damper import Batch, Oscillator, RigidMass, SceneTable
from taichi_dem import CONCRETE, ImplicitDashpots, Scene, effects, runtime, simulate
from taichi_dem.elasticity.rates import contact_eigenvalues, dashpots_of, inverse_root, subset_rates
from taichi_dem.kit.checkpoint import digest
from taichi_dem.kit.elementary import fifth_root, sine_and_cosine
from taichi_dem.kit.fixed_order import inverse
from taichi_dem.mesh.shapes import bar
from taichi_dem.state.model import Model
from tests.scenes import brisk_scene


def tables():
    """Digests of all that a run of the block is computed from."""
    scene = brisk_scene()
    model = Model(scene.mesh, scene.material, scene.effects)
    shape = model.mesh, model.topology, model.material.density
    at = np.random.default_rng(1).uniform(0.0, 7.0, 20000).tolist()
    made = {
        "bodies": (model.body_mass, model.centre, model.body_inertia, model.body_radius),
        "inverse": (inverse(model.body_inertia), inverse_root(model.body_mass, model.body_inertia)),
        "bonds": tuple(model.bonds.values()),
        "spheres": tuple(vars(model.spheres).values()),
        "rates": [subset_rates(*shape, dashpots_of(model.material))],
        "contacts": (contact_eigenvalues(model.mesh, 2400.0, 5, True),),
        "functions": [(*sine_and_cosine(x), fifth_root(x)) for x in at],
    }
    return {name: digest(*arrays) for name, arrays in made.items()}


def blast():
    """Digest of a bar that is blown at one end, on a roller."""
    gas = effects.GasPressure("left", peak=2e9, rise=1e-5)
    laws = [effects.BondDamping(), effects.Softening(), effects.ShearSlip()]
    scene = Scene(
        bar(0.1, 0.05, (3, 2, 2)), CONCRETE, [*laws, gas, effects.Roller("right", (1.0, 0.0, 0.0))]
    )
    result = simulate(scene, method=ImplicitDashpots(2e-7), until=4e-5, frames=1, progress=None)
    last = result.frames[-1]
    return digest(*result.series.values(), last.position, last.velocity, last.damage)


def damper():
    """Digest of what was measured of a rigid mass on a spring."""
    table = SceneTable([12, 30], [1, 2], 1e-3, [5.5, 6.0], Oscillator().base_amplitude)
    batch = Batch(RigidMass(), table, measured_cycles=1)
    batch.start()
    cycles = batch.run(0, 1)
    return digest(cycles.record, cycles.rms, cycles.harmonic("f"))


if __name__ == "__main__":
    runtime.start(threads=1)
    print(json.dumps({**tables(), "blast": blast(), "damper": damper()}))
