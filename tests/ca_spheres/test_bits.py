"""What must change no bit: search, mirror image, threads, what else is in the batch, pauses."""

import hashlib
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from ca_damper.spheres import Spheres
from tests.ca_spheres.rig import Rig

DT = 2e-5
SHAKEN = {"dt": DT, "frequency": 6.0, "amplitude": 0.02}


def final(rig, s=0):
    return np.concatenate([*rig.state(s), [[rig.impulse[s], rig.energy(s)]]])


@pytest.mark.parametrize("rotation", [False, True])
@pytest.mark.parametrize("particles", [2, 50, 160])
def test_both_searches_give_the_same_bits(particles, rotation):
    # Pairs come in the same order, and those that do not touch add nothing.
    cells, pairs = (
        Rig(Spheres(search=search, rotation=rotation), particles, **SHAKEN).run(20_000)
        for search in ("cells", "all_pairs")
    )
    assert np.array_equal(final(cells), final(pairs))
    assert cells.divergence_code() == 0


@pytest.mark.parametrize("rotation", [False, True])
def test_mirrored_start_runs_mirrored_bit_for_bit(rotation):
    rig = Rig(Spheres(rotation=rotation), 50, seed=[3, 3], **SHAKEN)
    rig.mirror(0, to=1)
    (place, mirrored), (velocity, turned) = (array[:, :50] for array in rig.run(20_000).states())
    assert np.array_equal(velocity * [-1.0, 1.0], turned)
    # Places are counted from the left here: the sum of two rounds.
    assert place[:, 0] + mirrored[:, 0] == pytest.approx(0.06, abs=1e-16)
    assert np.array_equal(place[:, 1], mirrored[:, 1])


def test_a_scene_is_the_same_alone_and_in_a_batch():
    particles, seeds = [10, 50, 0, 33], [5, 6, 7, 8]
    together = Rig(Spheres(), particles, seed=seeds, **SHAKEN).run(10_000)
    reverse = Rig(Spheres(), particles[::-1], seed=seeds[::-1], **SHAKEN).run(10_000)
    for s in range(4):
        alone = Rig(Spheres(), particles[s], seed=seeds[s], **SHAKEN).run(10_000)
        assert np.array_equal(final(together, s), final(alone))
        assert np.array_equal(final(reverse, 3 - s), final(alone))


def test_launches_of_any_length_give_the_same_bits():
    whole = Rig(Spheres(), 30, **SHAKEN).run(5000)
    parts = Rig(Spheres(), 30, **SHAKEN)
    for steps in (1, 7, 992, 4000):
        parts.run(steps)
    assert np.array_equal(final(whole), final(parts))


def digest():
    """Of a batch of eight scenes, shaken for 5000 steps."""
    rig = Rig(Spheres(rotation=True), [10, 20, 30, 40] * 2, seed=np.arange(8), **SHAKEN).run(5000)
    places, velocities = rig.states()
    used = np.arange(160) < rig.in_use(rig.table.particles)[:, None]
    return hashlib.sha256(places[used].tobytes() + velocities[used].tobytes()).hexdigest()


def test_number_of_threads_changes_no_bit():
    program = (
        "from taichi_dem import runtime; runtime.start(threads=1); "
        "from tests.ca_spheres.test_bits import digest; print(digest())"
    )
    root = Path(__file__).resolve().parents[2]
    run = subprocess.run(
        [sys.executable, "-c", program], cwd=root, capture_output=True, text=True, timeout=300
    )
    assert run.returncode == 0, run.stderr
    assert run.stdout.strip() == digest()


def test_seeds_give_different_starts():
    rig = Rig(Spheres(), 50, dt=DT, seed=[1, 2])
    assert not np.array_equal(*rig.states()[0])
