"""Batches: the same bits in any company, bounded launches, divergence of scenes, Ctrl-C."""

import hashlib
import json
import math
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

from ca_damper import (
    Batch,
    Empty,
    InputError,
    RigidMass,
    SceneTable,
    SimulationDiverged,
    excitation,
    frequency_response,
    runtime,
    shake,
    sweep_up_and_down,
)
from ca_damper.engine import launches
from ca_damper.progress import BatchProgress, Stages
from ca_damper.scenes.clock import steps_per_cycle
from ca_damper.scenes.table import dealt
from taichi_dem import Checkpoint
from taichi_dem.kit.progress.progress import Compiling
from tests.ca_oscillator.kicks import BAD_SEED, CODE, Kicks
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
    for k in (1, 3):
        assert np.array_equal(kicked([k])[0], together[k])


def test_number_of_launches_changes_no_bit(monkeypatch):
    once = kicked(range(5))
    told = []
    monkeypatch.setattr(launches, "LAUNCH_SECONDS", 1e-9)
    table = SceneTable(PARTICLES, SEEDS, 5e-4, FREQUENCIES, 0.6e-3)
    batch = Batch(KICKS, table, measured_cycles=2)
    batch.launches.pace = 100.0
    batch.start()
    cycles = batch.run(1, 2, told.append)
    assert len(told) > 20
    assert np.array_equal(once[:, :-3], cycles.record.reshape(5, -1))


_DIGEST = """
import hashlib
from ca_damper import runtime
runtime.start(threads={threads})
from tests.ca_oscillator.test_batch import kicked
print(hashlib.sha256(kicked(range(5)).tobytes()).hexdigest())
"""


@pytest.mark.parametrize("threads", [1, 3])
def test_number_of_threads_changes_no_bit(tmp_path, threads):
    assert runtime.settings().threads == 2
    done = script(tmp_path, _DIGEST.format(threads=threads)).communicate(timeout=120)
    assert done[0].strip() == hashlib.sha256(kicked(range(5)).tobytes()).hexdigest()


def script(folder, text):
    """A process that runs a script."""
    path = folder / "script.py"
    path.write_text(text)
    environment = {**os.environ, "PYTHONPATH": ROOT}
    pipe = subprocess.PIPE
    return subprocess.Popen([sys.executable, path], stdout=pipe, text=True, env=environment)


def test_a_straight_run_equals_one_in_parts():
    table = SceneTable(3, 1, 5e-4, 6.0, 0.6e-3)
    straight, parted = Batch(KICKS, table), Batch(KICKS, table)
    steps = 3 * straight.steps_per_cycle[0]
    for batch in (straight, parted):
        batch.start()
    straight.advance(steps)
    for part in (1, 0, 17, steps - 18):
        parted.advance(part)
    for name, value in straight.sample().items():
        assert np.array_equal(value, parted.sample()[name]), name


@pytest.mark.parametrize("steps", [-1, 1.5, [1, -1], math.nan, "3"])
def test_steps_that_are_none_are_refused(steps):
    batch = Batch(Empty(), SceneTable([0, 0], 1, 5e-4, 6.0))
    with pytest.raises(InputError, match=r"call start\(\) first"):
        batch.advance(1)
    batch.start()
    with pytest.raises(InputError, match="steps must be whole numbers"):
        batch.advance(steps)


def test_a_batch_leaves_the_table_that_it_is_made_with_as_it_is():
    table = SceneTable([3, 4], 1, 5e-4, 6.0, 0.6e-3)
    before = {name: table.column(name).tolist() for name in table.COLUMNS}
    batch = Batch(KICKS, table)
    batch.start()
    batch.drive(6.3)
    batch.change(particles=2)
    assert {name: table.column(name).tolist() for name in table.COLUMNS} == before


def test_a_refused_change_leaves_the_batch_as_it_is():
    batches = [Batch(KICKS, SceneTable(3, 1, 5e-4, 6.0, 0.6e-3)) for _ in range(2)]
    for batch in batches:
        batch.start()
        batch.run(1, 0)
    with pytest.raises(InputError, match="mass must be"):
        batches[0].change(seed=7, mass=-1.0)
    with pytest.raises(InputError, match="dt must lie"):
        batches[0].drive(1e5)
    for batch in batches:
        batch.run(1, 0)
    assert batches[0].sample()["x"] == batches[1].sample()["x"]


