"""Structures under signals move as the exact solution, and no sample or restart changes a bit."""

import os
import signal

import numpy as np
import pytest

from ca_damper import (
    Automaton,
    Batch,
    InputError,
    Oscillator,
    RigidMass,
    SceneTable,
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


def shaken(given, particles=0, **options):
    """History of a rigid mass without weight under an excitation."""
    return shake(RigidMass(gravity=0.0), given, particles=particles, seeds=1, **options)


def worst(history, wanted):
    return np.abs(history.x[:, 0, 0] - wanted).max()


def test_a_container_under_two_sines_moves_as_the_exact_solution():
    made = shaken(two_sines())
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
        made = shaken(two_sines(step=1 / (9.1 * nodes)))
        errors.append(worst(made, response(PAPER, made.time_s, TWO)[0]))
    ratios = np.array(errors[:-1]) / errors[1:]
    # Fourth order, or more where the filter of the structure averages the error's sign.
    assert (ratios > 2.0**3.5).all(), errors


def test_rigid_mass_hangs_on_the_structure_like_a_larger_one():
    made = shaken(two_sines(), particles=40)
    assert worst(made, response(PAPER, made.time_s, TWO, mass=40 * 0.2e-3)[0]) < 1e-7


@pytest.mark.parametrize("form", ["sine", "signal"])
def test_force_moves_the_container_as_the_exact_solution(form):
    of_force = (5.7, 3e-2, 0.7)
    force = SineForce(of_force[1], of_force[0], of_force[2])
    if form == "signal":
        force = excitation.sines(*of_force[:2], 1.5, phases=of_force[2])
    made = shaken(Excitation(force=force), duration=1.5)
    static = of_force[1] / PAPER.stiffness
    wanted = response(PAPER, made.time_s, force=(of_force,))[0]
    # A sine in closed form is integrated to the tolerance of RK45, 1e-9 a step, 60 of them.
    assert worst(made, wanted) < (1e-6 if form == "sine" else 41 * 3e-6) * static
    assert made.base == pytest.approx(0.0, abs=0.0)


def test_force_acts_beside_the_table_s_sine():
    table = SceneTable(0, 1, 1e-4, [5.0, 8.0], 0.6e-3)
    force = Excitation(force=SineForce(1e-2, [6.5, 3.0], [0.3, 0.0]))
    batch = Batch(RigidMass(), table, excitation=force)
    batch.start()
    batch.run(3, 0)
    now = batch.sample()
    for s, (base, forced) in enumerate(((5.0, (6.5, 1e-2, 0.3)), (8.0, (3.0, 1e-2, 0.0)))):
        times = np.array([0.0, now["time_s"][s]])
        x, v = response(PAPER, times, [(base, 0.6e-3, 0.0)], [forced])
        assert now["x"][s] == pytest.approx(x[1], abs=1e-9)
        assert now["v"][s] == pytest.approx(v[1], abs=1e-7)


def test_a_container_on_a_moving_base_moves_as_the_signal():
    motion = two_sines()
    made = shaken(motion, mount="base", interval=7e-3)
    value, slope, _ = motion.at(np.minimum(made.time_s, motion.duration))
    assert made.x[:, 0, 0] == pytest.approx(value, abs=1e-15)
    assert made.v[:, 0, 0] == pytest.approx(slope, abs=1e-12)
    assert made.base == pytest.approx(value, abs=1e-15)


def test_a_container_let_go_decays_as_the_closed_form():
    """From a displacement and a speed, on a base that stands still: exact to RK45's tolerance."""
    batch = Batch(RigidMass(), SceneTable(0, 1, 1e-4, 10.0, 0.0), recorded_samples=200)
    batch.start(displacement=5e-3, velocity=0.1)
    batch.run(10, 0, record_every=100)
    series = batch.time_series()
    x, v = response(PAPER, series["time_s"][:, 0], start=(5e-3, 0.1))
    assert series["x"][:, 0] == pytest.approx(x, abs=1e-9)
    assert series["v"][:, 0] == pytest.approx(v, abs=1e-7)


def grains(particles, motion, **options):
    """A started batch of automata under one or several signals."""
    batch = Batch(Automaton(), SceneTable(particles, 7, 1e-4, 2.5), excitation=motion, **options)
    batch.start()
    return batch


def test_scenes_may_have_a_signal_each_and_share_no_bit():
    both = two_sines(0.4), excitation.sweep(3.0, 9.0, 5e-4, 0.4)
    options = {"measured_cycles": 1, "recorded_samples": 1}
    together = grains([3, 3], both, **options).run(0, 1).record
    for k, motion in enumerate(both):
        assert np.array_equal(grains(3, motion, **options).run(0, 1).record[0], together[k])


def test_samples_are_those_of_a_run_in_pieces():
    motion = two_sines(0.4)
    made = shake(Automaton(), motion, particles=[5, 20], seeds=[7], interval=2e-3)
    assert made.x.shape == (201, 2, 1) and made.time_s[-1] == pytest.approx(0.4)
    batch = grains([5, 20], motion, recorded_samples=1)
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


def test_forces_between_samples_leave_none_out_and_recording_changes_no_bit():
    """Seven steps to a sample and some at the end: their impulse is that of every step."""
    impulses, records = [], []
    for every in (7, 1):
        batch = grains(20, two_sines(0.4), measured_cycles=1, recorded_samples=5000)
        records.append(batch.run(0, 1, record_every=every).record)
        series = batch.time_series()
        impulses.append((series["force"][1:, 0] * np.diff(series["time_s"][:, 0])).sum())
        assert batch.report().momentum_error < 1e-9
    assert impulses[0] == pytest.approx(impulses[1], rel=1e-12) and impulses[0] < -1e-4
    assert np.array_equal(*records)


def test_a_dashpot_s_work_is_read_as_damping():
    """The work on a rigid mass is its energy at the end."""
    motion = two_sines(1.5)
    made = shaken(motion, particles=40, interval=1e-4)
    at_end = 0.5 * 40 * 0.2e-3 * made.v[-1, 0, 0] ** 2
    speed = made.v[:, 0, 0] - motion.at(np.minimum(made.time_s, motion.duration))[1]
    moved = np.trapezoid(speed**2, made.time_s)
    assert made.relative_rms[0, 0] == pytest.approx((made.x[:, 0, 0] - made.base).std())
    assert made.added_damping[0, 0] == pytest.approx(at_end / moved, rel=1e-3)
    ratio = PAPER.damping_ratio * (1.0 + made.added_damping[0, 0] / PAPER.damping)
    assert made.damping_ratio[0, 0] == pytest.approx(ratio)


def test_an_interrupted_run_goes_on_to_the_same_bits(tmp_path):
    motion, file = two_sines(0.4), tmp_path / "run.npz"
    few = {"particles": [5, 20], "seeds": 2, "interval": 2e-3}
    whole = shake(Automaton(), motion, **few)

    def stop(progress):
        if progress.phase == "stepping":
            os.kill(os.getpid(), signal.SIGINT)

    with pytest.raises(Interrupted):
        shake(Automaton(), motion, **few, progress=stop, checkpoint=Checkpoint(file))
    resumed = shake(Automaton(), motion, **few, resume=file)
    for name in ("time_s", "base", "x", "v", "force", "rms", "peak"):
        assert np.array_equal(getattr(whole, name), getattr(resumed, name)), name
    with pytest.raises(InputError, match="another excitation"):
        shake(Automaton(), motion.scaled(1.1), **few, resume=file)
