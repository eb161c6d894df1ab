"""What steps of different length really saved: a twin with one step for all, at the same state."""

import math

import numpy as np
import pytest

from taichi_dem import Multirate, Simulation, SimulationDiverged, Uniform, simulate
from taichi_dem import measured_speedup as speedup
from taichi_dem.measured_speedup import _twin, measured_speedup
from taichi_dem.run_plan import RunProgress
from taichi_dem.timeline import NEVER
from tests.scenes import brisk_scene


@pytest.fixture(scope="module")
def broken():
    """A run that broke bonds and stands at steps of several lengths."""
    simulation = Simulation(brisk_scene(), Multirate(1e-8, 2e-7))
    simulation.advance_to(2000)
    return simulation


def test_a_twin_stands_where_the_run_does_and_takes_its_smallest_step(broken):
    report = broken.report()
    assert report.broken_faces > 0 and report.ideal_gain > 1.1
    twin = _twin(broken, report.smallest_step_s)
    for name, values in broken.state.motion().items():
        if name not in ("level", "rotation"):
            assert np.array_equal(twin.state.motion()[name], values), name
    both = [run.state.broken_tick.to_numpy() == NEVER for run in (broken, twin)]
    assert np.array_equal(*both)
    assert twin.method.dt0 == report.smallest_step_s
    twin.advance_to(50)
    assert np.all(twin.state.level.to_numpy() == 0)
    assert twin.loan.engine is broken.loan.engine


def test_a_measured_run_ends_its_progress_at_the_end_and_is_not_lost_by_its_twin(monkeypatch):
    """What the twin compiles is not told, and where it diverges nothing was measured."""
    monkeypatch.setattr(speedup, "LEAST_RUN", 0.0)
    told, scene, method = [], brisk_scene(), Multirate(1e-8, 2e-7)
    result = simulate(scene, method=method, until=1e-6, samples=1, progress=told.append)
    assert result.report.measured_speedup > 0.0
    assert isinstance(told[-1], RunProgress) and told[-1].share == 1.0

    def diverging(*_):
        raise SimulationDiverged("the twin ran away")

    monkeypatch.setattr(speedup, "measured_speedup", diverging)
    result = simulate(scene, method=method, until=1e-6, samples=1)
    assert result.report.measured_speedup is None and not result.diverged


@pytest.mark.slow
def test_gain_is_time_over_time_and_is_said_in_the_report(broken):
    """Uniform evaluations over the run's, times what one takes; nothing of the run changes."""
    before, report = broken.state.position.to_numpy(), broken.report()
    gain = measured_speedup(broken, seconds=0.05)
    assert math.isfinite(gain) and gain > 0.0
    assert np.array_equal(broken.state.position.to_numpy(), before)
    assert broken.report() == report


def test_one_step_for_all_gains_nothing():
    simulation = Simulation(brisk_scene(), Uniform(1e-8))
    assert measured_speedup(simulation) == 1.0
