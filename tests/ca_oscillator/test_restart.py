"""Runs go on from a checkpoint, in the middle of a launch's way, to the same bits."""

import errno
import os
import signal

import numpy as np
import pytest

from ca_damper import (
    Automaton,
    Batch,
    Box,
    Checkpoint,
    InputError,
    RigidMass,
    SceneTable,
    excitation,
    frequency_response,
    shake,
    shake_structure,
    sweep_up_and_down,
)
from taichi_dem.kit.checkpoint import Interrupted
from tests.ca_modes.frames import two_storeys

IDENTITY = {"job": "a test"}
TABLE = SceneTable([4, 7, 9], [1, 2, 3], 1e-3, [5.0, 6.0, 6.5], 3e-3)


class CtrlCAt:
    """A progress callback that stands for a user who presses Ctrl-C at its n-th call of a run."""

    def __init__(self, call):
        self.left = call

    def __call__(self, progress):
        self.left -= progress.phase == "stepping"
        if self.left == 0:
            os.kill(os.getpid(), signal.SIGINT)


def result(batch, progress=None):
    """All that one cycle to get going and one that is measured give."""
    cycles = batch.run(1, 1, progress)
    return {"record": cycles.record, **batch.sample(), **batch.memory.read()}


def same_bits(one, other):
    return all(one[name].tobytes() == other[name].tobytes() for name in one)


def test_an_interrupted_batch_goes_on_to_the_same_bits(tmp_path):
    """Interrupted after its second launch of a few steps; other steps are taken in between."""
    checkpoint = Checkpoint(tmp_path / "run.checkpoint")
    batch = Batch(Automaton(), TABLE, measured_cycles=1)
    batch.start()
    straight, steps = result(batch), batch.scene_steps
    batch.start()
    batch.launches.pace = 3.0
    with pytest.raises(Interrupted, match=r"interrupted at t = .* s, saved in .*run.checkpoint"):
        with batch.checkpointed(checkpoint, None, IDENTITY):
            result(batch, CtrlCAt(2))
    batch.start("rigid")
    batch.advance(7)
    with batch.checkpointed(None, checkpoint.path, IDENTITY):
        assert same_bits(straight, result(batch))
    assert batch.scene_steps == 2 * steps
    with pytest.raises(InputError, match="of another job: a test, not another"):
        batch.checkpointed(None, checkpoint.path, {"job": "another"}).__enter__()


MOTION = excitation.random_vibration([2.0, 20.0], [0.1, 0.1], duration=0.5)
#: Of a container with a rigid mass: little to compile.
JOB = {"particles": 3, "ratios": [0.9, 1.0], "seeds": 2, "dt": 1e-3, "measured_cycles": 2}
JOB["transient_cycles"] = 20
SHAKEN = {"excitation": MOTION, "seeds": 2, "dt": 1e-3}
JOBS = {
    frequency_response: JOB,
    sweep_up_and_down: JOB,
    shake: {**SHAKEN, "particles": 3},
    shake_structure: {**SHAKEN, "structure": two_storeys(), "boxes": [Box(1, 3), Box(0, 2)]},
}


@pytest.mark.parametrize("work", JOBS)
def test_runs_go_on_to_the_same_bits(work, tmp_path):
    """A sweep is stopped in its third of four stages; a finished one is read, not run again."""
    checkpoint, job = Checkpoint(tmp_path / "run.checkpoint"), JOBS[work]
    straight = measures(work(RigidMass(), **job))
    calls = 3 if work is frequency_response else 2
    with pytest.raises(Interrupted):
        work(RigidMass(), checkpoint=checkpoint, progress=CtrlCAt(calls), **job)
    for _ in range(2):
        resumed = work(RigidMass(), checkpoint=checkpoint, resume=checkpoint.path, **job)
        assert [a.tobytes() for a in measures(resumed)] == [a.tobytes() for a in straight]
    with pytest.raises(InputError, match="of another filling: RigidMass"):
        work(RigidMass(1e-3), resume=checkpoint.path, **job)
    if "excitation" in job:
        with pytest.raises(InputError, match="another excitation"):
            other = {**job, "excitation": MOTION.scaled(1.1)}
            work(RigidMass(), resume=checkpoint.path, **other)
    if "boxes" in job:
        with pytest.raises(InputError, match="another job"):
            work(RigidMass(), resume=checkpoint.path, **{**job, "boxes": job["boxes"][::-1]})


@pytest.mark.parametrize("work", [frequency_response, sweep_up_and_down, shake])
def test_a_full_disk_at_the_end_does_not_lose_the_result(work, tmp_path, monkeypatch):
    """The error of the last checkpoint carries what the run came to."""
    job = JOBS[work]
    straight, opened = work(RigidMass(), **job), open

    def full(name, mode="r", *rest, **options):
        if "w" in mode:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return opened(name, mode, *rest, **options)

    monkeypatch.setattr("builtins.open", full)
    with pytest.raises(InputError, match="No space left") as refused:
        work(RigidMass(), checkpoint=Checkpoint(tmp_path / "run.checkpoint"), **job)
    found = measures(refused.value.result)
    assert [a.tobytes() for a in found] == [a.tobytes() for a in measures(straight)]


def measures(result):
    """The measures of a response, of both ways of a sweep, or of a history."""
    if hasattr(result, "time_s"):
        return [result.x, result.force, result.rms]
    ways = (result.up, result.down) if hasattr(result, "up") else (result,)
    return [np.asarray(getattr(way, name)) for way in ways for name in ("rms", "energy", "dt")]
