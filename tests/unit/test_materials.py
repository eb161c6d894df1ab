"""Concrete of the paper's Table 1 has the openings of the paper, and softens to its energy."""

import dataclasses

import pytest

from taichi_dem import CONCRETE, InputError


def test_concrete_reaches_its_strength_at_the_onset():
    # Linear up to the onset: k_n u_E = sigma_f; the paper's figures give u_E = 14.80 um.
    assert CONCRETE.normal_stiffness * CONCRETE.onset_opening == pytest.approx(6.66e6)
    assert CONCRETE.onset_opening == pytest.approx(14.80e-6, abs=0.005e-6)


def test_area_under_the_traction_curve_is_the_fracture_energy():
    # A triangle of base u_f and height sigma_f, whatever the onset; and u_f = 29.93 um.
    area = 0.5 * CONCRETE.failure_opening * CONCRETE.tensile_strength
    assert area == pytest.approx(99.67)
    assert CONCRETE.failure_opening == pytest.approx(29.93e-6, abs=0.005e-6)
    fall = CONCRETE.softening_slope * (CONCRETE.failure_opening - CONCRETE.onset_opening)
    assert fall == pytest.approx(CONCRETE.tensile_strength)


def test_failure_before_the_strength_is_refused_with_the_least_energy():
    # u_f > u_E means G_f > sigma_f^2 / (2 k_n) = 49.284 J/m2 for the concrete.
    least = CONCRETE.tensile_strength**2 / (2.0 * CONCRETE.normal_stiffness)
    assert dataclasses.replace(CONCRETE, fracture_energy=1.001 * least).softening_slope > 0.0
    with pytest.raises(InputError, match=r"fracture_energy must be larger .* 49\.284 J/m2"):
        dataclasses.replace(CONCRETE, fracture_energy=least)
