"""Sleeping bodies that are woken: energy, momentum, and the level limit."""

import numpy as np
import pytest

from taichi_dem import CONCRETE, Multirate, Scene, Simulation, StepControl, effects
from taichi_dem.mesh.mesh import checked_mesh
from taichi_dem.mesh.shapes import bar, single
from tests.scenes import brisk_scene
from tests.structures import filled

SPEED, EDGE, GAP = 20.0, 0.03, 3e-5


def target():
    """A bar at rest, and a small body whose one sphere will meet the one of the bar's face."""
    block, fragment = bar(0.1, 0.05, (2, 1, 1)), single(EDGE)
    aim = block.points[block.group_faces("left")[0]].mean(axis=0)
    points = np.vstack([block.points, fragment.points + np.array([-GAP, aim[1], aim[2]])])
    tetrahedra = np.vstack([block.tetrahedra, fragment.tetrahedra + len(block.points)])
    return checked_mesh(points, tetrahedra, {"hole": block.group_faces("right")})


def test_energy_never_grows_when_a_fast_fragment_hits_a_sleeping_block():
    """Dashpots and friction only take; round-off of a sum of a dozen terms is left."""
    touch = effects.SphereContact(3, outer_faces=True), effects.Friction()
    listed = filled("paper", effects.BondDamping(), *touch, group="hole")
    method = Multirate(1e-6, 1e-6, control=StepControl(), dashpot="limited")
    simulation = Simulation(Scene(target(), CONCRETE, listed), method)
    velocity = np.zeros((simulation.model.body_count, 3))
    velocity[-1, 0] = SPEED
    simulation.state.set_motion(simulation.model.centre, velocity=velocity)
    energy = [1.0]
    for step in range(1, 11):
        simulation.advance_to(step)
        account = simulation.energy_balance.account()
        stored = account["kinetic"] + account["bond_strain"] + account["sphere_strain"]
        energy.append(stored / simulation.energy_balance.start_energy)
    assert energy[-1] < 0.5 and np.diff(energy).max() < 1e-13
    assert simulation.schedule.limits.woken[None] > 0
    assert max(simulation.energy_balance.momentum_errors()) < 1e-13


@pytest.fixture(scope="module")
def woken():
    """The paper's block under a brisk pulse with all of the control, until bonds have broken."""
    method = Multirate(1.6e-7, 2e-6, control=StepControl(), dashpot="limited")
    simulation = Simulation(brisk_scene(), method)
    simulation.advance_to(180)
    return simulation


def test_neighbours_differ_by_no_more_than_the_level_limit(woken):
    """A jump of more than 2 lasts for no longer than a ring of neighbours needs to wake."""
    top, level = woken.model.topology, woken.values(woken.state.level)
    holds = woken.values(woken.state.broken_tick) < 0
    jumps = np.abs(level[top.master] - level[top.slave])[holds]
    assert jumps.max() == 2


def test_waking_keeps_momentum_and_the_account(woken):
    report = woken.report()
    assert report.broken_faces > 30 and woken.schedule.limits.woken[None] > 100
    assert max(report.linear_momentum_error, report.angular_momentum_error) < 1e-13
    assert report.energy_residual_fraction < 0.01
