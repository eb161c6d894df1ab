"""A stress at the start: in balance, in every body, held by quiet boundaries, in the account."""

from dataclasses import replace

import numpy as np
import pytest

from taichi_dem import CONCRETE, ImplicitDashpots, InputError, Scene, Simulation, effects, shapes
from taichi_dem.output.record import Recorder

#: Components [Pa] xx, yy, zz, xy, yz, zx: every bond of the block below bears them.
STRESS = (-4e6, -2e6, -1e6, 1e6, -5e5, 3e5)
MATRIX = np.array([[-4e6, 1e6, 3e5], [1e6, -2e6, -5e5], [3e5, -5e5, -1e6]])
STEP, STEPS = 2e-7, 500
BLOCK = shapes.block(0.2, element=0.08, scatter=1).group("skin", lambda x: x[:, 0] < 1.0)


def made(stress, **options):
    """A block on a quiet boundary all around that begins with a stress, after its start."""
    listed = [effects.BondDamping(), effects.Softening(), effects.ShearSlip()]
    scene = Scene(BLOCK, CONCRETE, [*listed, effects.QuietBoundary("skin")], stress=stress)
    simulation = Simulation(replace(scene, **options), ImplicitDashpots(STEP))
    simulation.start()
    return simulation


@pytest.fixture(scope="module")
def resting():
    simulation = made(STRESS)
    start = simulation.energy_balance.start_energy
    simulation.advance_to(STEPS)
    return simulation, start


def test_a_block_that_is_stressed_and_held_does_not_move(resting):
    """To 1e-9 of the way s t / (rho c) of a wave of the stress in this time.

    Without the traction, quiet boundaries alone let it go on as such a wave.
    """
    simulation, _ = resting
    model = simulation.model
    speed = np.sqrt(CONCRETE.normal_stiffness * 0.02 / CONCRETE.density)
    way = 4e6 / (CONCRETE.density * speed) * STEP * STEPS
    moved = np.abs(simulation.motion()["position"] - model.centre).max()
    assert moved < 1e-9 * way
    loose = made(STRESS)
    for load in loose.tables.loads:
        load.law.fill(0.0)
    loose.advance_to(STEPS)
    assert np.abs(loose.motion()["position"] - model.centre).max() > 0.1 * way


def test_every_body_has_the_stress(resting):
    """Virial of a body: the mean of r t over its faces, which is the stress to rounding.

    Bodies at a corner apart, whose traction is not shared by area.
    """
    simulation, _ = resting
    model = simulation.model
    faces = (model.topology.body_bond < 0).sum(axis=1)
    found = Recorder(simulation).frame().stress[faces < 2]
    assert len(found) and np.abs(found - MATRIX).max() < 1e-9 * max(map(abs, STRESS))


def test_the_account_has_the_energy_of_the_stress(resting):
    """Sum over bonds of A / 2 (t_n^2 / k_n + t_s^2 / k_s), and nothing else."""
    simulation, start = resting
    model = simulation.model
    normal = model.bonds["frame"][:, 0]
    pull = normal @ MATRIX
    along = (pull * normal).sum(axis=1)
    across2 = (pull * pull).sum(axis=1) - along**2
    area = 3.0 * model.bonds["area"]
    held = along**2 / CONCRETE.normal_stiffness + across2 / CONCRETE.shear_stiffness
    assert start == pytest.approx(0.5 * (area * held).sum(), rel=1e-12)
    account = simulation.energy_balance.account()
    assert account["bond_strain"] == pytest.approx(start, rel=1e-9)
    assert abs(account["residual"]) < 1e-9 * start


def test_what_is_no_stress_or_breaks_bonds_is_refused():
    for wrong in ((1.0, 2.0), "x", 1.0, (0, 0, 0, 0, 0, np.nan)):
        with pytest.raises(InputError, match="stress must be six numbers"):
            Scene(BLOCK, CONCRETE, stress=wrong)
    for stress, word in (((7e6, 7e6, 7e6, 0, 0, 0), "tension"), ((0, -5e7, 0, 0, 0, 0), "shear")):
        with pytest.raises(InputError, match=f"below its strength, got a {word}"):
            Scene(BLOCK, CONCRETE, stress=stress)
    with pytest.raises(InputError, match="no face group"):
        Scene(BLOCK, CONCRETE, [effects.Traction("none", STRESS)])
