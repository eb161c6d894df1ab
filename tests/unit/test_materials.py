"""Materials: Table 1 of the paper, the derived openings, and what is refused."""

import dataclasses
import math

import pytest

from taichi_dem import CONCRETE, InputError, Material

MUST_BE_POSITIVE = (
    *("density", "normal_stiffness", "shear_stiffness", "tensile_strength"),
    *("fracture_energy", "contact_stiffness"),
)
MAY_BE_ZERO = ("normal_damping", "shear_damping", "cohesion", "friction", "contact_damping")


def changed(**values):
    return dataclasses.replace(CONCRETE, **values)


def test_every_field_has_its_range_tested():
    names = {field.name for field in dataclasses.fields(Material)}
    assert names == {*MUST_BE_POSITIVE, *MAY_BE_ZERO}


def test_concrete_reaches_its_strength_at_the_onset():
    # Linear up to the onset: k_n u_E = sigma_f; the paper's figures give u_E = 14.80 um.
    assert CONCRETE.normal_stiffness * CONCRETE.onset_opening == pytest.approx(6.66e6)
    assert CONCRETE.onset_opening == pytest.approx(14.80e-6, abs=0.005e-6)


def test_area_under_the_traction_curve_is_the_fracture_energy():
    # A triangle of base u_f and height sigma_f, whatever the onset; and u_f = 29.93 um.
    area = 0.5 * CONCRETE.failure_opening * CONCRETE.tensile_strength
    assert area == pytest.approx(99.67)
    assert CONCRETE.failure_opening == pytest.approx(29.93e-6, abs=0.005e-6)


def test_softening_slope_leads_from_strength_to_zero():
    fall = CONCRETE.softening_slope * (CONCRETE.failure_opening - CONCRETE.onset_opening)
    assert fall == pytest.approx(CONCRETE.tensile_strength)
    assert CONCRETE.softening_slope == pytest.approx(440e9, rel=1e-3)


@pytest.mark.parametrize("name", [*MUST_BE_POSITIVE, *MAY_BE_ZERO])
@pytest.mark.parametrize("value", [-1.0, math.nan, math.inf, "5", None, True])
def test_value_that_is_no_sensible_number_is_refused_by_name(name, value):
    with pytest.raises(InputError) as caught:
        changed(**{name: value})
    assert str(caught.value).startswith(f"{name} must be a finite number")
    assert repr(value) in str(caught.value)


@pytest.mark.parametrize("name", MUST_BE_POSITIVE)
def test_zero_is_refused_where_the_value_must_be_positive(name):
    with pytest.raises(InputError, match=f"^{name} must be a finite number, positive"):
        changed(**{name: 0.0})


@pytest.mark.parametrize("name", MAY_BE_ZERO)
def test_zero_is_allowed_for_what_may_be_absent(name):
    assert getattr(changed(**{name: 0}), name) == 0


def test_failure_before_the_strength_is_refused_with_the_least_energy():
    # u_f > u_E means G_f > sigma_f^2 / (2 k_n) = 49.284 J/m2 for the concrete.
    least = CONCRETE.tensile_strength**2 / (2.0 * CONCRETE.normal_stiffness)
    assert changed(fracture_energy=1.001 * least).softening_slope > 0.0
    for energy in (least, 0.5 * least):
        with pytest.raises(InputError, match=r"fracture_energy must be larger .* 49\.284 J/m2"):
            changed(fracture_energy=energy)


def test_a_material_cannot_be_changed_after_its_checks():
    with pytest.raises(dataclasses.FrozenInstanceError):
        CONCRETE.density = -1.0
