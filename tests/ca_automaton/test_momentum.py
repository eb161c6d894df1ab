"""Where the momentum of the particles goes: into the container, or into the ledger."""

import numpy as np
import pytest

from ca_damper.automaton import ACCOUNTINGS
from ca_damper.automaton.impulse_balance import ITEMS, QUANTUM
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


def shaken(**options):
    """Boxes of all numbers of particles, with a ledger where momentum goes astray."""
    automaton = paper(ledger=options.get("accounting", "all") != "all", **options)
    return Shaken(automaton, PARTICLES, 3, DT, AMPLITUDE, FREQUENCY, traced=STEPS).run(STEPS)


def ledger(box):
    """Velocity along x gained uncounted [m/s], shape (scenes, items)."""
    gain = getattr(box.device.impulse_balance, "velocity_gain", None)
    return np.zeros((len(PARTICLES), 1)) if gain is None else box.in_use(gain) * QUANTUM


def forces(trace):
    """Momentum given to the container at each step [N s]: blows, and what the carried mass takes.

    The carried mass takes K' = -(carried) (V' + g) dt; shape (steps, scenes).
    """
    rises = np.array([rise(step) for step in range(len(trace))])[:, None]
    return trace[:, :, 0] - trace[:, :, 1] * (rises + GRAVITY * DT)


@pytest.mark.parametrize(
    "options",
    [{"accounting": name} for name in ACCOUNTINGS]
    + [{"pair_rule": "one_sided", "accumulator": "kept"}],
)
def test_momentum_is_accounted_for(options):
    """p = -N m g t - (given to the container) + m (ledger), after 3000 steps of hard shaking.

    Blows and ledger entries are rounded to half a quantum, at most three for a particle and step;
    gravity's additions to a speed below 4 m/s round by 4 EPS each.
    """
    box = shaken(**options)
    trace = box.traces()
    momentum = trace[-1, :, 2] + trace[-1, :, 1] * rise(STEPS - 1)
    weight = PARTICLES * MASS * GRAVITY * DT * STEPS
    balance = -weight - forces(trace).sum(axis=0) + MASS * ledger(box).sum(axis=1)
    tolerance = PARTICLES * MASS * STEPS * (1.5 * QUANTUM + 4 * EPS)
    assert np.all(abs(momentum - balance) < tolerance)


def test_what_is_left_to_the_ledger():
    """Landing leaves pushes and the heap's rest to it; one particle alone meets none but walls."""
    left = {name: ledger(shaken(accounting=name)) != 0 for name in ("landing", "landing+ejection")}
    pushes, rest = ITEMS.index("ejections"), ITEMS.index("rest")
    assert left["landing"][2, [pushes, rest]].tolist() == [True, True]
    assert left["landing+ejection"][2, [pushes, rest]].tolist() == [False, True]
    assert not left["landing"][0, [ITEMS.index("gravity"), ITEMS.index("pairs")]].any()
