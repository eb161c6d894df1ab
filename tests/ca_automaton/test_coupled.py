"""The automaton in the container on its spring: rigid limit, damping, place of the peak."""

import numpy as np
import pytest

from ca_damper.batch import Batch
from ca_damper.fixed_mass import Empty
from ca_damper.measures import peak
from ca_damper.oscillator import Oscillator
from ca_damper.scenes.table import SceneTable
from ca_damper.spheres import Spheres
from tests.paper import expected, paper

MASS, GRAVITY = 0.2e-3, 10.0
OSCILLATOR = Oscillator()
NATURAL = OSCILLATOR.natural_frequency


def run(filling, particles, ratios, seeds=1, base=0.6e-3, cycles=(150, 20)):
    """Measured cycles of every particle number, frequency ratio and seed."""
    grid = np.meshgrid(particles, ratios, np.arange(seeds) + 1, indexing="ij")
    count, ratio, seed = (part.ravel() for part in grid)
    table = SceneTable(count, seed, filling.default_dt, ratio * NATURAL, base)
    batch = Batch(filling, table, measured_cycles=cycles[1])
    with expected(batch):
        batch.start("rigid")
    return batch.run(*cycles), grid[0].shape


def peaks(filling, particles, ratios, seeds=1):
    """(ratio, RMS) of the peak for each number of particles; mean over seeds."""
    cycles, shape = run(filling, particles, ratios, seeds)
    return np.array([peak(ratios, curve) for curve in cycles.rms.reshape(shape).mean(axis=2)])


def test_an_empty_automaton_is_an_empty_container():
    """N = 0: the same bits."""
    ratios = np.array([0.9, 1.0, 1.1])
    nothing = run(Empty(), [0], ratios)[0]
    automaton = run(paper(), [0], ratios)[0]
    assert np.array_equal(nothing.rms, automaton.rms)
    assert np.array_equal(nothing.mean_force, automaton.mean_force)


@pytest.mark.parametrize("particles", [10, 30, 50, 160])
def test_rigid_limit(particles):
    """While x w^2 < g the heap never lifts: response of M + N m, mean -N m g / K, to 2e-3.

    A base of 0.1 mm; at 0.8 and 1.2 of the natural frequency x w^2 stays below g / 3, so that no
    particle keeps bouncing either. 400 cycles for the transient of 1 / (zeta w) = 2.2 s.
    """
    ratios = np.array([0.8, 1.2])
    cycles, _ = run(paper(), [particles], ratios, base=0.1e-3, cycles=(400, 20))
    added = particles * MASS
    expected = 0.1e-3 * abs(OSCILLATOR.transfer(ratios * NATURAL, added))
    assert np.all(expected * cycles.omega**2 < GRAVITY / 3)
    assert cycles.rms * np.sqrt(2) == pytest.approx(expected, rel=2e-3)
    assert cycles.mean == pytest.approx(-added * GRAVITY / OSCILLATOR.stiffness, rel=2e-3)
    assert cycles.apparent_mass == pytest.approx(added, rel=2e-3)
    assert abs(cycles.apparent_damping).max() < 2e-3 * OSCILLATOR.damping


@pytest.mark.slow
@pytest.mark.parametrize("accounting", ["landing+ejection", "all"])
def test_damping_grows_with_the_particles(accounting):
    """The highest response of five seeds falls from N = 10 to N = 50.

    The highest and not the mean: near N = 10 a seed decides between a high and a low branch.
    """
    particles, ratios = [10, 20, 30, 40, 50], np.arange(0.93, 1.0051, 0.01)
    cycles, shape = run(paper(accounting=accounting), particles, ratios, 5)
    assert np.all(np.diff(cycles.rms.reshape(shape).max(axis=(1, 2))) < 0)


@pytest.mark.slow
def test_static_contact_moves_the_peak_as_spheres_do_and_landing_does_not():
    """Within 0.01 of the spheres' frequency ratio at N = 30 and 50."""
    ratios = np.arange(0.93, 1.0051, 0.005)
    spheres = peaks(Spheres(), [30, 50], ratios[::2])[:, 0]
    static = peaks(paper(), [30, 50], ratios, 3)[:, 0]
    landing = peaks(paper(accounting="landing"), [30, 50], ratios, 3)[:, 0]
    assert abs(static - spheres).max() < 0.01
    rigid = np.sqrt(OSCILLATOR.mass / (OSCILLATOR.mass + np.array([30, 50]) * MASS))
    assert abs(static - rigid).max() < 0.01
    assert landing.min() > 0.98
