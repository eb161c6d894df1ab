"""Structures under signals: exact solutions, order of the interpolant, samples, restarts, bits."""

import dataclasses
import os
import signal

import numpy as np
import pytest

from ca_damper import (
    Automaton,
    Batch,
    Empty,
    InputError,
    Oscillator,
    RigidMass,
    SceneTable,
    Spheres,
    excitation,
    shake,
)
from ca_damper.excitation import Excitation, SineForce
from taichi_dem import Checkpoint
from taichi_dem.kit.checkpoint import Interrupted
from tests.ca_excitation.exact import response

PAPER = Oscillator()
TWO = ((4.3, 0.6e-3, 0.4), (9.1, 0.2e-3, -1.1))


def two_sines(duration=1.5, **options):
    frequencies, amplitudes, phases = zip(*TWO)
    return excitation.sines(frequencies, amplitudes, duration, phases=phases, **options)


def worst(history, wanted):
    return np.abs(history.x[:, 0, 0] - wanted).max()


def test_empty_container_under_two_sines_moves_as_the_exact_solution():
    made = shake(Empty(), two_sines(), particles=0, seeds=1)
    x, v = response(PAPER, made.time_s, TWO)
    # The spline is off by 3e-6 of the amplitude at most, the structure amplifies by 41 at most.
    allowed = 41 * 3e-6 * 0.8e-3
    assert worst(made, x) < allowed
    assert np.abs(made.v[:, 0, 0] - v).max() < 2 * np.pi * 9.1 * allowed
    fine = response(PAPER, np.arange(15001) * 1e-4, TWO)[0]
    assert made.peak[0, 0] == pytest.approx(np.abs(fine).max(), rel=1e-4)
    assert made.rms[0, 0] == pytest.approx(fine.std(), rel=1e-3)


def test_error_falls_with_the_fourth_power_of_the_signal_s_step():
    errors = []
    for nodes in (8, 16, 32):
        made = shake(Empty(), two_sines(step=1 / (9.1 * nodes)), particles=0, seeds=1)
        errors.append(worst(made, response(PAPER, made.time_s, TWO)[0]))
    ratios = np.array(errors[:-1]) / errors[1:]
    # Fourth order, or more where the filter of the structure averages the error's sign.
    assert (ratios > 2.0**3.5).all(), errors


def test_rigid_mass_hangs_on_the_structure_like_a_larger_one():
    made = shake(RigidMass(gravity=0.0), two_sines(), particles=40, seeds=1)
    assert worst(made, response(PAPER, made.time_s, TWO, mass=40 * 0.2e-3)[0]) < 1e-7


@pytest.mark.parametrize("form", ["sine", "signal"])
def test_force_moves_the_container_as_the_exact_solution(form):
    of_force = (5.7, 3e-2, 0.7)
    force = SineForce(of_force[1], of_force[0], of_force[2])
    if form == "signal":
        force = excitation.sines(*of_force[:2], 1.5, phases=of_force[2])
    made = shake(Empty(), Excitation(force=force), particles=0, seeds=1, duration=1.5)
    static = of_force[1] / PAPER.stiffness
    wanted = response(PAPER, made.time_s, force=(of_force,))[0]
    # A sine in closed form is integrated to the tolerance of RK45, 1e-9 a step, 60 of them.
    assert worst(made, wanted) < (1e-6 if form == "sine" else 41 * 3e-6) * static
    assert made.base == pytest.approx(0.0, abs=0.0)


def test_force_acts_beside_the_table_s_sine():
    table = SceneTable(0, 1, 1e-4, [5.0, 8.0], 0.6e-3)
    force = SineForce(1e-2, [6.5, 3.0], [0.3, 0.0])
    batch = Batch(
        *(Empty(), table), measured_cycles=1, excitation=Excitation(force=force), recorded_samples=1
    )
    batch.start()
    batch.run(3, 0)
    now = batch.sample()
    for s, (base, forced) in enumerate((((5.0, 0.0), (6.5, 0.3)), ((8.0, 0.0), (3.0, 0.0)))):
        times = np.array([0.0, now["time_s"][s]])
        sines = (base[0], 0.6e-3, 0.0), (forced[0], 1e-2, forced[1])
        x, v = response(PAPER, times, sines[:1], sines[1:])
        assert now["x"][s] == pytest.approx(x[1], abs=1e-9)
        assert now["v"][s] == pytest.approx(v[1], abs=1e-7)


