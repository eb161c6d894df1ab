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


def rise(step):
    """V(t + dt) - V(t) of the container [m/s]."""
    speed = OMEGA * AMPLITUDE * np.cos(OMEGA * DT * np.array([step, step + 1]))
    return speed[1] - speed[0]


def shaken(steps, **options):
    """Boxes of all numbers of particles, with a ledger where momentum goes astray."""
    automaton = paper(ledger=options.get("accounting", "all") != "all", **options)
    box = Shaken(automaton, PARTICLES, 3, DT, AMPLITUDE, FREQUENCY, traced=steps)
    return box.run(steps)


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
    [{"accounting": name, "static_contact": rest} for name in ACCOUNTINGS for rest in (False, True)]
    + [{"pair_rule": "one_sided"}, {"accumulator": "kept", "accounting": "landing+ejection"}],
)
def test_momentum_is_accounted_for(options):
    """p = -N m g t - (given to the container) + m (ledger), after 3000 steps of hard shaking.

    Blows and ledger entries are rounded to half a quantum, at most three for a particle and step;
    gravity's additions to a speed below 4 m/s round by 4 EPS each.
    """
    steps = 3000
    box = shaken(steps, **options)
    trace = box.traces()
    momentum = trace[-1, :, 2] + trace[-1, :, 1] * rise(steps - 1)
    weight = PARTICLES * MASS * GRAVITY * DT * steps
    balance = -weight - forces(trace).sum(axis=0) + MASS * ledger(box).sum(axis=1)
    tolerance = PARTICLES * MASS * steps * (1.5 * QUANTUM + 4 * EPS)
    assert np.all(abs(momentum - balance) < tolerance)


def test_what_is_left_to_the_ledger():
    """Landing leaves pushes and the heap's rest to it; one particle alone meets none but walls."""
    left = {
        name: ledger(shaken(3000, accounting=name)) != 0 for name in ("landing", "landing+ejection")
    }
    pushes, rest = ITEMS.index("ejections"), ITEMS.index("rest")
    assert left["landing"][2, [pushes, rest]].tolist() == [True, True]
    assert left["landing+ejection"][2, [pushes, rest]].tolist() == [False, True]
    assert not left["landing"][0, [ITEMS.index("gravity"), ITEMS.index("pairs")]].any()


@pytest.mark.parametrize("amplitude", [5e-3, 15e-3, 24e-3])
def test_mean_force_is_the_weight(amplitude):
    """-N m g over 20 cycles with static contact, heap at rest or thrown.

    What is left is the change of the particles' momentum: below 2 m/s times N m in 3.3 s.
    """
    steps, late = round(24 / FREQUENCY / DT), round(4 / FREQUENCY / DT)
    particles = np.array([10, 30, 50, 100])
    box = Shaken(paper(), particles, 2, DT, amplitude, FREQUENCY, traced=steps)
    trace = box.run(steps).traces()
    speed = OMEGA * amplitude * np.cos(OMEGA * DT * np.arange(steps + 1))
    force = trace[:, :, 0] - trace[:, :, 1] * (np.diff(speed)[:, None] + GRAVITY * DT)
    weight = particles * MASS * GRAVITY
    change = 2.0 / ((steps - late) * DT * GRAVITY)
    assert change < 0.07
    assert force[late:].mean(axis=0) / DT == pytest.approx(-weight, rel=change)
    drift = trace[-1, :, 2] - trace[late - 1, :, 2]
    # With that change taken into account the mean is the weight to a step's worth of momentum.
    corrected = force[late:].sum(axis=0) + drift
    assert corrected == pytest.approx(-weight * DT * (steps - late), rel=1e-3)
