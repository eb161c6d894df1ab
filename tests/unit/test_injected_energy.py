"""A run tells energy that no load gave: from 1 % injected by overlaps, from half unexplained."""

import math

import pytest

from taichi_dem.report.energy_balance import (
    TERMS,
    injected_words,
    open_account,
    unexplained_share,
)


@pytest.mark.parametrize(
    "terms",
    [
        {"load_work": 150.0, "support_work": -50.0, "friction": 100.0},
        # Bodies that had 200 J at the start and have half of it.
        {"friction": 100.0, "kinetic": 100.0},
        {"load_work": 120.0, "kinetic": 180.0, "residual": 20.0},
    ],
)
def test_the_share_is_of_work_and_of_the_energy_at_the_start(terms):
    def told(injected):
        account = {**dict.fromkeys(TERMS, 0.0), "injected": injected, **terms}
        return injected_words({**account, "kinetic": account["kinetic"] + injected})

    assert "2.01 J by overlaps" in told(2.01)
    assert told(1.99) == told(0.0) == ""


def test_an_open_account_is_said():
    account = {"kinetic": 1.0, "bond_dashpot": -3.0, "residual": 2.1}
    assert unexplained_share(account) == pytest.approx(2.1 / 4.0)
    assert "2.1 J unexplained" in open_account(account, 0.0)[0]
    assert open_account({**account, "residual": 1.9}, 0.0) == ()
    assert open_account({"kinetic": 1e-20, "residual": 1e-19}, 1e-20) == ()
    assert open_account({**account, "residual": math.nan}, 0.0)
