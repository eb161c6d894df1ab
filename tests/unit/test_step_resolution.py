"""A run that stays stable at a step too long for its bonds or contacts says so."""

import numpy as np
import pytest

from taichi_dem import CONCRETE, ImplicitDashpots, Scene, Simulation, Uniform, effects
from taichi_dem.mesh.shapes import pair
from taichi_dem.stability.quality import quality_report


def run(method, steps, *, mesh=None, velocity=None, listed=()):
    """A bonded pair after some steps: the simulation."""
    mesh = mesh or pair()
    simulation = Simulation(Scene(mesh, CONCRETE, [effects.BondDamping(), *listed]), method)
    simulation.state.set_motion(simulation.model.centre, [[1.0, 0, 0, 0]] * 2, velocity)
    simulation.advance_to(steps)
    simulation.sample()
    return simulation


def test_limited_dashpots_are_named_with_the_share_that_their_step_leaves():
    # c min(1, 1.7 / X), X = 2 dt rate, and the step limit of dashpots is 1 / rate.
    mesh = pair(0.05, 0.001)
    step = 10.0 * quality_report(mesh, CONCRETE).dashpot_step_s[0]
    simulation = run(Uniform(step, dashpot="limited"), 3, mesh=mesh)
    share = 1.7 / 20.0
    assert simulation.step_resolution.share[0] == pytest.approx(share, rel=1e-12)
    (said,) = simulation.report().needs
    assert f"bond 0 to {100 * share:.2g} %" in said


@pytest.mark.parametrize(
    ("step", "named"), [(4e-7, True), pytest.param(2e-8, False, marks=pytest.mark.slow)]
)
def test_a_bond_that_failed_a_step_late_is_named(step, named):
    # At 200 m/s the failure opening of 30 um is passed in 0.15 us.
    apart = [[-100.0, 0.0, 0.0], [100.0, 0.0, 0.0]]
    simulation = run(
        ImplicitDashpots(step), round(4e-6 / step), velocity=apart, listed=[effects.Softening()]
    )
    found = simulation.report().needs
    assert bool(found) == named
    if named:
        widest = simulation.tables.tension.unit.to_numpy()[:3, 0].max()
        assert f"{widest / CONCRETE.failure_opening:.2g} times its failure opening" in found[0]
    assert not simulation.step_resolution.findings(np.array([False, False]))
