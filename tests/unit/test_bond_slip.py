"""Residual slip of bonds that hold: measured, reported, warned of."""

import numpy as np
import pytest

from taichi_dem import CONCRETE, Scene, Simulation, Uniform, effects
from taichi_dem.kit.allocation import assign, values
from taichi_dem.mesh.shapes import pair
from taichi_dem.report.resolution import MOST_SLIP

EPS = np.finfo(float).eps

EDGE = 0.05


def slid(share):
    """Simulation of the pair, sampled with a residual slip of a share of an edge in a unit."""
    simulation = Simulation(Scene(pair(EDGE), CONCRETE, [effects.ShearSlip()]), Uniform(1e-8))
    simulation.start()
    write_slip(simulation, share)
    simulation.sample()
    return simulation


def write_slip(simulation, share):
    """Let the second unit of the bond have slipped by a share of an edge, oblique to the axes."""
    field = simulation.state.fields()["shear_slip_slip"]
    slip = values(field)
    slip[1, :2] = share * EDGE * np.array([0.6, -0.8])
    assign(field, slip)


def test_share_is_that_of_the_shortest_edge():
    """To the rounding of a length over another."""
    report = slid(0.03).report()
    (found,) = report.bond_slip
    assert found.share == pytest.approx(0.03, abs=16 * EPS)
    assert found.where == 0 and found.count == 0


def test_far_slip_is_warned_of_and_an_effect_that_weakens_is_missed():
    report = slid(2.0 * MOST_SLIP).report()
    assert any("bond 0 " in need and "by 10 %" in need for need in report.needs)
    advice = report.advice()
    assert [one.effect for one in advice.missing] == ["SlipWeakening"]
    table = advice.table()
    assert table["effect"].tolist() == ["shear_slip", "SlipWeakening"]
    assert table["advice"].tolist() == ["keep", "list it"] and table["where"][1] == "bond 0"


def test_largest_of_all_recordings_is_kept():
    """Not that of the end: bonds that slipped far are often released later."""
    simulation = slid(0.1)
    write_slip(simulation, 0.02)
    simulation.sample()
    (found,) = simulation.report().bond_slip
    assert found.share == pytest.approx(0.1, abs=16 * EPS) and found.count == 1
