"""Runs of structures with boxes: groups and restarts to the bit."""

import os
import signal

import numpy as np
import pytest

from ca_damper import Automaton, Box, InputError, excitation, shake_structure
from taichi_dem import Checkpoint
from taichi_dem.kit.checkpoint import Interrupted
from tests.ca_modes.frames import two_storeys

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


def test_an_interrupted_run_goes_on_to_the_same_bits(tmp_path):
    file, whole = tmp_path / "run.checkpoint", shaken()

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
