"""Whichever driver proves faster continues, and no bit depends on which."""

import numpy as np
import pytest

from taichi_dem import ImplicitDashpots, Simulation, runtime
from taichi_dem.step.drivers import DRIVERS, PARALLEL_FROM, RESIDENT_BELOW, AutoDriver, driver_name
from tests.bar_blast import UNTIL, bar_scene

METHOD = ImplicitDashpots(4e-7, refresh=1e-5)
STEPS = round(UNTIL / METHOD.dt0)


class Slow:
    """A clock on which one driver takes a hundred times as long as the other, whatever they do."""

    def __init__(self, slow):
        self.slow, self.now = slow, 0.0

    def __call__(self):
        return self.now

    def time_calls(self, auto):
        """Let the clock go on with every call of a driver."""
        for name, driver in auto.drivers.items():
            for call in ("few", "run"):
                setattr(driver, call, self._timed(getattr(driver, call), name))

    def _timed(self, call, name):
        def timed(*arguments):
            call(*arguments)
            self.now += 1.0 if name == self.slow else 0.01

        return timed


@pytest.mark.slow
def test_the_faster_driver_is_chosen_again_and_again_and_changes_no_bit():
    """The clock calls the resident driver slow, and after the first choice the parallel one."""
    straight = Simulation(bar_scene(), METHOD, "resident")
    straight.advance_to(STEPS)
    changing, clock = Simulation(bar_scene(), METHOD, "resident"), Slow("resident")
    drivers = {name: kind(changing.step) for name, kind in DRIVERS.items()}
    changing.driver = AutoDriver(changing.step, drivers)
    changing.driver.clock = clock
    changing.start()
    clock.time_calls(changing.driver)
    names = [changing.driver.name]
    changing.advance_to(STEPS // 3)
    names.append(changing.driver.name)
    clock.slow = "parallel"
    changing.driver._begin()
    changing.advance_to(STEPS)
    names.append(changing.driver.name)
    assert names == ["resident (measured)", "parallel (measured)", "resident (measured)"]
    assert straight.report().broken_faces > 0 and straight.report().pair_evaluations > 0
    for name, array in straight.state.motion().items():
        assert np.array_equal(array, changing.state.motion()[name]), name
    assert straight.energy_balance.account() == changing.energy_balance.account()


def test_auto_goes_by_size_and_threads():
    """Without a second thread the parallel driver has nothing to offer."""
    sizes = (RESIDENT_BELOW - 1, RESIDENT_BELOW, PARALLEL_FROM - 1, PARALLEL_FROM)
    found = [driver_name("auto", size) for size in sizes]
    assert runtime.settings().threads == 2
    assert found == ["resident", "measured", "measured", "parallel"]
