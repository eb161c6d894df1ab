"""Sleeping bodies that are hit: energy, momentum, bits with wake-up on; what fails without it."""

import numpy as np
import pytest

from taichi_dem import (
    CONCRETE,
    Multirate,
    Scene,
    Simulation,
    SimulationDiverged,
    StepControl,
    effects,
)
from taichi_dem.mesh.mesh import checked_mesh
from taichi_dem.mesh.shapes import bar, single
from tests.scenes import brisk_scene

DT0, SPEED, EDGE, GAP = 1e-6, 20.0, 0.03, 3e-5


def target(block):
    """A block at rest, and a small body whose one sphere will meet the one of a block's face."""
    fragment = single(EDGE)
    aim = block.points[block.group_faces("left")[0]].mean(axis=0)
    points = np.vstack([block.points, fragment.points + np.array([-GAP, aim[1], aim[2]])])
    tetrahedra = np.vstack([block.tetrahedra, fragment.tetrahedra + len(block.points)])
    return checked_mesh(points, tetrahedra, {})


def boulder():
    """One body twenty times as heavy as the fragment, its base towards it."""
    mesh = single(2.7 * EDGE)
    return checked_mesh(mesh.points * [-1.0, 1.0, 1.0], [[0, 2, 1, 3]], {"left": [[1, 2, 3]]})


def shot(control, until, block=None):
    """Energy after every largest step, as a share of the first; infinite once it diverges."""
    listed = [effects.SphereContact(3, outer_faces=True), effects.Friction(), effects.BondDamping()]
    method = Multirate(DT0, 1e-6, control=control)
    mesh = target(block or bar(0.1, 0.05, (2, 1, 1)))
    simulation = Simulation(Scene(mesh, CONCRETE, listed), method)
    count = simulation.model.body_count
    velocity = np.zeros((count, 3))
    velocity[-1, 0] = SPEED
    still = np.tile([1.0, 0.0, 0.0, 0.0], (count, 1))
    simulation.state.set_motion(simulation.model.centre, still, velocity)
    energy = [1.0]
    try:
        for step in range(1, round(until / DT0) + 1):
            simulation.advance_to(step)
            account = simulation.energy_balance.account()
            stored = account["kinetic"] + account["bond_strain"] + account["sphere_strain"]
            energy.append(stored / simulation.energy_balance.start_energy)
    except SimulationDiverged:
        energy.append(np.inf)
    return np.array(energy), simulation


def test_energy_never_grows_when_a_fast_fragment_hits_a_sleeping_block():
    """Dashpots and friction only take; round-off of a sum of a dozen terms is left."""
    energy, simulation = shot(StepControl(), 1e-5)
    assert energy[-1] < 0.5 and np.diff(energy).max() < 1e-13
    assert simulation.schedule.limits.woken[None] > 0
    assert max(simulation.energy_balance.momentum_errors()) < 1e-13


@pytest.mark.slow
def test_a_hit_wakes_a_boulder_that_is_kicked_away_in_its_sleep():
    """Of the events only "hit" is on, or none: asleep, lambda dt is a hundred, and energy is made.

    A boulder has no springs that could ring: the kinetic energy is half a step older than that
    of the springs, and their sum swings by w dt / 2 of itself where no dashpot outweighs it.
    """
    options = {"level_jump": None, "ahead": 1.0}
    asleep, _ = shot(StepControl(wake=(), **options), 3e-6, boulder())
    woken, simulation = shot(StepControl(wake=("hit",), **options), 1e-5, boulder())
    assert asleep.max() > 2.0
    assert simulation.schedule.limits.woken[None] > 0
    assert np.diff(woken).max() < 1e-13 and woken[-1] < 0.5


def jumps(simulation):
    """Differences of level across the bonds that hold."""
    top, level = simulation.model.topology, simulation.state.level.to_numpy()
    holds = simulation.state.broken_tick.to_numpy() < 0
    return np.abs(level[top.master] - level[top.slave])[holds]


@pytest.fixture(scope="module")
def woken():
    """The paper's block under a brisk pulse with all of the control, until bonds have broken."""
    simulation = Simulation(brisk_scene(), Multirate(1.6e-7, 2e-6, control=StepControl()))
    simulation.advance_to(180)
    return simulation


def test_neighbours_differ_by_no_more_than_the_level_limit(woken):
    """A jump of more than 2 lasts for no longer than a ring of neighbours needs to wake."""
    free = Simulation(brisk_scene(), Multirate(1.6e-7, 2e-6, control=StepControl(level_jump=None)))
    free.advance_to(180)
    assert (jumps(woken) > 2).sum() == 0
    assert (jumps(free) > 2).sum() > 10


def test_waking_keeps_momentum_and_the_account(woken):
    report = woken.report()
    assert report.broken_faces > 30 and woken.schedule.limits.woken[None] > 100
    assert max(report.linear_momentum_error, report.angular_momentum_error) < 1e-13
    assert report.energy_residual_fraction < 0.01


@pytest.mark.slow
@pytest.mark.parametrize("dashpot", ["full", "limited"])
def test_waking_gives_the_same_bits_in_both_drivers(dashpot):
    fields = []
    for driver in ("resident", "parallel"):
        method = Multirate(1.6e-7, 2e-6, control=StepControl(safety=0.5), dashpot=dashpot)
        simulation = Simulation(brisk_scene(), method, driver)
        simulation.advance_to(155)
        fields.append({k: f.to_numpy() for k, f in simulation.state.fields().items()})
    assert (fields[0]["broken_tick"] >= 0).any()
    assert [k for k in fields[0] if not np.array_equal(fields[0][k], fields[1][k])] == []
