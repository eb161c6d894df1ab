"""Runs of structures with boxes: groups, launches and restarts to the bit, steps, lost groups."""

import os
import signal

import numpy as np
import pytest

from ca_damper import (
    Automaton,
    Batch,
    Box,
    InputError,
    ModalStructure,
    RigidMass,
    SceneTable,
    excitation,
    shake_structure,
)
from ca_damper.engine.modal_mount import ModalMount
from taichi_dem import Checkpoint
from taichi_dem.kit.checkpoint import Interrupted
from tests.ca_modes.frames import two_storeys
from tests.ca_oscillator.kicks import BAD_SEED, Kicks

BOXES = (Box(1, 20), Box(0, 7))
ARRAYS = ("x", "v", "force", "rms", "peak")


def motion(duration=0.3, size=1e-3):
    return excitation.sines([4.5, 13.0], [size, 0.3 * size], duration)


def shaken(**changes):
    given = {"filling": Automaton(), "structure": two_storeys(), "boxes": BOXES}
    given.update(excitation=motion(), seeds=[5, 6, 7], interval=2e-3, progress=None)
    return shake_structure(**{**given, **changes})


def test_a_group_is_the_same_alone_and_among_others():
    together = shaken()
    for j, seed in enumerate(together.seeds):
        alone = shaken(seeds=[seed])
        for name in ARRAYS:
            assert np.array_equal(getattr(alone, name)[..., 0], getattr(together, name)[..., j])
    assert not np.array_equal(together.x[..., 0], together.x[..., 1])


def batch_of(columns, excitation, **options):
    """A batch of groups with boxes at places 1 and 0, which compiles nothing after ``shaken``."""
    mount = ModalMount(two_storeys(), [1, 0])
    same = {"structure": mount, "recorded_samples": 1, "excitation": excitation}
    batch = Batch(Automaton(), SceneTable(*columns), **same)
    batch.start(**options)
    return batch


def test_launches_in_pieces_change_no_bit():
    batches = [batch_of(([20, 7], [5, 6], 1e-4, 10.0), motion(), velocity=0.3) for _ in range(2)]
    batches[0].advance(1000)
    for part in (1, 0, 17, 982):
        batches[1].advance(part)
    whole, parts = (batch.sample() for batch in batches)
    assert all(np.array_equal(whole[name], parts[name]) for name in whole)


def test_an_interrupted_run_goes_on_to_the_same_bits(tmp_path):
    file, whole = tmp_path / "run.npz", shaken()

    def stop(progress):
        if progress.phase == "stepping":
            os.kill(os.getpid(), signal.SIGINT)

    with pytest.raises(Interrupted):
        shaken(progress=stop, checkpoint=Checkpoint(file))
    resumed = shaken(resume=file)
    for name in ARRAYS:
        assert np.array_equal(getattr(whole, name), getattr(resumed, name)), name
    with pytest.raises(InputError, match="another job"):
        shaken(resume=file, boxes=BOXES[::-1])


def test_a_high_mode_chooses_its_own_step():
    stiff = ModalStructure.from_matrices([0.2, 0.15], np.diag([800.0, 0.15e7]), 0.01)
    assert stiff.frequencies[1] > 500.0
    made = shaken(filling=RigidMass(), structure=stiff, excitation=motion(0.05), seeds=1)
    # Steps are shortened to make a whole number of samples, of 40.3 steps here.
    assert made.report.dt_s[0] == pytest.approx(2e-3 / 41.0)
    with pytest.raises(InputError, match=r"dt must be at most 4\.96e-05 s, 40 steps to a cycle"):
        shaken(filling=RigidMass(), structure=stiff, dt=1e-4)


def test_a_lost_structure_does_not_end_the_others():
    """All places of its group are nan, those of another seed have the bits that they have alone."""
    given = {"filling": Kicks(1e-4, diverges_at=500), "boxes": [Box(1, 2), Box(0, 3)]}
    with pytest.warns(UserWarning, match="2 of 4 scenes diverged"):
        made = shaken(**given, seeds=[BAD_SEED, 5])
    alone = shaken(**given, seeds=[5])
    for name in ARRAYS:
        assert np.isnan(getattr(made, name)[..., 0]).all()
        assert np.array_equal(getattr(made, name)[..., 1], getattr(alone, name)[..., 0])
    assert np.array_equal(made.time_s, alone.time_s)