def test_a_new_start_repeats_the_run():
    batch = Batch(KICKS, SceneTable(3, 1, 5e-4, 6.0, 0.6e-3), measured_cycles=1)
    records = []
    for _ in range(2):
        batch.start("rigid")
        records.append(batch.run(1, 1).record)
    assert np.array_equal(*records)


def test_steps_make_whole_cycles_and_never_grow():
    assert steps_per_cycle(6.0, 1e-4) == 1667
    assert steps_per_cycle(5.0, 1e-4) == 2000
    assert steps_per_cycle(1.0 / 0.1667, 1e-4) == 1667
    frequency = np.linspace(4.0, 8.0, 50)
    batch = Batch(Empty(), SceneTable(0, 1, 1e-4, frequency))
    dt = batch.table.column("dt")
    assert (dt <= 1e-4 * (1.0 + 1e-12)).all()
    assert batch.steps_per_cycle * dt * frequency == pytest.approx(1.0, rel=1e-15)


def test_a_cycle_ends_exactly_where_it_began():
    batch = Batch(Empty(), SceneTable(0, 1, 1e-4, FREQUENCIES, 0.6e-3))
    batch.start()
    batch.advance(batch.steps_per_cycle)
    assert (batch.engine.table.in_use(batch.engine.clock.circle) == [0.0, 1.0]).all()
    assert (batch.sample()["y"] == 0.0).all()


def test_energy_is_taken_at_the_end_of_every_measured_cycle():
    batch = Batch(KICKS, SceneTable(0, 1, 5e-4, 6.0, 0.6e-3), measured_cycles=3)
    batch.start()
    energy = batch.run(2, 3).record[0, :, -1]
    steps = batch.steps_per_cycle[0]
    assert np.array_equal(energy, steps * np.array([3, 4, 5]) - 1)


def test_driving_on_at_another_frequency():
    batch = Batch(RigidMass(), SceneTable([0, 30], 1, 1e-4, 5.0, 0.6e-3), measured_cycles=2)
    batch.start()
    batch.run(1, 0)
    before = batch.sample()
    batch.drive(6.2)
    after = batch.sample()
    assert np.array_equal(before["x"], after["x"])
    assert np.array_equal(before["v"], after["v"])
    assert after["time_s"] == pytest.approx(0.2, rel=1e-14)
    # The base goes faster at once, and pushes by its dashpot: C y0 2 pi (6.2 - 5) / (M + N m).
    mass = 0.086 + 0.2e-3 * np.array([0, 30])
    push = 0.08 * 0.6e-3 * 2.0 * math.pi * 1.2 / mass
    assert after["a"] - before["a"] == pytest.approx(push, rel=1e-9)
    batch.run(250, 0)
    assert batch.sample()["time_s"] == pytest.approx(0.2 + 250 / 6.2, rel=1e-14)
    batch.advance(10)
    with pytest.raises(InputError, match="scene 0 stands at step 10 of 1613"):
        batch.drive(5.0)
    with pytest.raises(InputError, match="scene 0 stands at step 10 of 1613"):
        batch.run(1, 1)


def diverging(if_diverged="raise", seeds=(1, BAD_SEED, 2), **kicks):
    table = SceneTable([4, 5, 6][: len(seeds)], list(seeds), 1e-3, 6.0, 0.6e-3)
    batch = Batch(Kicks(**kicks), table, measured_cycles=3, if_diverged=if_diverged)
    batch.start()
    return batch


def test_divergence_of_a_filling_is_told_in_its_words():
    with pytest.raises(SimulationDiverged) as caught:
        diverging(diverges_at=340).run(10, 0)
    error = caught.value
    dt = 1.0 / (167 * 6.0)
    assert error.scene["particles"] == 5
    # Health is asked every 64 steps and at the end of each cycle, here of 167.
    assert 340 < error.step <= 340 + 65
    assert error.time_s == pytest.approx(error.step * dt)
    assert error.dt == pytest.approx(dt)
    assert error.dt_allowed == pytest.approx(0.25 * dt)
    assert f"particles = 5 and seed {BAD_SEED} at 6 Hz" in str(error)
    assert f"it went wrong with code {CODE}; dt must be at most 0.00025 s" in str(error)
    assert "\n" not in str(error)


def test_a_filling_that_starts_diverged_is_found_at_once():
    with pytest.raises(SimulationDiverged, match="by step 0"):
        diverging(diverges_at=0)


