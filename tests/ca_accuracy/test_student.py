"""Quantiles of Student and Fisher are those of the tables in textbooks."""

import math

import pytest

from taichi_dem.kit.bars.chance import f_outside, t_outside, t_quantile


@pytest.mark.parametrize(
    ("confidence", "freedom", "wanted"),
    [(0.95, 1, 12.706), (0.95, 7, 2.365), (0.99, 10, 3.169), (0.95, math.inf, 1.960)],
)
def test_quantiles_of_student(confidence, freedom, wanted):
    assert t_quantile(confidence, freedom) == pytest.approx(wanted, abs=6e-4)
    assert t_outside(t_quantile(confidence, freedom), freedom) == pytest.approx(1.0 - confidence)


@pytest.mark.parametrize(("ratio", "above", "below"), [(4.256, 2, 9), (161.45, 1, 1)])
def test_five_percent_points_of_fisher(ratio, above, below):
    assert f_outside(ratio, above, below) == pytest.approx(0.05, rel=1e-3)
