"""A program like the experiments: digests of prepared tables and of short runs, in a file."""

import json
import sys

# First, out of order: it prepares the environment for ``import taichi``.
from taichi_dem.kit import study  # isort: skip

import numpy as np

from ca_damper import Batch, Oscillator, RigidMass, SceneTable
from taichi_dem.elasticity.rates import contact_eigenvalues
from taichi_dem.kit.elementary import fifth_root, sine_and_cosine
from taichi_dem.kit.files import write_text
from tests.equivalence.test_digests import blown_bar, digest, found

#: A run of a bar of which the stored digests are beside it.
RUN = "bar_controlled"


def tables():
    """Digest of what that run is not computed from: of dashpots in contact, and of functions."""
    at = np.random.default_rng(1).uniform(0.0, 7.0, 20000).tolist()
    functions = np.array([(*sine_and_cosine(x), fifth_root(x)) for x in at])
    return digest([contact_eigenvalues(blown_bar().mesh, 2400.0, 5, True), functions])


def blast():
    """Digests of a bar that breaks, and of the tables that it is computed from."""
    return found(RUN)


def damper():
    """Digest of what was measured of a rigid mass on a spring."""
    table = SceneTable([12, 30], [1, 2], 1e-3, [5.5, 6.0], Oscillator().base_amplitude)
    batch = Batch(RigidMass(), table, measured_cycles=1)
    batch.start()
    cycles = batch.run(0, 1)
    return digest([cycles.record, cycles.rms, cycles.harmonic("f")])


def work(options):
    """Write the digests."""
    path = study.output_paths(options.out)
    made = json.dumps([tables(), blast(), damper()])
    write_text(path("digests.json"), made)
    print(made, flush=True)


if __name__ == "__main__":
    sys.exit(study.main(work, study.parser("bits", __doc__)))
