"""Whichever driver proves faster continues, and no bit depends on which."""

import numpy as np
import pytest

from taichi_dem import ImplicitDashpots, Simulation, runtime
from taichi_dem.step.auto_driver import PARALLEL_FROM, RESIDENT_BELOW, AutoDriver, driver_name
from taichi_dem.step.drivers import DRIVERS
from tests.bar_blast import UNTIL, squeezed_scene

METHOD = ImplicitDashpots(4e-7, refresh=1e-5)
STEPS = round(UNTIL / METHOD.dt0)


class Slow:
    """A clock on which one driver takes a hundred times as long as the other, whatever they do."""

    def __init__(self, slow):
        self.slow, self.now, self.auto = slow, 0.0, None

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


def measuring(simulation, clock):
    """Driver that measures both, drivers of its own, by a clock."""
    drivers = {name: kind(simulation.step) for name, kind in DRIVERS.items()}
    return AutoDriver(simulation.step, drivers, clock)


@pytest.fixture(scope="module")
def runs():
    """The same scene by the resident driver, and by one that changes to the parallel one and back.

    The clock calls the resident driver slow, and after the first choice the parallel one.
    """
    straight = Simulation(squeezed_scene(), METHOD, "resident")
    straight.advance_to(STEPS)
    simulation = Simulation(squeezed_scene(), METHOD, "resident")
    clock = Slow("resident")
    simulation.driver = measuring(simulation, clock)
    simulation.start()
    clock.time_calls(simulation.driver)
    names = [simulation.driver.name]
    simulation.advance_to(STEPS // 3)
    names.append(simulation.driver.name)
    clock.slow = "parallel"
    simulation.driver._begin()
    simulation.advance_to(STEPS)
    names.append(simulation.driver.name)
    return straight, simulation, names


@pytest.mark.slow
def test_the_faster_driver_is_chosen_again_and_again(runs):
    assert runs[2] == ["resident (measured)", "parallel (measured)", "resident (measured)"]
    assert runs[1].report().driver == "resident (measured)"


@pytest.mark.slow
def test_changing_drivers_changes_no_bit(runs):
    straight, changing, _ = runs
    assert straight.report().broken_faces > 0 and straight.report().pair_evaluations > 0
    for name, array in straight.state.motion().items():
        assert np.array_equal(array, changing.state.motion()[name]), name
    assert straight.energy_balance.account() == changing.energy_balance.account()
    assert straight.evaluations() == changing.evaluations()


@pytest.mark.slow
def test_tries_take_their_share(runs):
    """Tries of 2 (1 + 0.01) s are repeated once the driver has gone on for twenty times as long."""
    _, simulation, _ = runs
    clock = Slow("parallel")
    made = measuring(simulation, clock)
    for name, driver in made.drivers.items():
        seconds = 1.0 if name == "parallel" else 0.01
        driver.few = lambda end, count, seconds=seconds: clock.__dict__.update(
            now=clock.now + seconds
        )
        driver.run = lambda end: clock.__dict__.update(now=clock.now + 5.0)
    calls = 0
    for _ in range(4):
        made.run(0)
    assert not made.pending_tries and made.chosen == "resident"
    while not made.pending_tries:
        made.run(0)
        calls += 1
    assert calls == 9  # 20 * 2.02 s in pieces of 5 s


def test_auto_goes_by_size_and_threads():
    """Without a second thread the parallel driver has nothing to offer."""
    sizes = (RESIDENT_BELOW - 1, RESIDENT_BELOW, PARALLEL_FROM - 1, PARALLEL_FROM)
    found = [driver_name("auto", size) for size in sizes]
    assert runtime.settings().threads == 2
    assert found == ["resident", "measured", "measured", "parallel"]
