"""The start of a run evaluates every bond once, in the kernel of steps as by loops of its own."""

import numpy as np
import pytest

from taichi_dem import (
    CONCRETE,
    ImplicitDashpots,
    Multirate,
    Scene,
    Simulation,
    StepControl,
    Uniform,
    effects,
)
from taichi_dem.mesh.shapes import bar
from taichi_dem.step.sleeping import ASLEEP
from tests.slow import slow_but

METHODS = [
    ImplicitDashpots(4e-7),
    Uniform(2e-8),
    Uniform(2e-8, dashpot="limited"),
    Multirate(8e-8, 1e-6),
    Multirate(8e-8, 1e-5, control=StepControl(dashpot_floor=1e-8), dashpot="limited"),
]


def begun(method, driver, sleep):
    """A bar whose last body is off its place by less than coordinates are rounded by, started."""
    gas = effects.GasPressure("left", peak=3e6, rise=1e-4, decay_ratio=1.0)
    scene = Scene(bar(0.8, 0.1, (8, 1, 1)), CONCRETE, "auto", loads=[gas], sleep=sleep)
    simulation = Simulation(scene, method, driver)
    place, velocity = simulation.model.centre.copy(), np.zeros((simulation.model.body_count, 3))
    place[-1, 0] += 1e-15
    velocity[0] = 0.1, 0.2, 0.3
    simulation.state.set_motion(place, velocity=velocity)
    simulation.start()
    return simulation


@pytest.mark.parametrize("sleep", [pytest.param(0.0, marks=pytest.mark.slow), 1e-6])
@pytest.mark.parametrize("method", slow_but(METHODS, METHODS[3]), ids=lambda method: method.name)
def test_both_drivers_begin_with_the_same_bits(method, sleep):
    first, second = (begun(method, driver, sleep) for driver in ("resident", "parallel"))
    found, other = (
        {name: field.to_numpy() for name, field in one.state.fields().items()}
        for one in (first, second)
    )
    assert [name for name in found if not np.array_equal(found[name], other[name])] == []
    assert first.schedule.evaluations.to_numpy().sum() == 0
    assert np.abs(found["slot"][:4]).max() > 0.0


@pytest.mark.parametrize("method", slow_but(METHODS[:3], METHODS[1]), ids=lambda m: m.name)
def test_a_bond_that_sleeps_acts_at_the_start(method):
    """What it holds by rounding is given to its bodies, though they sleep and it is not listed."""
    simulation = begun(method, "resident", 1e-6)
    last = simulation.model.body_count - 1
    assert simulation.state.sleeping.awake.to_numpy()[last] == ASLEEP
    assert np.abs(simulation.state.slot.to_numpy()[4 * last : 4 * last + 4]).max() > 0.0
