"""The report tells energy that breaking faces injected, from 1 % of the energy put in on."""

from dataclasses import replace

import pytest

from taichi_dem import ImplicitDashpots, simulate
from taichi_dem.diagnostics.energy_balance import TERMS
from tests.scenes import brisk_scene


@pytest.fixture(scope="module")
def report():
    """Of the paper's block under a harder, faster pulse."""
    method = ImplicitDashpots(4e-7)
    return simulate(brisk_scene(), method=method, until=2.5e-4, progress=None).report


def test_a_run_tells_the_share_of_its_gas_work(report):
    account = report.energy_balance
    share = 100.0 * account["injected"] / account["load_work"]
    assert share > 1.0
    assert f"by overlaps of faces as they broke, {share:.3g} % of the energy put in" in str(report)


@pytest.mark.parametrize(
    "terms",
    [
        {"load_work": 200.0, "friction": 200.0},
        {"load_work": 150.0, "support_work": -50.0, "friction": 100.0},
        # Bodies that had 200 J at the start and have half of it.
        {"friction": 100.0, "kinetic": 100.0},
        {"load_work": 120.0, "kinetic": 180.0, "residual": 20.0},
    ],
)
def test_the_share_is_of_work_and_of_the_energy_at_the_start(report, terms):
    def told(injected):
        account = {**dict.fromkeys(TERMS, 0.0), "injected": injected, **terms}
        account["kinetic"] += injected
        return str(replace(report, energy_balance=account))

    assert "injected           2.01 J by overlaps" in told(2.01)
    assert "1 % of the energy put in, which no load gave" in told(2.01)
    assert "by overlaps" not in told(1.99)
    assert "by overlaps" not in told(0.0)
