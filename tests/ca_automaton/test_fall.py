"""One particle, or a column, falls in a container at rest (Fig. 8)."""

import numpy as np
import pytest

from tests.ca_automaton.shaken import Shaken
from tests.paper import paper

GRAVITY, RESTITUTION, WIDTH = 10.0, 0.75, 6e-3
TOP = 15
HEIGHT = TOP * WIDTH


def impacts(count):
    """Times of impact [s]: t_1 = sqrt(2 h / g), then flights of 2 e^k t_1 each."""
    first = np.sqrt(2 * HEIGHT / GRAVITY)
    return first + np.concatenate([[0], np.cumsum(2 * first * RESTITUTION ** np.arange(1, count))])


def found_impacts(dt, column=4):
    """Times at which the container takes a blow of one particle let go in the top row [s]."""
    steps = round(0.9 / dt)
    automaton = paper(accounting="landing+ejection", start=((column, TOP),))
    trace = Shaken(automaton, 1, dt=dt, traced=steps).run(steps).traces()[:, 0]
    return np.flatnonzero(trace[:, 0] != 0.0)[:5] * dt


@pytest.mark.parametrize("column", [4, 5])
def test_impacts_follow_theory_to_the_fourth_rebound_within_2_ms(column):
    """With the paper's step, over even and odd columns alike."""
    assert found_impacts(1e-4, column) == pytest.approx(impacts(5), abs=2e-3)


@pytest.mark.parametrize("dt", [1e-3, 3e-4])
def test_impacts_err_by_a_few_steps_a_rebound(dt):
    """A contact is seen up to dt late. Each rebound cuts off a way up to v dt, which the particle
    makes up at e v, and starts from a speed known to g dt, which shifts the fall by 2 dt.
    """
    errors = abs(found_impacts(dt) - impacts(5))
    assert np.all(errors <= dt * (1 + (1 + 1 / RESTITUTION + 2) * np.arange(5)))
