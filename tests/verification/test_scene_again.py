"""A scene says what to simulate and is not used up by it."""

import numpy as np
import pytest

from taichi_dem import Simulation, Uniform
from tests.scenes import paper_scene


@pytest.mark.slow
def test_a_scene_that_serves_twice_gives_the_same_bits():
    """Loads, supports and laws belong to the run: the second one is pushed as the first was."""
    scene, positions = paper_scene(), []
    for _ in range(2):
        simulation = Simulation(scene, Uniform(2e-8))
        simulation.advance_to(200)
        positions.append(simulation.state.position.to_numpy())
        assert simulation.gas_work() > 0.0
    assert np.array_equal(*positions)
