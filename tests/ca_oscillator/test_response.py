"""A linear system answers with its transfer function, up and down; chance is no hysteresis."""

import math

import numpy as np
import pytest

from ca_damper import (
    Oscillator,
    RigidMass,
    Sweep,
    frequency_response,
    sweep_up_and_down,
)
from tests.made_response import response

RATIOS = np.linspace(0.9, 1.1, 5)


def wanted_rms(oscillator, particles, ratios):
    frequency = np.asarray(ratios) * oscillator.natural_frequency
    gain = [np.abs(oscillator.transfer(frequency, 0.2e-3 * number)) for number in particles]
    return oscillator.base_amplitude * np.array(gain) / math.sqrt(2.0)


def rigid_response(**changes):
    few = {"particles": [0, 10], "ratios": RATIOS, "seeds": 2}
    few.update(transient_cycles=0, measured_cycles=2, start="rigid")
    return frequency_response(RigidMass(), **{**few, **changes})


def test_response_of_the_user_s_oscillator_has_a_place_for_every_scene():
    oscillator = Oscillator(mass=0.2, stiffness=500.0, damping=0.5, base_amplitude=1e-3)
    made = rigid_response(oscillator=oscillator, dt=2e-4, seeds=[4, 9, 2])
    wanted = wanted_rms(oscillator, [0, 10], RATIOS)
    assert made.rms == pytest.approx(np.repeat(wanted[:, :, None], 3, axis=2), rel=1e-8)
    assert made.apparent_mass[1] == pytest.approx(np.full((5, 3), 2e-3), rel=1e-8)
    assert (1.9e-4 < made.dt).all() and (made.dt <= 2e-4).all()


def test_a_linear_system_answers_alike_on_the_way_up_and_down():
    job = {"particles": [0, 10], "ratios": RATIOS, "seeds": 1}
    sweep = sweep_up_and_down(RigidMass(), **job, transient_cycles=150, measured_cycles=10)
    # What is left of the frequency before: at most the two amplitudes, 17 and 1.8 mm RMS, times
    # exp(-2 pi zeta 150 / ratio), against 1.8 mm.
    zeta = Oscillator().damping_ratio
    left = np.exp(-2.0 * np.pi * zeta * 150.0 / 1.1) * (17.0 + 1.8) / 1.8
    assert np.abs(sweep.hysteresis).max() < 2.0 * left
    for way in (sweep.up, sweep.down):
        wanted = wanted_rms(Oscillator(), [0, 10], RATIOS)
        assert way.rms[:, :, 0] == pytest.approx(wanted, rel=2.0 * left)


def swept(up, down, error):
    """Sweep of one particle number from RMS (ratios, seeds) and their half-widths."""
    ratios, seeds = RATIOS[: len(up)], tuple(range(1, 1 + up.shape[1]))
    ways = [response((10,), ratios, seeds, rms=rms[None]) for rms in (up, down)]
    return Sweep(*ways, up_error=error[None], down_error=error[None])


def test_a_difference_beyond_chance_is_hysteresis_unless_a_mean_still_changes():
    rng = np.random.default_rng(5)
    up, down = 1.0 + 0.01 * rng.normal(size=(2, 4, 5))
    down[2] += 0.5
    error = np.full(up.shape, 0.02)
    assert swept(up, down, error).shows_hysteresis.tolist() == [[False, False, True, False]]
    error[2, 3] = np.inf
    assert not swept(up, down, error).shows_hysteresis.any()
