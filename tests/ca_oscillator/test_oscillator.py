"""The primary structure moves as its closed forms say."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from ca_damper import InputError, Oscillator
from ca_damper.scenes.clock import LEAST_STEPS_PER_CYCLE, small_sine_and_cosine

PAPER = Oscillator()


def test_figures_of_the_paper():
    # sqrt(123.4 / 0.086) / 2 pi; 0.08 / (2 sqrt(123.4 x 0.086)).
    assert PAPER.natural_frequency == pytest.approx(6.0288, abs=5e-5)
    assert PAPER.damping_ratio == pytest.approx(0.0123, abs=5e-5)
    ratios = np.linspace(0.99, 1.01, 4001)
    gain = np.abs(PAPER.transfer(ratios * PAPER.natural_frequency))
    assert gain.max() == pytest.approx(40.73, abs=1e-2)
    assert PAPER.rms(PAPER.peak()[0] * PAPER.natural_frequency) == pytest.approx(PAPER.peak()[1])


@pytest.mark.parametrize("frequency", [0.5, 6.0, 20.0])
def test_steady_state_repeats_after_a_cycle(frequency):
    # Periodicity under the equation of motion itself; the solver errs by its tolerance a step.
    o, added = PAPER, 0.01
    omega = 2.0 * math.pi * frequency

    def motion(t, y):
        base, speed = math.sin(omega * t), omega * math.cos(omega * t)
        push = o.base_amplitude * (o.stiffness * base + o.damping * speed) - 9.8 * added
        hold = o.stiffness * y[0] + o.damping * y[1]
        return np.array([y[1], (push - hold) / (o.mass + added)])

    start = np.array(o.steady_state(frequency, added, 9.8))
    bounds = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-14}
    end = solve_ivp(motion, (0.0, 1.0 / frequency), start, **bounds).y[:, -1]
    assert end == pytest.approx(start, rel=1e-9, abs=1e-12)


@pytest.mark.parametrize("form", [float, np.float64, lambda f: np.array([f, 3.0])])
def test_a_resonance_without_damping_has_no_steady_state(form):
    free = Oscillator(damping=0.0)
    with pytest.raises(InputError, match=r"no steady state at its natural frequency, got 6.02877"):
        free.transfer(form(free.natural_frequency))
    assert np.isinf(np.atleast_1d(free.rms(form(free.natural_frequency)))[0])
    assert np.isfinite(free.transfer(3.0))


def test_series_of_sine_and_cosine_reach_round_off():
    # Over a step's angle, at most 2 pi / 40: half a unit in the last place each operation.
    angle = np.linspace(-1.0, 1.0, 1001) * 2.0 * math.pi / LEAST_STEPS_PER_CYCLE
    sine, cosine = small_sine_and_cosine(angle)
    assert np.abs(sine - np.sin(angle)).max() < 1e-16
    assert np.abs(cosine - np.cos(angle)).max() < 4e-16
