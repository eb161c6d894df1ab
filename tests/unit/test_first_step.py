"""The step rule holds from the first step on, also for bodies that move at the start."""

import numpy as np
import pytest

from taichi_dem import CONCRETE, Multirate, Scene, Simulation, Uniform
from taichi_dem.mesh.shapes import pair

DT0, DISTANCE = 1e-6, 1e-8


@pytest.mark.parametrize("method", [Uniform(DT0, DISTANCE), Multirate(DT0, DISTANCE)])
def test_no_body_moves_further_than_the_distance_in_its_first_step(method):
    """dt_i <= l / |v_i| (Konno et al., 3.1): 1 m/s and 10 nm give 10 ns, below dt0 / 2^6.

    A uniform run takes the step of the faster body for both.
    """
    simulation = Simulation(Scene(pair(), CONCRETE), method)
    velocity = np.array([[1.0, 0.0, 0.0], [0.3, 0.0, 0.0]])
    turn = np.tile([1.0, 0.0, 0.0, 0.0], (2, 1))
    simulation.state.set_motion(simulation.model.centre, turn, velocity)
    simulation.start()
    step = DT0 / 2.0 ** simulation.state.level.to_numpy()
    assert np.all(step * velocity[:, 0] <= DISTANCE)
    assert np.all(2.0 * step.min() * velocity[0, 0] > DISTANCE)
