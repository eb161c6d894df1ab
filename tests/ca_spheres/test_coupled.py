"""Spheres in the container on its spring: the rigid limit, weight, the stability limit."""

import numpy as np
import pytest

from ca_damper import SimulationDiverged
from ca_damper.batch import Batch
from ca_damper.oscillator import Oscillator
from ca_damper.spheres import Spheres
from ca_damper.table import SceneTable

G, MASS, STIFFNESS = 9.8, 0.2e-3, 123.4


def test_heap_that_never_lifts_is_a_rigid_mass():
    """While x_amp w^2 < g: the transfer function with M + N m, hanging lower by N m g / K, to 2e-3.

    About the resonance of either number, where a lag of dt / 2 in the force, a damping of
    N m w^2 dt / 2 = 1.5e-4 N s/m of 0.08, would already take those 2e-3.
    """
    particles = np.repeat([10, 50], 3)
    frequency = np.array([5.6, 5.96, 6.2, 5.5, 5.706, 5.9])
    oscillator = Oscillator(base_amplitude=0.05e-3)
    table = SceneTable(particles, 1, 2e-5, frequency, oscillator.base_amplitude)
    batch = Batch(Spheres(), table, measured_cycles=20)
    batch.start("rigid")
    cycles = batch.run(130, 20)
    mass = particles * MASS
    wanted = oscillator.base_amplitude * np.abs(oscillator.transfer(frequency, mass))
    assert np.all(wanted * cycles.omega**2 < 0.5 * G)
    assert np.sqrt(2.0) * cycles.rms == pytest.approx(wanted, rel=2e-3)
    assert cycles.mean == pytest.approx(-mass * G / STIFFNESS, rel=2e-3)
    assert cycles.mean_force == pytest.approx(-mass * G, rel=1e-3)


def test_no_spheres_leave_the_container_to_its_transfer_function():
    frequency, oscillator = np.array([5.5, 6.0288, 6.5]), Oscillator()
    batch = Batch(
        Spheres(),
        SceneTable(0, 1, 2e-5, frequency, oscillator.base_amplitude),
        measured_cycles=5,
    )
    batch.start("empty")
    wanted = oscillator.base_amplitude * np.abs(oscillator.transfer(frequency))
    assert np.sqrt(2.0) * batch.run(1, 5).rms == pytest.approx(wanted, rel=1e-6)


def shaken(dt, **options):
    """Thirty spheres in a container driven at 15 mm; 3 cycles."""
    table = SceneTable(30, 1, dt, 6.0, 0.015)
    batch = Batch(Spheres(**options), table, mount="base")
    batch.start()
    batch.run(2, 1)
    return batch


@pytest.mark.parametrize("dt", [6e-5, 1e-4, 1e-3])
def test_run_beyond_the_stability_limit_ends_as_diverged_with_a_step_that_does(dt):
    with pytest.raises(SimulationDiverged, match="dt must be at most") as caught:
        shaken(dt)
    assert 1e-5 < caught.value.dt_allowed < dt
    # The energy of what flies at the container's 0.57 m/s and as high as the box.
    energy = shaken(caught.value.dt_allowed).sample()["energy"][0]
    assert energy < 30 * MASS * (0.5 * (2 * 0.57) ** 2 + G * 0.096)


def test_softer_spheres_bear_the_longer_step():
    # E^(-2/5): a hundredth of the modulus lets the step be 6.3 times as long.
    assert shaken(1e-4, young=5e6, wall_young=5e6).sample()["energy"][0] < 0.01
