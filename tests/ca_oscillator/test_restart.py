"""Batches that go on from a checkpoint, in the middle of a launch's way, to the same bits."""

import os
import signal

import numpy as np
import pytest

from ca_damper import (
    Automaton,
    Batch,
    InputError,
    RigidMass,
    SceneTable,
    Spheres,
    frequency_response,
    runtime,
    sweep_up_and_down,
)
from taichi_dem import Checkpoint
from taichi_dem.kit.checkpoint import Interrupted
from taichi_dem.kit.field_memory import fields_of
from tests.equivalence.test_restart import every_field

IDENTITY = {"job": "a test"}


class CtrlCAt:
    """A progress callback that stands for a user who presses Ctrl-C at its n-th call of a run."""

    def __init__(self, call):
        self.left = call

    def __call__(self, progress):
        self.left -= progress.phase == "running"
        if self.left == 0:
            os.kill(os.getpid(), signal.SIGINT)


class Shaken:
    """Three scenes of a filling, and all that their run gives."""

    def __init__(self, filling, dt):
        before = every_field()
        table = SceneTable([4, 7, 9], [1, 2, 3], dt, [5.0, 6.0, 6.5], 3e-3)
        self.batch = Batch(filling, table, measured_cycles=1)
        self.made = [field for key, field in every_field().items() if key not in before]

    def run(self, progress=None):
        """One cycle to get going and one that is measured."""
        cycles = self.batch.run(1, 1, progress)
        return {"record": cycles.record, **self.batch.sample(), **self.batch.memory.read()}


@pytest.fixture(
    params=[
        (Automaton(), 1e-3),
        pytest.param((Spheres(), 2e-5), marks=pytest.mark.slow),
    ],
    ids=["automaton", "spheres"],
)
def shaken(request, compiled_anew):
    return Shaken(*request.param)


def test_every_field_of_a_batch_is_saved_but_what_its_filling_says(shaken):
    """A checkpoint leaves out what ``load`` writes, and forces within a step."""
    engine = shaken.batch.engine
    kept = [one.field for one in engine.table.made]
    kept += [one.field for one in fields_of(engine)]
    assert len(shaken.made) > 20
    assert [field for field in shaken.made if id(field) not in set(map(id, kept))] == []
    left_out = [one.name for one in fields_of(engine) if one.kind != "saved"]
    named = ("lattice", "placement", "start", "tree._anchor", "pair_forces")
    assert all(any(part in name for part in named) for name in left_out)


def test_an_interrupted_batch_goes_on_to_the_same_bits(shaken, tmp_path):
    """Interrupted after its second launch of a few steps; other steps are taken in between."""
    batch, checkpoint = shaken.batch, Checkpoint(tmp_path / "run.npz")
    batch.start()
    straight, steps = shaken.run(), batch.scene_steps
    batch.start()
    batch.launches.pace = 3.0
    with pytest.raises(Interrupted, match=r"interrupted at t = .* s, saved in .*run.npz"):
        with batch.checkpointed(checkpoint, None, IDENTITY):
            shaken.run(CtrlCAt(2))
    done = batch._read_status()[0]
    assert (done > 0).all()
    assert (done < 2 * batch.steps_per_cycle).all()
    batch.start("rigid")
    batch.advance(7)
    with batch.checkpointed(None, checkpoint.path, IDENTITY):
        resumed = shaken.run()
    assert [name for name in straight if straight[name].tobytes() != resumed[name].tobytes()] == []
    assert batch.scene_steps == 2 * steps
    with pytest.raises(InputError, match="of another job: a test, not another"):
        batch.checkpointed(None, checkpoint.path, {"job": "another"}).__enter__()


def test_a_checkpoint_goes_on_in_an_engine_with_more_room(tmp_path, compiled_anew):
    """As in another session, where a larger batch came first: a box, scenes and cycles more."""
    table = SceneTable([4, 7], [1, 2], 1e-3, [5.0, 6.0], 3e-3)
    checkpoint = Checkpoint(tmp_path / "run.npz")
    made = Batch(Automaton(), table, measured_cycles=2)
    made.start()
    made.run(1, 0)
    with made.checkpointed(checkpoint, None, IDENTITY) as writer:
        writer.save()
        straight = made.run(0, 2).record
    capacity = made.engine.capacity
    runtime.clear()
    large = SceneTable([1] * 70, 1, 1e-3)
    Batch(Automaton(columns=20, rows=20), large, measured_cycles=40)
    again = Batch(Automaton(), table, measured_cycles=2)
    assert all(more > less for more, less in zip(again.engine.capacity, capacity))
    again.start()
    with again.checkpointed(None, checkpoint.path, IDENTITY):
        again.going_on = False
        assert again.run(0, 2).record.tobytes() == straight.tobytes()


#: Of a container with a rigid mass: little to compile.
JOB = {"particles": 3, "ratios": [0.9, 1.0], "seeds": 2, "dt": 1e-3, "measured_cycles": 2}


@pytest.mark.parametrize("work", [frequency_response, sweep_up_and_down])
def test_responses_and_sweeps_go_on_to_the_same_bits(work, tmp_path):
    """A sweep is stopped in its third of four stages; a finished one is read, not run again."""
    checkpoint = Checkpoint(tmp_path / "run.npz")
    job = {**JOB, "transient_cycles": 20}
    straight = measures(work(RigidMass(), **job))
    calls = 3 if work is frequency_response else 2
    with pytest.raises(Interrupted):
        work(RigidMass(), checkpoint=checkpoint, progress=CtrlCAt(calls), **job)
    for _ in range(2):
        told = []
        resumed = work(
            RigidMass(), checkpoint=checkpoint, resume=checkpoint.path, progress=told.append, **job
        )
        assert [a.tobytes() for a in measures(resumed)] == [a.tobytes() for a in straight]
        run = [progress for progress in told if progress.phase == "running"]
        if run:
            assert run[-1].share == 1.0
    with pytest.raises(InputError, match="of another filling: RigidMass"):
        work(RigidMass(1e-3), resume=checkpoint.path, **job)


def measures(result):
    """The measures of a response, or of both ways of a sweep."""
    ways = (result.up, result.down) if hasattr(result, "up") else (result,)
    return [np.asarray(getattr(way, name)) for way in ways for name in ("rms", "energy", "dt")]
