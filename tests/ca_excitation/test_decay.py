"""Free decay: the logarithmic decrement against closed forms."""

import math

import numpy as np
import pytest

from ca_damper import (
    Empty,
    InputError,
    Oscillator,
    RigidMass,
    Spheres,
    excitation,
    logarithmic_decrement,
    shake,
)

STILL = excitation.sines(6.0, 0.0, 3.0)
#: A parabola through three samples a millisecond apart is off by (w h)^4 / 100 or so at 6 Hz.
APART = (2.0 * math.pi * 6.03 * 1e-3) ** 4


def exact(mass):
    """Decrement of the paper's structure with a mass [kg] in it."""
    own = Oscillator()
    ratio = own.damping / (2.0 * math.sqrt(own.stiffness * (own.mass + mass)))
    return 2.0 * math.pi * ratio / math.sqrt(1.0 - ratio**2)


@pytest.mark.parametrize(
    ("filling", "particles", "mass"), [(Empty(), 0, 0.0), (RigidMass(), 20, 4e-3)]
)
def test_decrement_of_a_linear_structure_is_its_closed_form(filling, particles, mass):
    """At every amplitude, also about the place to which the weight of the mass pulls it."""
    made = shake(filling, STILL, particles=particles, seeds=1, displacement=0.02, progress=None)
    amplitude, decrement = logarithmic_decrement(made.x[:, 0, 0])
    assert len(amplitude) > 25 and (np.diff(amplitude) < 0.0).all()
    # Of two amplitudes, each off by APART of itself and of the sag's share.
    assert decrement == pytest.approx(np.full(len(decrement), exact(mass)), abs=10.0 * APART)


def test_a_velocity_at_the_beginning_swings_as_far_as_its_energy_allows():
    """v / w, less what the dashpot takes of a quarter of a cycle: a share of pi z / 2."""
    made = shake(Empty(), STILL, particles=0, seeds=1, velocity=0.5, progress=None)
    own = Oscillator()
    omega = 2.0 * math.pi * own.natural_frequency
    assert made.peak[0, 0] == pytest.approx(0.5 / omega * (1.0 - exact(0.0) / 4.0), rel=1e-3)


def test_grains_damp_where_they_are_thrown():
    """Beyond A w^2 = g, 7 mm, far more than the structure itself; below as much as a mass."""
    made = shake(Spheres(), STILL, particles=30, seeds=1, displacement=0.02, progress=None)
    amplitude, decrement = logarithmic_decrement(made.x[:, 0, 0])
    thrown, still = decrement[amplitude > 10e-3], decrement[amplitude < 5e-3]
    assert thrown.mean() > 2.0 * exact(6e-3)
    assert still.mean() == pytest.approx(exact(6e-3), rel=0.1)


@pytest.mark.parametrize(
    ("x", "words"),
    [
        ([0.0, 1.0, math.nan], "finite numbers"),
        ([[0.0, 1.0]], "series"),
        (np.zeros(100), "swing to and fro"),
        (np.sin(3.0 * np.arange(100)), "eight samples"),
    ],
)
def test_what_does_not_decay_is_refused(x, words):
    with pytest.raises(InputError, match=words):
        logarithmic_decrement(x)