def test_nan_in_the_container_s_motion_is_divergence():
    with pytest.raises(SimulationDiverged, match="lost its container") as caught:
        diverging(lost_at=200).run(10, 0)
    assert caught.value.step == 201
    assert caught.value.scene["seed"] == BAD_SEED


def test_a_blow_beyond_all_bounds_is_divergence():
    batch = Batch(Kicks(strength=1e12), SceneTable(1, 1, 1e-3, 6.0, 0.6e-3))
    batch.start()
    with pytest.raises(SimulationDiverged, match="lost its container"):
        batch.run(1, 0)


ONE_OF_THREE = "1 of 3 scenes diverged; their results are nan.*particles = 5 and seed 13 at 6 Hz"


def test_the_end_of_a_scene_does_not_end_the_others(tmp_path):
    """They keep the bits that they have alone, also after a checkpoint; all is nan of the lost."""
    kicks = {"strength": 1e-3, "diverges_at": 340}
    file = tmp_path / "run.npz"
    batch = diverging("nan", **kicks)
    with batch.checkpointed(Checkpoint(file), None, {}) as writer:
        with pytest.warns(UserWarning, match=ONE_OF_THREE):
            first = batch.run(1, 3)
        writer.save()
    assert batch.diverged.tolist() == [False, True, False]
    resumed = diverging("nan", **kicks)
    with resumed.checkpointed(None, file, {}), pytest.warns(UserWarning, match=ONE_OF_THREE):
        assert np.array_equal(resumed.run(1, 3).record, first.record, equal_nan=True)
    for one in (batch, resumed):
        one.drive(7.0)
    second, again = batch.run(0, 2), resumed.run(0, 2)
    each = batch.measure_each(1)
    alone = Batch(Kicks(**kicks), SceneTable([4, 6], [1, 2], 1e-3, 6.0, 0.6e-3), measured_cycles=3)
    alone.start()
    wanted = alone.run(1, 3)
    assert np.array_equal(first.record[[0, 2]], wanted.record)
    alone.drive(7.0)
    wanted = alone.run(0, 2)
    for found in (second, again):
        assert np.array_equal(found.record[[0, 2]], wanted.record)
    for found in (first.record, second.record, again.record, each):
        assert np.isnan(found[1]).all()
    now, report = batch.sample(), batch.report()
    for name, values in now.items():
        assert np.isfinite(values).tolist() == [True, name == "time_s", True]
    assert len(report.diverged) == 1
    assert "1 of them; nan for these" in str(report)
    assert 340 < report.scene_steps - 2 * (4 * 167 + 3 * 143) <= 340 + 65


def test_a_batch_ends_when_all_its_scenes_have():
    batch = diverging("nan", seeds=(BAD_SEED, BAD_SEED), diverges_at=340)
    with pytest.raises(SimulationDiverged, match="particles = 4 and seed 13"):
        batch.run(10, 0)


def test_results_over_several_scenes_are_nan_where_one_diverged():
    """Responses, sweeps and histories, with the numbers of the others as they are alone."""
    seeds, kicks = [1, BAD_SEED, 2], Kicks(strength=1e-3, diverges_at=340)
    job = {"particles": 3, "ratios": [0.9, 1.0, 1.1], "measured_cycles": 3, "dt": 1e-3}
    job["transient_cycles"] = 2
    for call in (frequency_response, sweep_up_and_down):
        with pytest.warns(UserWarning, match="of . scenes diverged"):
            found = call(kicks, seeds=seeds, **job)
        alone = call(kicks, seeds=[1, 2], **job)
        some = (found, alone) if call is frequency_response else (found.down, alone.down)
        assert ">diverged</td>" in some[0]._repr_html_()
        assert np.isnan(some[0].rms[:, :, 1]).all()
        assert np.array_equal(some[0].rms[:, :, [0, 2]], some[1].rms)
        assert found.report.diverged
    ground = excitation.sines([5.0], [1e-3], 0.6)
    with pytest.warns(UserWarning, match="1 of 2 scenes diverged"):
        history = shake(kicks, ground, particles=3, seeds=[BAD_SEED, 1], dt=1e-3)
    alone = shake(kicks, ground, particles=3, seeds=[1], dt=1e-3)
    assert np.isnan(history.x[..., 0]).all()
    for name in ("time_s", "base"):
        assert np.array_equal(getattr(history, name), getattr(alone, name))
    assert np.array_equal(history.x[..., 1], alone.x[..., 0])
    assert "nan" not in repr(history)


