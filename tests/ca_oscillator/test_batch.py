"""A scene has its bits in any batch, and one that diverges is named and harms no other."""

import hashlib
import os
import subprocess
import sys

import numpy as np
import pytest

from ca_damper import (
    Batch,
    SceneTable,
    SimulationDiverged,
)
from taichi_dem import Checkpoint
from tests.ca_oscillator.kicks import BAD_SEED, Kicks
from tests.scenes import ROOT

PARTICLES, SEEDS, FREQUENCIES = [0, 5, 2, 9, 1], [1, 2, 3, 4, 5], [5.0, 5.5, 6.0, 6.5, 7.0]
KICKS = Kicks(strength=2e-5, mass=0.005)


def kicked(rows):
    """Everything that scenes of these rows measure and end with."""
    pick = [[column[k] for k in rows] for column in (PARTICLES, SEEDS, FREQUENCIES)]
    table = SceneTable(*pick[:2], 5e-4, pick[2], 0.6e-3)
    batch = Batch(KICKS, table, measured_cycles=2)
    batch.start()
    cycles = batch.run(1, 2)
    now = batch.sample()
    return np.column_stack([cycles.record.reshape(len(rows), -1), now["x"], now["v"], now["a"]])


def test_company_and_order_in_a_batch_change_no_bit():
    together = kicked(range(5))
    assert np.array_equal(kicked([4, 2, 0, 3, 1])[[2, 4, 1, 3, 0]], together)
    assert np.array_equal(kicked([3])[0], together[3])


_DIGEST = """
import hashlib
from ca_damper import runtime
runtime.start(threads=3)
from tests.ca_oscillator.test_batch import kicked
print(hashlib.sha256(kicked(range(5)).tobytes()).hexdigest())
"""


def test_number_of_threads_changes_no_bit(tmp_path):
    (tmp_path / "script.py").write_text(_DIGEST)
    environment = {**os.environ, "PYTHONPATH": ROOT}
    command = [sys.executable, tmp_path / "script.py"]
    found = subprocess.check_output(command, text=True, env=environment)
    assert found.strip() == hashlib.sha256(kicked(range(5)).tobytes()).hexdigest()


def diverging(if_diverged="raise", **kicks):
    table = SceneTable([4, 5, 6], [1, BAD_SEED, 2], 1e-3, 6.0, 0.6e-3)
    batch = Batch(Kicks(**kicks), table, measured_cycles=3, if_diverged=if_diverged)
    batch.start()
    return batch


def test_a_scene_that_diverges_is_named_with_the_time_and_a_step_that_helps():
    with pytest.raises(SimulationDiverged) as caught:
        diverging(diverges_at=340).run(10, 0)
    error = caught.value
    dt = 1.0 / (167 * 6.0)
    assert (error.scene["particles"], error.scene["seed"]) == (5, BAD_SEED)
    # Health is asked every 64 steps and at the end of each cycle, here of 167.
    assert 340 < error.step <= 340 + 65
    assert error.time_s == pytest.approx(error.step * dt)
    assert error.dt == pytest.approx(dt)
    assert error.dt_allowed == pytest.approx(0.25 * dt)


ONE_OF_THREE = "1 of 3 scenes diverged; their results are nan.*particles = 5 and seed 13 at 6 Hz"


def test_the_end_of_a_scene_does_not_end_the_others(tmp_path):
    """They keep the bits that they have alone, also after a checkpoint; all is nan of the lost."""
    kicks = {"strength": 1e-3, "diverges_at": 340}
    file = tmp_path / "run.checkpoint"
    alone = Batch(Kicks(**kicks), SceneTable([4, 6], [1, 2], 1e-3, 6.0, 0.6e-3), measured_cycles=3)
    alone.start()
    wanted = alone.run(1, 3).record
    del alone
    for saved in (None, file):
        batch = diverging("nan", **kicks)
        with batch.checkpointed(Checkpoint(file), saved, {}) as writer:
            with pytest.warns(UserWarning, match=ONE_OF_THREE):
                found = batch.run(1, 3).record
            writer.save()
        assert np.array_equal(found[[0, 2]], wanted) and np.isnan(found[1]).all()
        assert batch.diverged.tolist() == [False, True, False]
        for name, values in batch.sample().items():
            assert np.isfinite(values).tolist() == [True, name == "time_s", True]
        del batch, writer
