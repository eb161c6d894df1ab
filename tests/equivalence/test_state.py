"""The state object holds all that changes: a run continues from it as if nothing had happened."""

import numpy as np
import pytest
import taichi as ti

from taichi_dem import Multirate, Simulation
from tests.scenes import brisk_scene

METHOD = Multirate(1e-8, 2e-7)
#: Bonds are broken and bodies in contact at the first; more break until the second.
SAVED, LAST = 2700, 2900


def arrays(simulation):
    """Every changing field as an array."""
    return {name: field.to_numpy() for name, field in simulation.state.fields().items()}


@ti.kernel
def _list_all(schedule: ti.template()):
    for _ in range(1):
        schedule.low[None] = 0
        schedule.start_all()


@pytest.fixture(scope="module")
def runs():
    """A straight run, and one that starts from the fields that the first had on its way."""
    straight, restarted = (Simulation(brisk_scene(), METHOD) for _ in range(2))
    straight.advance_to(SAVED)
    saved = arrays(straight)
    restarted.start()
    for name, field in restarted.state.fields().items():
        field.from_numpy(saved[name])
    _list_all(restarted.schedule)
    restarted.broad_phase.search()
    for simulation in (straight, restarted):
        simulation.advance_to(LAST)
    return saved, straight, restarted


def test_a_run_continues_from_its_state_with_the_same_bits(runs):
    saved, straight, restarted = runs
    last, again = arrays(straight), arrays(restarted)
    broken = [(fields["broken_tick"] >= 0).sum() for fields in (saved, last)]
    assert 0 < broken[0] < broken[1]
    assert [name for name in last if not np.array_equal(last[name], again[name])] == []


def test_a_run_continues_from_its_state_with_the_same_account(runs):
    """Each term of the energy balance, those of the sphere contacts included.

    A checkpoint may sum parts in another order: n terms of one sign are then known to n eps, and
    the residual, a difference, to that of the largest.
    """
    _, straight, restarted = runs
    first, second = straight.energy_balance.account(), restarted.energy_balance.account()
    assert first["sphere_dashpot"] > 0.0 and first["friction"] > 0.0 and first["injected"] > 0.0
    error = straight.contacts.store.slots * np.finfo(float).eps
    off = [
        name
        for name in first
        if name != "residual" and abs(first[name] - second[name]) > error * abs(first[name])
    ]
    assert off == []
    assert abs(first["residual"] - second["residual"]) < error * first["load_work"]
