"""Free decay and shock: the logarithmic decrement and the largest stretch have closed forms."""

import math

import numpy as np
import pytest

from ca_damper import (
    Oscillator,
    RigidMass,
    excitation,
    logarithmic_decrement,
    shake,
)

PAPER = Oscillator()
#: Half a sine of 10 g in 11 ms.
PEAK, LAST = 10.0 * 9.80665, 11e-3
#: A parabola through three samples a millisecond apart is off by (w h)^4 / 100 or so at 6 Hz.
APART = (2.0 * math.pi * 6.03 * 1e-3) ** 4


def exact(mass):
    """Decrement of the paper's structure with a mass [kg] in it."""
    ratio = PAPER.damping / (2.0 * math.sqrt(PAPER.stiffness * (PAPER.mass + mass)))
    return 2.0 * math.pi * ratio / math.sqrt(1.0 - ratio**2)


@pytest.mark.parametrize(("particles", "mass"), [(0, 0.0), (20, 4e-3)])
def test_decrement_of_a_linear_structure_is_its_closed_form(particles, mass):
    """At every amplitude, also about the place to which the weight of the mass pulls it."""
    still = excitation.sines(6.0, 0.0, 3.0)
    job = {"particles": particles, "seeds": 1, "progress": None}
    made = shake(RigidMass(), still, displacement=0.02, **job)
    amplitude, decrement = logarithmic_decrement(made.x[:, 0, 0])
    assert len(amplitude) > 25 and (np.diff(amplitude) < 0.0).all()
    # Of two amplitudes, each off by APART of itself and of the sag's share.
    assert decrement == pytest.approx(np.full(len(decrement), exact(mass)), abs=10.0 * APART)


def largest_stretch():
    """Of the paper's oscillator under the half-sine [m], by Duhamel's integral.

    Over 10,000 steps of the pulse by the trapezoidal rule, which is off by (pi / 10,000)^2 / 12.
    """
    decay = 0.5 * PAPER.damping / PAPER.mass
    turn = np.sqrt(PAPER.stiffness / PAPER.mass - decay**2)
    time, step = np.linspace(0.0, LAST, 10_001, retstep=True)
    pull = PEAK * np.sin(np.pi * time / LAST)
    later = np.linspace(LAST, 0.1, 10_001)
    away = np.exp(decay * time) * pull
    cosine, sine = step * (away @ np.cos(turn * time)), step * (away @ np.sin(turn * time))
    free = np.sin(turn * later) * cosine - np.cos(turn * later) * sine
    return float(np.abs(np.exp(-decay * later) * free / turn).max())


@pytest.mark.parametrize("length", [0.15, 1.0])
def test_a_half_sine_stretches_the_spring_as_duhamel_says(length):
    """17.7 mm whatever the length of the record; samples of 1 ms miss a peak by (w dt)^2 / 8."""
    time = np.arange(round(length / 1e-4) + 1) * 1e-4
    pull = np.where(time < LAST, PEAK * np.sin(np.pi * time / LAST), 0.0)
    shock = excitation.from_samples(time, pull, of="acceleration")
    made = shake(RigidMass(), shock, particles=0, seeds=1, progress=None)
    wanted = largest_stretch()
    assert wanted == pytest.approx(17.7e-3, rel=3e-3)
    missed = (2.0 * np.pi * PAPER.natural_frequency * 1e-3) ** 2 / 8.0
    # The pulse is a polygon of 110 sides, smaller than the sine by (pi / 110)^2 / 12.
    assert made.relative_peak[0, 0] == pytest.approx(wanted, rel=missed + 7e-5)
