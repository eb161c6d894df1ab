"""The record of bodies' motion against closed forms of a free flight."""

import numpy as np
import pytest

from taichi_dem import CONCRETE, Scene, Simulation, Uniform
from taichi_dem.mesh.shapes import placed_together, single
from taichi_dem.output.motion_record import MotionRecord
from taichi_dem.simulate import run_simulation

VELOCITY = np.array([[3.0, 0.0, 0.0], [0.0, -1.0, 2.0]])


@pytest.fixture(scope="module")
def records():
    """Records of both bodies, and of the second alone, of two that fly apart."""
    parts = {"a": (single(), np.zeros(3)), "b": (single(), np.ones(3))}
    simulation = Simulation(Scene(placed_together(parts), CONCRETE), Uniform(1e-6))
    turn = np.tile([1.0, 0.0, 0.0, 0.0], (2, 1))
    spin = np.array([[0.0, 0.0, 50.0], [0.0, 0.0, 0.0]])
    simulation.state.set_motion(simulation.model.centre, turn, VELOCITY, spin)
    made = MotionRecord(), MotionRecord(slice(1, 2))
    run_simulation(simulation, until=1e-4, samples=5, progress=None, observers=made)
    return made


def test_samples_are_those_of_the_chosen_bodies(records):
    both, second = records
    assert both.time_s == pytest.approx(np.linspace(0.0, 1e-4, 6), rel=1e-12)
    # A hundred steps round a place near 1 m.
    assert both.moved == pytest.approx(np.multiply.outer(both.time_s, VELOCITY), abs=2e-14)
    assert np.array_equal(second["velocity"], both["velocity"][:, 1:])
    assert both.broken == 0


def test_energy_and_momentum_are_those_of_free_bodies(records):
    both, second = records
    assert second.rotational_energy == pytest.approx(0.0, abs=0.0)
    assert second.kinetic_energy == pytest.approx(0.5 * second.mass[0] * 5.0, rel=1e-12)
    # A regular tetrahedron turns about any axis as a ball does.
    spun = 0.5 * both.inertia[0, 0, 0] * 50.0**2
    assert both.rotational_energy == pytest.approx(spun, rel=1e-9)
    assert both.momentum == pytest.approx(np.tile(both.mass @ VELOCITY, (6, 1)), rel=1e-12)
    orbit = np.cross([1.0, 1.0, 1.0], both.mass[1] * VELOCITY[1])
    whole = orbit + np.array([0.0, 0.0, 50.0 * both.inertia[0, 0, 0]])
    assert both.angular_momentum == pytest.approx(np.tile(whole, (6, 1)), rel=1e-9)


def test_momentum_error_is_a_share_of_what_the_bodies_had(records):
    both = MotionRecord()
    both.__dict__.update(vars(records[0]))
    assert both.momentum_error(0.05) < 1e-13
    changed = {**both._samples[-1], "velocity": np.array([[3.3, 0.0, 0.0], VELOCITY[1]])}
    both._samples = [*both._samples[:-1], changed]
    # 0.3 m/s of the largest speeds, 3.3 m/s and sqrt(5) m/s, of equal masses.
    assert both.momentum_error(0.05) == pytest.approx(0.3 / (3.3 + np.sqrt(5.0)), rel=1e-6)