def test_a_container_on_a_moving_base_moves_as_the_signal():
    motion = two_sines()
    made = shake(Empty(), motion, particles=0, seeds=1, mount="base", interval=7e-3)
    value, slope, _ = motion.at(np.minimum(made.time_s, motion.duration))
    assert made.x[:, 0, 0] == pytest.approx(value, abs=1e-15)
    assert made.v[:, 0, 0] == pytest.approx(slope, abs=1e-12)
    assert made.base == pytest.approx(value, abs=1e-15)


def test_an_acceleration_drives_the_base_by_its_double_integral():
    """A constant pull: linear in time, which the spline holds without an error."""
    time = np.arange(0.0, 1.0001, 0.01)
    motion = excitation.from_samples(time, time, of="acceleration")
    made = shake(Empty(), motion, particles=0, seeds=1)
    assert made.base == pytest.approx(made.time_s**3 / 6.0, abs=1e-15)


def test_scenes_may_have_a_signal_each_and_share_no_bit():
    both = two_sines(), excitation.sweep(3.0, 9.0, 5e-4, 1.5)
    table = SceneTable([3, 3], [1, 1], 1e-4, 1.0)
    together = Batch(Automaton(), table, measured_cycles=1, excitation=both)
    together.start()
    record = together.run(0, 1).record
    for k, motion in enumerate(both):
        alone = Batch(Automaton(), SceneTable(3, 1, 1e-4, 1.0), excitation=motion)
        alone.start()
        assert np.array_equal(alone.run(0, 1).record[0], record[k])


@pytest.mark.parametrize(("filling", "dt"), [(Automaton(), 1e-4), (Spheres(), 2e-5)])
def test_momentum_closes_and_recording_changes_no_bit(filling, dt):
    motion, bits = two_sines(0.4), []
    for samples in (0, 1000):
        table = SceneTable([20, 40], 1, dt, 2.5)
        batch = Batch(
            *(filling, table), measured_cycles=1, excitation=motion, recorded_samples=samples
        )
        batch.start()
        bits.append(batch.run(0, 1, record_every=20 if samples else 0).record)
        assert batch.report().momentum_error < 1e-9
    assert np.array_equal(*bits)


def test_samples_are_those_of_a_run_in_pieces():
    motion = two_sines(0.4)
    made = shake(Automaton(), motion, particles=[5, 20], seeds=[7], interval=2e-3)
    assert made.x.shape == (201, 2, 1) and made.time_s[-1] == pytest.approx(0.4)
    table = SceneTable([5, 20], 7, 1e-4, 2.5)
    batch = Batch(Automaton(), table, excitation=motion)
    batch.start()
    for k in range(1, 4):
        pushed = np.zeros(2)
        for _ in range(20):
            batch.advance(1)
            now = batch.sample()
            pushed = pushed + now["force"]
        for name, given in (("x", made.x), ("v", made.v)):
            assert np.array_equal(now[name], given[k, :, 0])
        assert now["y"] == pytest.approx(made.base[k], abs=1e-15)
        assert made.force[k, :, 0] == pytest.approx(pushed / 20, rel=1e-12)


def test_forces_between_samples_leave_none_out():
    """Seven steps to a sample and three at the end: their impulse is that of every step."""
    given, both = SceneTable(20, 1, 1e-4, 10.0), []
    for every in (7, 1):
        batch = Batch(
            *(Automaton(), given),
            excitation=two_sines(0.4),
            measured_cycles=1,
            recorded_samples=1000,
        )
        batch.start()
        batch.run(0, 1, record_every=every)
        series = batch.time_series()
        both.append((series["force"][1:, 0] * np.diff(series["time_s"][:, 0])).sum())
    assert both[0] == pytest.approx(both[1], rel=1e-12) and both[0] < -1e-4


def test_a_dashpot_s_work_is_read_as_damping():
    """The work on a rigid mass is its energy at the end."""
    motion = two_sines(1.5)
    made = shake(RigidMass(gravity=0.0), motion, particles=40, seeds=1, interval=1e-4)
    at_end = 0.5 * 40 * 0.2e-3 * made.v[-1, 0, 0] ** 2
    speed = made.v[:, 0, 0] - motion.at(np.minimum(made.time_s, motion.duration))[1]
    moved = np.trapezoid(speed**2, made.time_s)
    assert made.relative_rms[0, 0] == pytest.approx((made.x[:, 0, 0] - made.base).std())
    assert made.relative_peak[0, 0] == np.abs(made.x[:, 0, 0] - made.base).max()
    assert made.added_damping[0, 0] == pytest.approx(at_end / moved, rel=1e-3)
    own = PAPER.damping_ratio
    ratio = own * (1.0 + made.added_damping[0, 0] / PAPER.damping)
    assert made.damping_ratio[0, 0] == pytest.approx(ratio)


