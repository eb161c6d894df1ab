"""Motion of all bodies that is set: arrays of a row each, or one row for all."""

import numpy as np
import pytest

from taichi_dem import CONCRETE, Scene, Simulation, Uniform
from taichi_dem.mesh.shapes import bar

VELOCITY, SPIN, TURN = [1.0, 2.0, 3.0], [4.0, 0.0, -5.0], [0.6, 0.8, 0.0, 0.0]


@pytest.fixture(scope="module")
def simulation(taichi_session):
    return Simulation(Scene(bar(0.2, 0.1, (2, 1, 1)), CONCRETE, []), Uniform(1e-8))


def test_one_row_is_that_of_all_bodies(simulation):
    count, place, state = simulation.model.body_count, simulation.model.centre, simulation.state
    rows = [np.tile(row, (count, 1)) for row in (TURN, VELOCITY, SPIN)]
    state.set_motion(place, *rows)
    expected = state.motion()
    state.set_motion(place)
    assert not state.motion()["velocity"].any()
    state.set_motion(place, TURN, VELOCITY, SPIN)
    for name, values in state.motion().items():
        assert values.tobytes() == expected[name].tobytes(), name
    assert expected["velocity"][1].tolist() == VELOCITY


def test_what_is_not_given_is_at_rest_and_not_turned(simulation):
    state, place = simulation.state, simulation.model.centre
    state.set_motion(place, TURN, VELOCITY, SPIN)
    state.set_motion(place + 0.1, velocity=VELOCITY)
    motion = state.motion()
    assert motion["position"].tobytes() == (place + 0.1).tobytes()
    assert (motion["orientation"] == [1.0, 0.0, 0.0, 0.0]).all()
    assert not motion["spin"].any() and (motion["velocity"] == VELOCITY).all()
