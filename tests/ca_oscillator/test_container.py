"""The container moves as its transfer function and the exact solution under blows and mass say."""

import math

import numpy as np
import pytest
from scipy.linalg import expm

from ca_damper import (
    Batch,
    Oscillator,
    RigidMass,
    SceneTable,
    Sweep,
    frequency_response,
    sweep_up_and_down,
)
from tests.ca_oscillator.kicks import Kicks
from tests.damper import response

PAPER = Oscillator()
F0 = PAPER.natural_frequency
RATIOS = np.array([0.5, 0.8, 0.95, 0.99, 1.0, 1.01, 1.05, 1.2, 1.5])
#: Of whole curves.
FEW = np.linspace(0.9, 1.1, 5)


def batch_of(filling, particles, ratios, dt=1e-4, **options):
    frequency = np.asarray(ratios) * F0
    table = SceneTable(particles, 1, dt, frequency, PAPER.base_amplitude)
    return Batch(filling, table, **options)


def steady(ratios, added=0.0):
    """Complex amplitude of x; the base is a sine, Y = -i y0."""
    return -1j * PAPER.base_amplitude * PAPER.transfer(np.asarray(ratios) * F0, added)


def test_container_without_particles_keeps_its_steady_state():
    # 20 cycles of up to 3300 steps, each allowed an error of 1e-9; what is seen is far smaller,
    # as the estimated error is that of the fourth-order result.
    batch = batch_of(RigidMass(), 0, RATIOS, measured_cycles=20)
    batch.start("empty")
    cycles = batch.run(0, 20)
    assert cycles.harmonic("x") == pytest.approx(steady(RATIOS), rel=1e-10)
    assert cycles.rms == pytest.approx(np.abs(steady(RATIOS)) / np.sqrt(2.0), rel=1e-10)
    assert np.abs(cycles.mean).max() < 1e-10 * PAPER.base_amplitude


def test_rigid_mass_only_adds_its_mass():
    # Exact apart from integration: N m more mass, hanging N m g / K lower, taking no power.
    number = np.array([1, 10, 50])
    added = 0.2e-3 * number
    batch = batch_of(RigidMass(), number, 0.97, dt=2e-3, measured_cycles=5)
    batch.start("rigid")
    cycles = batch.run(0, 5)
    assert cycles.harmonic("x") == pytest.approx(steady(0.97, added), rel=1e-8)
    assert cycles.mean == pytest.approx(-added * 9.8 / PAPER.stiffness, rel=1e-8)
    assert cycles.mean_force == pytest.approx(-added * 9.8, rel=1e-8)
    assert cycles.apparent_mass == pytest.approx(added, rel=1e-8)
    assert np.abs(cycles.loss_factor(PAPER.mass)).max() < 1e-8


def exact_course(trace, dt, frequency):
    """x, v before each step and a without blows, by the exponential of the whole linear system.

    State (x, v, sin, cos, 1); the action of a step is constant over it.
    """
    o, omega = PAPER, 2.0 * np.pi * frequency
    state, carried_before, course = np.array([0.0, 0.0, 0.0, 1.0, 1.0]), 0.0, []
    for _, _, _, impulse, carried in trace:
        course.append([*state[:2], system(o, omega, carried_before, 0.0)[1] @ state])
        state = expm(dt * system(o, omega, carried, impulse / dt)) @ state
        carried_before = carried
    return np.array(course)


def system(o, omega, carried, blow):
    mass = o.mass + carried
    base = o.base_amplitude * np.array([o.stiffness, o.damping * omega])
    force = blow - 9.8 * carried
    matrix = np.zeros((5, 5))
    matrix[0, 1], matrix[2, 3], matrix[3, 2] = 1.0, omega, -omega
    matrix[1] = np.array([-o.stiffness, -o.damping, *base, force]) / mass
    return matrix


def test_blows_and_carried_mass_act_over_their_step():
    batch = batch_of(Kicks(2e-5, 0.01), 0, 1.0)
    batch.start("rest")
    batch.advance(450)
    trace = batch.device.trace_of(0)
    dt, frequency = batch.table.column("dt")[0], batch.table.column("frequency")[0]
    course = exact_course(trace, dt, frequency)
    scale = np.abs(course).max(axis=0)
    # 450 steps, each with an error of at most 1e-9 of its numbers.
    assert (np.abs(trace[:, :3] - course) < 450 * 1e-9 * scale).all()


