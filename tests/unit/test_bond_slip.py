"""Residual slip of bonds that hold: measured, reported, warned of."""

import numpy as np
import pytest

from taichi_dem import CONCRETE, Scene, Simulation, Uniform, effects, needed_effects
from taichi_dem.diagnostics.bond_slip import MOST_SLIP
from taichi_dem.mesh.shapes import pair

EPS = np.finfo(float).eps

EDGE = 0.05
FULL, WEAK = effects.ShearSlip(), effects.SlipWeakening(1e5)


def slid(share, *listed, broken=False):
    """Simulation of the pair, sampled with a residual slip of a share of an edge in a unit."""
    simulation = Simulation(Scene(pair(EDGE), CONCRETE, listed), Uniform(1e-8))
    simulation.start()
    for name in ("shear_slip", "slip_weakening"):
        if name in simulation.state.fields():
            write_slip(simulation, name, share)
    if broken:
        simulation.state.broken_tick[0] = 0
    simulation.sample()
    return simulation


def write_slip(simulation, name, share):
    """Let the second unit of the bond have slipped by a share of an edge, oblique to the axes."""
    field = simulation.state.fields()[name]
    slip = field.to_numpy()
    slip[1, :2] = share * EDGE * np.array([0.6, -0.8])
    field.from_numpy(slip)


def needs_of(report):
    """Needs but for the account of energy, which does not know of bodies that were put there."""
    return [need for need in report.needs if "account of energy" not in need]


def test_share_is_that_of_the_shortest_edge():
    """To the rounding of a length over another."""
    report = slid(0.03, FULL).report()
    (found,) = report.bond_slip
    assert found.share == pytest.approx(0.03, abs=16 * EPS)
    assert found.bond == 0 and not found.excessive and needs_of(report) == []
    assert "3 % of the shortest edge of its face (bond 0)" in str(report)
    assert found.place_m == pytest.approx((0.0, 0.0, 0.0), abs=EPS)


@pytest.mark.parametrize(("law", "words"), [(FULL, "SlipWeakening in place"), (WEAK, "coarser")])
def test_far_slip_is_warned_of_with_bond_share_and_remedy(law, words):
    report = slid(2.0 * MOST_SLIP, law).report()
    (need,) = needs_of(report)
    assert "bond 0 " in need and "by 10 %" in need and words in need
    listed = [finding.effect for finding in needed_effects(report).missing]
    assert listed == (["SlipWeakening"] if law is FULL else [])
    assert f"warning: {need}" in str(report)


def test_elastic_and_released_bonds_have_no_slip():
    assert slid(0.1).report().bond_slip == ()
    released = slid(0.1, FULL, effects.Softening(), broken=True).report()
    assert released.bond_slip == ()


def test_figures_go_through_a_checkpoint():
    simulation = slid(0.1, FULL)
    kept = simulation.bond_slips.saved()
    other = slid(0.0, FULL)
    other.bond_slips.resume(kept)
    assert other.report().bond_slip == simulation.report().bond_slip
    assert all(isinstance(value, np.ndarray) for value in kept.values())


def test_largest_of_all_recordings_is_kept():
    """Not that of the end: bonds that slipped far are often released later."""
    simulation = slid(0.1, FULL)
    write_slip(simulation, "shear_slip", 0.02)
    simulation.sample()
    (found,) = simulation.report().bond_slip
    assert found.share == pytest.approx(0.1, abs=16 * EPS) and found.most == 1
