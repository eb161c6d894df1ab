"""The impact damper in closed form: balances that its motion obeys, and refusals."""

import numpy as np
import pytest

from ca_damper import ImpactDamper, Oscillator, rk45
from taichi_dem.kit.errors import InputError

STRUCTURE = Oscillator()
CASES = [(0.1, 0.75, 12e-3, 6.0288), (0.02, 0.3, 30e-3, 5.9), (0.08, 0.5, 8e-3, 6.1)]


def damper(ratio=0.1, restitution=0.75, clearance=12e-3, frequency=6.0288):
    return ImpactDamper(STRUCTURE, ratio * STRUCTURE.mass, restitution, clearance, frequency)


@pytest.mark.parametrize("case", CASES)
def test_blows_have_their_restitution_and_keep_momentum(case):
    """Before and after the blow on the ceiling, of which the one on the floor is the mirror."""
    made = damper(*case)
    for u in made.speeds:
        before, after = -made.motion(u, made.half_cycle), made.motion(u, 0.0)
        assert before[0] == pytest.approx(after[0], abs=1e-15)
        assert after[1] + u == pytest.approx(made.restitution * (u - before[1]), rel=1e-10)
        gained = STRUCTURE.mass * (after[1] - before[1])
        assert gained == pytest.approx(2.0 * made.particle_mass * u, rel=1e-10)


@pytest.mark.parametrize("case", CASES)
def test_the_motion_obeys_the_equation_of_the_container(case):
    """From the start, a step of RK45 at a time up to the next blow: the same motion to 1e-9."""
    made = damper(*case)
    u = max(made.speeds)
    (x, v), (grain, speed) = made.start(u)
    # The middle of a flight or a flight turned over: a moment t of the half cycle from the ceiling.
    sign = -np.sign(speed)
    t = (0.5 * u * made.half_cycle - sign * grain) / u
    rest = made.half_cycle - t
    path = rk45.solve(
        STRUCTURE.right_hand_side(made.frequency), (0.0, rest), [x, v], rtol=1e-11, atol=1e-13
    )
    assert path.y[-1] == pytest.approx(sign * made.motion(u, made.half_cycle), rel=1e-8)


@pytest.mark.parametrize(
    "name, value", [("particle_mass", 0.0), ("clearance", -1.0), ("frequency", np.nan)]
)
def test_numbers_out_of_range_are_refused(name, value):
    numbers = {"particle_mass": 0.01, "restitution": 0.5, "clearance": 0.01, "frequency": 6.0}
    with pytest.raises(InputError, match=name):
        ImpactDamper(STRUCTURE, **{**numbers, name: value})