def test_long_steps_are_divided_and_the_error_follows_the_tolerance():
    # dt = 1 / (41 f) is far too long for one attempt here. The step goes like the tolerance^(1/5),
    # the error like its fifth power: halving the tolerance halves the error.
    tolerances = 1e-8 * 0.5 ** np.arange(0, 10, 3)
    errors, attempts = [], []
    for rtol in tolerances:
        batch = batch_of(RigidMass(), 0, 1.0, dt=4e-3, measured_cycles=5, rtol=rtol, atol=1e-13)
        batch.start("empty")
        cycles = batch.run(0, 5)
        errors.append(np.abs(cycles.harmonic("x") / steady(1.0) - 1.0)[0])
        attempts.append(batch.attempts()[0] / (5 * batch.steps_per_cycle[0]))
        del batch
    slope = np.polyfit(np.log(tolerances), np.log(errors), 1)[0]
    assert slope == pytest.approx(1.0, abs=0.1)
    assert attempts[0] > 3.0
    assert (np.diff(attempts) > 0.0).all()


def test_container_on_the_base_follows_it():
    batch = batch_of(RigidMass(), 0, RATIOS, mount="base", measured_cycles=2)
    batch.start()
    batch.advance(300)
    now = batch.sample()
    omega = 2.0 * np.pi * batch.table.column("frequency")
    phase, y0 = omega * now["time_s"], PAPER.base_amplitude
    # The phase is turned on 300 times, each with a rounding error of 1e-16.
    assert now["x"] == pytest.approx(y0 * np.sin(phase), abs=1e-13 * y0)
    assert now["v"] == pytest.approx(omega * y0 * np.cos(phase), abs=1e-11 * y0)
    assert now["a"] == pytest.approx(-(omega**2) * y0 * np.sin(phase), abs=1e-9 * y0)
    assert np.array_equal(now["x"], now["y"])


def test_blows_that_no_momentum_stands_for_are_found_out():
    """What is missing is of the order of what is counted: no rounding."""
    batch = batch_of(Kicks(strength=2e-5, mass=0.005), 10, 1.0)
    batch.start()
    batch.run(3, 0)
    report = batch.report()
    assert report.momentum_error > 0.1
    assert f"{report.momentum_error:.2g} of what was exchanged" in report.details()


def wanted_rms(oscillator, particles, ratios):
    frequency = np.asarray(ratios) * oscillator.natural_frequency
    gain = [np.abs(oscillator.transfer(frequency, 0.2e-3 * number)) for number in particles]
    return oscillator.base_amplitude * np.array(gain) / math.sqrt(2.0)


def rigid_response(**changes):
    few = {"particles": [0, 10], "ratios": FEW, "seeds": 2}
    few.update(transient_cycles=0, measured_cycles=2, start="rigid")
    return frequency_response(RigidMass(), **{**few, **changes})


def test_response_of_the_user_s_oscillator_has_a_place_for_every_scene():
    oscillator = Oscillator(mass=0.2, stiffness=500.0, damping=0.5, base_amplitude=1e-3)
    made = rigid_response(oscillator=oscillator, dt=2e-4, seeds=[4, 9, 2])
    wanted = wanted_rms(oscillator, [0, 10], FEW)
    assert made.rms == pytest.approx(np.repeat(wanted[:, :, None], 3, axis=2), rel=1e-8)
    assert made.apparent_mass[1] == pytest.approx(np.full((5, 3), 2e-3), rel=1e-8)
    assert (1.9e-4 < made.dt).all() and (made.dt <= 2e-4).all()


def test_a_linear_system_answers_alike_on_the_way_up_and_down():
    job = {"particles": [0, 10], "ratios": FEW, "seeds": 1}
    sweep = sweep_up_and_down(RigidMass(), **job, transient_cycles=150, measured_cycles=10)
    # What is left of the frequency before: at most the two amplitudes, 17 and 1.8 mm RMS, times
    # exp(-2 pi zeta 150 / ratio), against 1.8 mm.
    zeta = Oscillator().damping_ratio
    left = np.exp(-2.0 * np.pi * zeta * 150.0 / 1.1) * (17.0 + 1.8) / 1.8
    assert np.abs(sweep.hysteresis).max() < 2.0 * left
    for way in (sweep.up, sweep.down):
        wanted = wanted_rms(Oscillator(), [0, 10], FEW)
        assert way.rms[:, :, 0] == pytest.approx(wanted, rel=2.0 * left)


def swept(up, down, error):
    """Sweep of one particle number from RMS (ratios, seeds) and their half-widths."""
    ratios, seeds = FEW[: len(up)], tuple(range(1, 1 + up.shape[1]))
    ways = [response((10,), ratios, seeds, rms=rms[None]) for rms in (up, down)]
    return Sweep(*ways, up_error=error[None], down_error=error[None])


def test_a_difference_beyond_chance_is_hysteresis_unless_a_mean_still_changes():
    rng = np.random.default_rng(5)
    up, down = 1.0 + 0.01 * rng.normal(size=(2, 4, 5))
    down[2] += 0.5
    error = np.full(up.shape, 0.02)
    assert swept(up, down, error).shows_hysteresis.tolist() == [[False, False, True, False]]
    error[2, 3] = np.inf
    assert not swept(up, down, error).shows_hysteresis.any()