def test_launches_are_bounded_and_progress_is_told():
    batch = Batch(RigidMass(), SceneTable(10, 1, 1e-4, [6.0] * 40, 0.6e-3))
    batch.start()
    batch.run(1, 0)
    told, times = [], []

    def tell(progress):
        told.append(progress)
        times.append(time.perf_counter())

    batch.run(150, 0, tell)
    shares = [progress.share for progress in told]
    assert shares == sorted(shares)
    assert shares[-1] == 1.0
    assert told[-1].seconds_left == 0.0
    assert told[-1].steps == 40 * 150 * 1667
    # The pace follows the launch before; a crowded machine may stretch one.
    assert np.median(np.diff(times)) < 2.0 * launches.LAUNCH_SECONDS


def test_time_left_and_stages():
    assert BatchProgress(0.25, 3.0, 10).seconds_left == 9.0
    assert BatchProgress(0.0, 0.0, 0).seconds_left == math.inf
    told = []
    stages = Stages(told.append, [0.5, 1.0])
    for share in (0.5, 1.0, 0.5, 1.0):
        stages.pace.seconds = 0.0
        stages(BatchProgress(share, 2.0 * share, round(10 * share)))
    assert [progress.share for progress in told] == [0.25, 0.5, 0.75, 1.0]
    assert [progress.seconds for progress in told] == [1.0, 2.0, 3.0, 4.0]
    assert [progress.steps for progress in told] == [5, 10, 15, 20]


def test_stages_pass_compiling_on_and_count_it_for_no_stage():
    told = []
    stages = Stages(told.append, [0.5, 1.0])
    compiling = Compiling(1.0, 3.0, "time step")
    stages(compiling)
    stages(BatchProgress(1.0, 2.0, 10))
    assert told[0] is compiling
    assert (told[1].share, told[1].seconds) == (0.5, 2.0)
    Stages(None, [1.0])(compiling)


# A shell that started the tests in the background may have left the signal ignored.
_ENDLESS = """
import signal, time
signal.signal(signal.SIGINT, signal.default_int_handler)
from ca_damper import Batch, RigidMass, SceneTable, runtime
runtime.start(threads=1)
batch = Batch(RigidMass(), SceneTable(10, 1, 1e-4, [6.0] * 400, 0.6e-3))
batch.start()
said = []
def tell(progress):
    if progress.seconds > 0.5 and not said:
        said.append(1)
        print("running", flush=True)
try:
    batch.run(3000, 0, tell)
except KeyboardInterrupt:
    print(time.time(), flush=True)
"""


def test_ctrl_c_ends_a_run_within_half_a_second(tmp_path):
    process = script(tmp_path, _ENDLESS)
    assert process.stdout.readline().strip() == "running"
    time.sleep(0.3)
    sent = time.time()
    process.send_signal(signal.SIGINT)
    assert float(process.communicate(timeout=60)[0]) - sent < 0.5


@pytest.mark.parametrize("threads", [1, 2, 3, 7])
def test_scenes_are_dealt_out_evenly(threads):
    cost = np.random.default_rng(1).integers(1, 100, 50)
    order = dealt(cost, threads)
    assert sorted(order.tolist()) == list(range(50))
    hands = np.array_split(cost[order], threads)
    sums = [hand.sum() / len(hand) for hand in hands]
    assert max(sums) - min(sums) < 100 / (50 // threads)


def test_report_counts_the_steps_of_all_scenes_and_of_their_particles(tmp_path):
    table = SceneTable([0, 3], 1, 1e-3, [5.0, 8.0], 1e-3)
    batch = Batch(RigidMass(), table, measured_cycles=2)
    batch.start()
    batch.run(1, 2)
    report = batch.report()
    # Whole steps a cycle: 200 at 5 Hz and 125 at 8 Hz, three cycles each.
    assert report.scene_steps == 3 * (200 + 125)
    assert report.particle_steps == 3 * 3 * 125
    # Six a try, and at least a try a step.
    assert report.container_evaluations == 6 * batch.attempts().sum() >= 6 * report.scene_steps
    assert report.simulated_s == pytest.approx(3 / 5.0, rel=1e-12)
    assert report.run_seconds == batch.run_seconds
    assert report.particles == (0, 3)
    report.write(tmp_path / "report.json")
    written = json.loads((tmp_path / "report.json").read_text())
    assert written["effects"] == ["fixed mass"]
    assert written["particle_steps"] == report.particle_steps
    assert "fixed mass" in str(report)
