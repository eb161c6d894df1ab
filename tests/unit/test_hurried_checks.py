"""Checks of a run between calls of its driver: skipped only where they take much of its time."""

from types import SimpleNamespace

import pytest

from taichi_dem import CONCRETE, Scene, Simulation, Uniform
from taichi_dem.diagnostics import divergence
from taichi_dem.mesh.shapes import single
from taichi_dem.step.drivers import CALL_SECONDS


@pytest.fixture
def checks(monkeypatch):
    """A function: numbers of those calls whose energy is checked, if such checks take so long.

    Calls of the driver take CALL_SECONDS each.
    """
    simulation = Simulation(Scene(single(), CONCRETE), Uniform())
    simulation.start()
    check, made = simulation.divergence_check, []
    clock = SimpleNamespace(now=0.0, call=0)
    monkeypatch.setattr(divergence, "time", SimpleNamespace(process_time=lambda: clock.now))

    def made_of(seconds):
        def spend():
            made.append(clock.call)
            clock.now += seconds[clock.call]

        monkeypatch.setattr(check, "_check_energy", spend)
        for clock.call in range(len(seconds)):
            clock.now += CALL_SECONDS
            check.check(hurried=True)
        return made

    return made_of


CHEAP = 0.9 * divergence.SHARE * CALL_SECONDS


def test_checks_that_take_no_more_than_their_share_are_all_made(checks):
    assert checks([CHEAP] * 50) == list(range(50))


@pytest.mark.parametrize("compiled", [0, 1, 20])
def test_a_check_that_compiles_lets_none_be_skipped(checks, compiled):
    """As the first one with contacts does."""
    assert checks([CHEAP] * compiled + [10.0] + [CHEAP] * 29) == list(range(compiled + 30))


def test_long_checks_take_their_share(checks):
    """One call in five where they take five times their share; the first two checks measure."""
    made = checks([5.5 * divergence.SHARE * CALL_SECONDS] * 50)
    assert made == [0, 1, *range(6, 50, 5)]
