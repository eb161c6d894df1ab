"""The container moves as its transfer function and the exact solution under blows and mass say."""

import numpy as np
import pytest
from scipy.linalg import expm

from ca_damper import Automaton, Batch, Oscillator, RigidMass, SceneTable, Spheres
from tests.ca_oscillator.kicks import Kicks
from tests.rounding import momentum_rounding

PAPER = Oscillator()
F0 = PAPER.natural_frequency
RATIOS = np.array([0.5, 0.8, 0.95, 0.99, 1.0, 1.01, 1.05, 1.2, 1.5])


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


def shaken(filling):
    """A batch after a few cycles of hard shaking of 1 and of 10 or 40 particles."""
    table = SceneTable((1, min(40, filling.capacity)), 1, filling.default_dt, 6.0, 2e-3)
    batch = Batch(filling, table)
    batch.start()
    batch.run(3, 0)
    return batch


@pytest.mark.parametrize("filling", [RigidMass(), Automaton(), Spheres()], ids=lambda f: f.label)
def test_what_filling_and_container_exchange_is_accounted_for(filling):
    """Momentum of the particles = -N m g t - what they gave to the container."""
    batch = shaken(filling)
    assert batch.report().momentum_error < momentum_rounding(batch) < 1e-8


def test_blows_that_no_momentum_stands_for_are_found_out():
    """What is missing is of the order of what is counted: no rounding."""
    report = shaken(Kicks(strength=2e-5, mass=0.005)).report()
    assert report.momentum_error > 0.1
    assert f"{report.momentum_error:.2g} of what was exchanged" in report.details()
