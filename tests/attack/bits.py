"""A program like the experiments: digests of prepared tables and of short runs, in a file."""

import json
import sys

# First, out of order: it prepares the environment for ``import taichi``.
from taichi_dem.kit import study  # isort: skip

import numpy as np

from ca_damper import Batch, Oscillator, RigidMass, SceneTable
from taichi_dem import CONCRETE, ImplicitDashpots, Scene, effects, simulate
from taichi_dem.elasticity.rates import contact_eigenvalues, dashpots_of, subset_rates
from taichi_dem.kit.checkpoint import digest
from taichi_dem.kit.elementary import fifth_root, sine_and_cosine
from taichi_dem.kit.files import write_text
from taichi_dem.kit.fixed_order import inverse
from taichi_dem.mesh.shapes import bar
from taichi_dem.state.model import Model
from tests.scenes import brisk_scene


def tables():
    """Digest of all that a run of the block is computed from, and of functions of kernels."""
    scene = brisk_scene()
    model = Model(scene.mesh, scene.material, scene.effects)
    rates = subset_rates(model.mesh, model.topology, 2450.0, dashpots_of(model.material))
    touching = contact_eigenvalues(model.mesh, 2400.0, 5, True)
    made = model.body_mass, model.centre, model.body_radius, inverse(model.body_inertia)
    at = np.random.default_rng(1).uniform(0.0, 7.0, 20000).tolist()
    functions = [(*sine_and_cosine(x), fifth_root(x)) for x in at]
    contact = vars(model.spheres).values()
    return digest(*made, *model.bonds.values(), *contact, rates, touching, functions)


def blast():
    """Digest of a bar that is blown at one end, on a roller."""
    gas = effects.GasPressure("left", peak=2e9, rise=1e-5)
    laws = [effects.BondDamping(), effects.Softening(), effects.ShearSlip()]
    held = effects.Roller("right", (1.0, 0.0, 0.0))
    scene = Scene(bar(0.1, 0.05, (3, 2, 2)), CONCRETE, [*laws, gas, held])
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


def work(options):
    """Write the digests."""
    path = study.output_paths(options.out)
    found = json.dumps([tables(), blast(), damper()])
    write_text(path("digests.json"), found)
    print(found, flush=True)


if __name__ == "__main__":
    sys.exit(study.main(work, study.parser("bits", __doc__)))
