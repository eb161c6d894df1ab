"""The record of bodies' motion has the energy and momentum of a free flight in closed form."""

import numpy as np
import pytest

from taichi_dem import CONCRETE, Scene, Simulation, Uniform
from taichi_dem.mesh.shapes import placed_together, single
from taichi_dem.simulate import run_simulation
from tests.motion_record import MotionRecord


def test_two_free_bodies_are_recorded_as_they_move_and_turn():
    velocity = np.array([[3.0, 0.0, 0.0], [0.0, -1.0, 2.0]])
    mesh = placed_together({"a": (single(), np.zeros(3)), "b": (single(), np.ones(3))})
    spin = np.array([[0.0, 0.0, 50.0], [0.0, 0.0, 0.0]])
    simulation = Simulation(Scene(mesh, CONCRETE, velocity=velocity, spin=spin), Uniform(1e-6))
    both, second = made = MotionRecord(), MotionRecord(slice(1, 2))
    run_simulation(simulation, until=1e-4, samples=5, progress=None, observers=made)
    # A hundred steps round a place near 1 m.
    assert both.moved == pytest.approx(np.multiply.outer(both.time_s, velocity), abs=2e-14)
    assert second.kinetic_energy == pytest.approx(0.5 * second.mass[0] * 5.0, rel=1e-12)
    # A regular tetrahedron turns about any axis as a ball does.
    spun = 0.5 * both.inertia[0, 0, 0] * 50.0**2
    assert both.rotational_energy == pytest.approx(spun, rel=1e-9)
    assert both.momentum == pytest.approx(np.tile(both.mass @ velocity, (6, 1)), rel=1e-12)
    orbit = np.cross([1.0, 1.0, 1.0], both.mass[1] * velocity[1])
    whole = orbit + np.array([0.0, 0.0, 50.0 * both.inertia[0, 0, 0]])
    assert both.angular_momentum == pytest.approx(np.tile(whole, (6, 1)), rel=1e-9)
