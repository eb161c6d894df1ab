"""Where the momentum of the particles goes: into the container, or into the ledger."""

import numpy as np
import pytest

from ca_damper.automaton import ACCOUNTINGS, Automaton
from ca_damper.automaton.ledger import ITEMS, QUANTUM
from tests.ca_automaton.shaken import Shaken

MASS, GRAVITY, DT, AMPLITUDE, FREQUENCY = 0.2e-3, 10.0, 1e-4, 18e-3, 6.0
OMEGA = 2 * np.pi * FREQUENCY
PARTICLES = np.array([1, 10, 50, 100, 160])
EPS = np.finfo(float).eps


def rise(step):
    """V(t + dt) - V(t) of the container [m/s]."""
    speed = OMEGA * AMPLITUDE * np.cos(OMEGA * DT * np.array([step, step + 1]))
    return speed[1] - speed[0]


def shaken(steps, **options):
    """Boxes of all numbers of particles, with a ledger."""
    automaton = Automaton(ledger=True, **options)
    box = Shaken(automaton, PARTICLES, 3, DT, AMPLITUDE, FREQUENCY, traced=steps)
    return box.run(steps)


def forces(trace):
    """Momentum given to the container at each step [N s]: blows, and what the carried mass takes.

    The carried mass takes K' = -(carried) (V' + g) dt; shape (steps, scenes).
    """
    rises = np.array([rise(step) for step in range(len(trace))])[:, None]
    return trace[:, :, 0] - trace[:, :, 1] * (rises + GRAVITY * DT)


@pytest.mark.parametrize(
    "options",
    [{"accounting": name} for name in ACCOUNTINGS]
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
    ledger = box.bound.ledger.gained.to_numpy().sum(axis=1) * QUANTUM
    weight = PARTICLES * MASS * GRAVITY * DT * steps
    balance = -weight - forces(trace).sum(axis=0) + MASS * ledger
    tolerance = PARTICLES * MASS * steps * (1.5 * QUANTUM + 4 * EPS)
    assert np.all(abs(momentum - balance) < tolerance)


def test_one_particle_straight_up_and_down_needs_no_ledger():
    """Without oblique flights and pairs, blows alone balance weight."""
    box = shaken(3000, accounting="static")
    assert not box.bound.ledger.gained.to_numpy()[0].any()


def test_both_of_a_pair_changed_keep_momentum_in_their_line():
    """A column meets head-on only: what pairs take is what deflection takes.

    With restitution 0 no particle is sent back, so nothing is deflected and nothing taken, beyond
    the rounding of two speeds below 4 m/s and of the entry, for each of the ten at each step.
    """
    automaton = Automaton(ledger=True, restitution=0.0, start=tuple((4, 6 + k) for k in range(10)))
    box = Shaken(automaton, 10, amplitude=AMPLITUDE).run(5000)
    taken = box.bound.ledger.gained.to_numpy()[0] * QUANTUM
    assert abs(taken[ITEMS.index("pairs")]) < 10 * 5000 * (QUANTUM + 4 * EPS)


def test_only_static_contact_has_all_blows_count():
    """Landing leaves pushes and the heap's rest to the ledger; static contact has none of both."""
    left = {
        name: shaken(3000, accounting=name).bound.ledger.gained.to_numpy()[2] != 0
        for name in ACCOUNTINGS
    }
    pushes, rest = ITEMS.index("ejections"), ITEMS.index("rest")
    assert left["landing"][[pushes, rest]].tolist() == [True, True]
    assert left["landing+ejection"][[pushes, rest]].tolist() == [False, True]
    assert left["static"][[pushes, rest]].tolist() == [False, False]


@pytest.mark.parametrize("amplitude", [5e-3, 15e-3, 24e-3])
def test_mean_force_is_the_weight(amplitude):
    """-N m g to 4 % over 24 cycles with static contact, heap at rest or thrown.

    What oblique flights and deflection take is not the container's: hence not to round-off.
    """
    steps = round(24 / FREQUENCY / DT)
    box = Shaken(Automaton(), [10, 30, 50, 100], 2, DT, amplitude, FREQUENCY, traced=steps)
    trace = box.run(steps).traces()
    late = slice(round(4 / FREQUENCY / DT), None)
    wave = OMEGA * amplitude * np.cos(OMEGA * DT * np.arange(steps + 1))
    force = trace[:, :, 0] - trace[:, :, 1] * (np.diff(wave)[:, None] + GRAVITY * DT)
    weight = np.array([10, 30, 50, 100]) * MASS * GRAVITY
    assert force[late].mean(axis=0) / DT == pytest.approx(-weight, rel=0.04)
