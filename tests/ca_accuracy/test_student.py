"""Quantiles against the tables of textbooks, and the incomplete beta where it is elementary."""

import math

import pytest

from taichi_dem.kit.accuracy.student import beta_share, f_outside, t_outside, t_quantile


@pytest.mark.parametrize(
    ("confidence", "freedom", "wanted"),
    [
        *((0.95, 1, 12.706), (0.95, 2, 4.303), (0.95, 7, 2.365), (0.95, 30, 2.042)),
        *((0.99, 1, 63.657), (0.99, 10, 3.169), (0.5, 5, 0.727), (0.95, math.inf, 1.960)),
    ],
)
def test_quantiles_of_student(confidence, freedom, wanted):
    assert t_quantile(confidence, freedom) == pytest.approx(wanted, abs=6e-4)
    assert t_outside(t_quantile(confidence, freedom), freedom) == pytest.approx(1.0 - confidence)


@pytest.mark.parametrize(
    ("ratio", "above", "below"), [(4.256, 2, 9), (3.708, 3, 10), (161.45, 1, 1), (2.866, 4, 20)]
)
def test_five_percent_points_of_fisher(ratio, above, below):
    assert f_outside(ratio, above, below) == pytest.approx(0.05, rel=1e-3)


def test_ends_of_the_distributions():
    assert f_outside(0.0, 3, 10) == 1.0 and f_outside(math.inf, 3, 10) == 0.0
    assert t_outside(0.0, 3) == 1.0


@pytest.mark.parametrize("x", [0.0, 1e-6, 0.3, 0.7, 1.0 - 1e-9, 1.0])
def test_beta_of_whole_numbers(x):
    assert beta_share(x, 1.0, 3.0) == pytest.approx(1.0 - (1.0 - x) ** 3, rel=1e-12, abs=1e-15)
    assert beta_share(x, 2.0, 2.0) == pytest.approx(3 * x**2 - 2 * x**3, rel=1e-12, abs=1e-15)
