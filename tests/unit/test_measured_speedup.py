"""What steps of different length saved is measured against one step for all, at the same state."""

import numpy as np
import pytest

from taichi_dem import CONCRETE, Multirate, Scene, Simulation, effects
from taichi_dem.measured_speedup import _twin, measured_speedup
from taichi_dem.mesh.shapes import bar


@pytest.fixture(scope="module")
def broken():
    """A run that broke bonds and stands at steps of several lengths."""
    laws = [effects.BondDamping(), effects.Softening()]
    torn = Scene(bar(0.4, 0.1, (8, 2, 2)), CONCRETE, laws, velocity=lambda x: 300.0 * x**2)
    simulation = Simulation(torn, Multirate(1e-7, 2e-7))
    simulation.advance_to(100)
    return simulation


def test_a_twin_stands_where_the_run_does_and_takes_its_smallest_step(broken):
    report = broken.report()
    assert report.broken_faces > 0 and report.ideal_gain > 1.1
    twin = _twin(broken, report.smallest_step_s)
    for name, values in broken.state.motion().items():
        if name not in ("level", "rotation"):
            assert np.array_equal(twin.state.motion()[name], values), name
    assert np.array_equal(broken.state.broken(), twin.state.broken())
    twin.advance_to(50)
    assert np.all(twin.values(twin.state.level) == 0)
    assert measured_speedup(broken, seconds=0.02) > 0.0
