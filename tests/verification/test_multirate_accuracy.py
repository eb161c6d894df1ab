"""Different steps for different bodies must not change the answer beyond the error of the step."""

import numpy as np
import pytest

from taichi_dem import Multirate, Simulation, Uniform
from tests.scenes import brisk_scene

UNTIL = 2.5e-5


def position_after(method):
    """Positions of all bodies [m] and the simulation."""
    simulation = Simulation(brisk_scene(), method)
    simulation.advance_to(round(UNTIL / method.dt0))
    return simulation.state.motion()["position"], simulation


@pytest.fixture(scope="module")
def uniform():
    """Uniform runs at l and l / 2: first order, so the error at l is twice their difference."""
    coarse, simulation = position_after(Uniform(1e-8, 2e-7))
    fine, _ = position_after(Uniform(5e-9, 1e-7))
    error = 2.0 * np.linalg.norm(coarse - fine)
    return coarse, error, simulation


@pytest.mark.parametrize("neighbour", ["held", pytest.param("drifted", marks=pytest.mark.slow)])
def test_multirate_stays_within_the_error_of_its_steps(uniform, neighbour):
    """A body's step is at most 2^levels that of the uniform run, its error in proportion.

    Both runs obey the same rule, |v| dt <= l; where the steps of the uniform run are s times
    shorter its error is s times smaller. The bound takes the mean ratio of the steps, which is
    the gain in body updates, plus one for the uniform run's own error. What is left of that is
    the velocity that dashpots take, half a step old. Between steps of different length it is a
    whole one: held, of a partner's last time; drifted, of the kick for a long step given at once.
    """
    reference, error, other = uniform
    position, simulation = position_after(Multirate(1e-8, 2e-7, neighbour))
    report = simulation.report()
    assert len(np.unique(simulation.state.level.to_numpy())) >= 3
    assert report.ideal_gain > 1.5
    moved = np.linalg.norm(reference - simulation.model.centre)
    assert error < 0.01 * moved
    assert np.linalg.norm(position - reference) < (1.0 + 2.0 * report.ideal_gain) * error
    assert report.contact_evaluations < other.report().contact_evaluations
