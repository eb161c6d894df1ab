"""A hysteresis is told where it is beyond the bars of both ways and the spread of the seeds."""

import math

import numpy as np
import pytest

from ca_damper import RigidMass, Sweep, sweep_up_and_down
from tests.made_response import response
from tests.paper import outside, paper

RATIOS = np.array([0.9, 0.95, 1.0, 1.05])


def made(up, down, error):
    """Sweep of one particle number from RMS (ratios, seeds) and their half-widths."""
    seeds = tuple(range(1, 1 + up.shape[1]))
    ways = [response((10,), RATIOS, seeds, rms=rms[None]) for rms in (up, down)]
    return Sweep(*ways, up_error=error[None], down_error=error[None])


@pytest.mark.parametrize("seeds", [1, 5])
def test_chance_is_seldom_called_hysteresis(seeds):
    """400 sweeps of four frequencies: one of twenty at 95 % for all four, at 2.6 deviations."""
    rng, told = np.random.default_rng(4), 0
    for _ in range(400):
        up, down = 1.0 + 0.05 * rng.normal(size=(2, 4, seeds))
        error = np.full(up.shape, 0.05 * 2.5)
        told += bool(made(up, down, error).shows_hysteresis.any())
    assert told <= 400 * 0.05 + 2.6 * math.sqrt(400 * 0.05)


def test_a_difference_beyond_chance_is_hysteresis_unless_a_mean_still_changes():
    rng = np.random.default_rng(5)
    up, down = 1.0 + 0.01 * rng.normal(size=(2, 4, 5))
    down[2] += 0.5
    error = np.full(up.shape, 0.02)
    found = made(up, down, error)
    assert found.shows_hysteresis.tolist() == [[False, False, True, False]]
    assert "hysteresis beyond chance at 1 of 4 points" in repr(found)
    error[2, 3] = np.inf
    assert not made(up, down, error).shows_hysteresis.any()


def test_a_sweep_of_irregular_motion_has_a_bar_that_holds_none():
    """Ten grains near resonance: the ways differ by 0.1 and more, each seed otherwise."""
    asked = {"particles": 10, "ratios": [0.98, 0.99, 1.0], "seeds": 5, "progress": None}
    with outside():
        found = sweep_up_and_down(paper(), **asked)
    assert np.abs(found.hysteresis).max() > 0.1
    assert found.hysteresis_error.shape == (1, 3) and not found.shows_hysteresis.any()


def test_a_mean_that_still_grows_shows_no_hysteresis():
    asked = {"particles": 0, "ratios": [0.95, 1.0], "seeds": 1, "progress": None}
    grows = sweep_up_and_down(RigidMass(), transient_cycles=0, measured_cycles=20, **asked)
    assert np.abs(grows.hysteresis).max() > 0.1 and not grows.shows_hysteresis.any()


def test_rounding_is_no_hysteresis():
    """Of a linear system whose seeds agree, and whose mean rests to 1e-14."""
    up = np.full((4, 2), 1e-3)
    found = made(up, up * (1.0 + 1e-14), np.zeros(up.shape))
    assert np.abs(found.hysteresis).max() > 0.0 and not found.shows_hysteresis.any()
