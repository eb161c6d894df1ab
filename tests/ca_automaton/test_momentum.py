"""Where the momentum of the particles goes: into the container, or nowhere where it is left out."""

import numpy as np
import pytest

from ca_damper.automaton import ACCOUNTINGS
from ca_damper.automaton.accounting import QUANTUM
from tests.ca_automaton.shaken import Shaken
from tests.paper import paper

MASS, GRAVITY, DT, AMPLITUDE, FREQUENCY = 0.2e-3, 10.0, 1e-4, 18e-3, 6.0
OMEGA = 2 * np.pi * FREQUENCY
PARTICLES = np.array([1, 10, 50, 100, 160])
EPS = np.finfo(float).eps
STEPS = 3000


def rise(step):
    """V(t + dt) - V(t) of the container [m/s]."""
    speed = OMEGA * AMPLITUDE * np.cos(OMEGA * DT * np.array([step, step + 1]))
    return speed[1] - speed[0]


def missing(**options):
    """Momentum that no force explains after 3000 steps of hard shaking [kg m/s], (scenes,).

    p = -N m g t - (given to the container): blows, and what the carried mass takes,
    K' = -(carried) (V' + g) dt.
    """
    box = Shaken(paper(**options), PARTICLES, 3, DT, AMPLITUDE, FREQUENCY, traced=STEPS)
    trace = box.run(STEPS).traces()
    rises = np.array([rise(step) for step in range(len(trace))])[:, None]
    given = (trace[:, :, 0] - trace[:, :, 1] * (rises + GRAVITY * DT)).sum(axis=0)
    momentum = trace[-1, :, 2] + trace[-1, :, 1] * rise(STEPS - 1)
    return momentum + PARTICLES * MASS * GRAVITY * DT * STEPS + given


@pytest.mark.parametrize("options", [{}, {"pair_rule": "one_sided", "accumulator": "kept"}])
def test_all_momentum_goes_into_the_container(options):
    """Blows are rounded to half a quantum, at most three for a particle and step; gravity's
    additions to a speed below 4 m/s round by 4 EPS each.
    """
    tolerance = PARTICLES * MASS * STEPS * (1.5 * QUANTUM + 4 * EPS)
    assert np.all(abs(missing(**options)) < tolerance)


def test_landings_leave_out_what_others_count():
    """Pushes and the heap's rest; fewer where pushes count. A single particle meets only walls."""
    left = {name: abs(missing(accounting=name)) for name in ACCOUNTINGS if name != "all"}
    tolerance = PARTICLES * MASS * STEPS * (1.5 * QUANTUM + 4 * EPS)
    assert np.all(left["landing"][1:] > 1e6 * tolerance[1:])
    assert np.all(left["landing+ejection"][1:] != left["landing"][1:])