def test_an_interrupted_run_goes_on_to_the_same_bits(tmp_path):
    motion, file = two_sines(0.8), tmp_path / "run.npz"
    few = {"particles": [5, 20], "seeds": 2, "interval": 2e-3}
    whole = shake(Automaton(), motion, **few, progress=None)

    def stop(progress):
        if progress.phase == "running":
            os.kill(os.getpid(), signal.SIGINT)

    with pytest.raises(Interrupted):
        shake(Automaton(), motion, **few, progress=stop, checkpoint=Checkpoint(file))
    resumed = shake(Automaton(), motion, **few, progress=None, resume=file)
    renamed = dataclasses.replace(motion, label="of another name")
    shake(Automaton(), renamed, **few, progress=None, resume=file)
    for name in ("time_s", "base", "x", "v", "force", "rms", "peak"):
        assert np.array_equal(getattr(whole, name), getattr(resumed, name)), name
    with pytest.raises(InputError, match="another excitation"):
        shake(Automaton(), motion.scaled(1.1), **few, progress=None, resume=file)


def test_a_history_is_written_with_a_column_a_scene(tmp_path):
    made = shake(Empty(), two_sines(0.2), particles=0, seeds=[3], interval=0.05)
    made.write_csv(tmp_path / "history.csv")
    lines = (tmp_path / "history.csv").read_text().splitlines()
    assert lines[0] == "time_s,base_m,x_m_N0_seed3,force_N_N0_seed3" and len(lines) == 6
    assert made.relative[:, 0, 0] == pytest.approx(made.x[:, 0, 0] - made.base)


REFUSED = [
    ({"excitation": None}, "excitation must be a Signal"),
    ({"excitation": 3.0}, "excitation must be a Signal"),
    ({"duration": 2.0}, "within its excitation of 0.2 s"),
    ({"duration": -1.0}, "duration must be"),
    ({"interval": 0.0}, "interval must be"),
    ({"excitation": Excitation(force=SineForce(1.0, 1.0))}, "duration must be given"),
    ({"mount": "wall"}, "mount must be one of"),
    ({"excitation": [two_sines(0.2)] * 2}, "one for all scenes"),
    (
        {"excitation": Excitation(two_sines(0.2), SineForce(1.0, 1.0)), "mount": "base"},
        "force must be None",
    ),
]


@pytest.mark.parametrize(("changes", "words"), REFUSED)
def test_what_cannot_be_shaken_is_refused(changes, words):
    given = {"excitation": two_sines(0.2), "particles": 0, "seeds": 1, **changes}
    with pytest.raises(InputError, match=words):
        shake(Empty(), **given)


def test_a_batch_under_a_signal_refuses_what_only_a_sine_has():
    table = SceneTable(0, 1, 1e-4, 10.0)
    batch = Batch(Empty(), table, excitation=two_sines(0.5), measured_cycles=1)
    with pytest.raises(InputError, match="start must be one of rest"):
        batch.start("empty")
    with pytest.raises(InputError, match="displacement must be finite"):
        batch.start(displacement=float("nan"))
    batch.start()
    with pytest.raises(InputError, match="single sine"):
        batch.drive(5.0)
    with pytest.raises(InputError, match="recorded_samples"):
        batch.run(0, 1, record_every=10)
    with pytest.raises(InputError, match="record_every"):
        batch.time_series()
    with pytest.raises(InputError, match="within its excitation"):
        batch.run(5, 1)
    batch.run(4, 1)


def test_a_container_let_go_decays_as_the_closed_form():
    """From a displacement and a speed, on a base that stands still: exact to RK45's tolerance."""
    batch = Batch(
        Empty(), SceneTable(0, 1, 1e-4, 10.0, 0.0), measured_cycles=1, recorded_samples=200
    )
    batch.start(displacement=5e-3, velocity=0.1)
    batch.run(10, 0, record_every=100)
    series = batch.time_series()
    x, v = response(PAPER, series["time_s"][:, 0], start=(5e-3, 0.1))
    assert series["x"][:, 0] == pytest.approx(x, abs=1e-9)
    assert series["v"][:, 0] == pytest.approx(v, abs=1e-7)
