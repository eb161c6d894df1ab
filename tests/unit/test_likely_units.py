"""A number that only another unit explains is warned about; the same in its unit never is."""

import warnings

import pytest

from ca_damper import Spheres
from taichi_dem import effects, shapes
from taichi_dem.kit.likely_units import UnitWarning

#: Builder, a value in the wrong unit, how many of the unit it is read in are one of the likely one.
CASES = {
    "peak": (lambda x: effects.GasPressure(peak=x), 575.0, 1e6),
    "rise": (lambda x: effects.GasPressure(rise=x), 0.133, 1e-3),
    "element": (lambda x: shapes.block(4.0 * x, element=x), 100.0, 1e-3),
    "particle_mass": (lambda x: Spheres(particle_mass=x), 0.2, 1e-3),
}


@pytest.mark.parametrize("name", CASES)
def test_a_number_in_the_likely_unit_is_warned_about_and_in_its_own_is_not(name):
    build, value, factor = CASES[name]
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        try:
            build(value)
        except ValueError:
            pass  # a wrong unit may lie out of the range of another option too
    assert any(one.category is UnitWarning and name in str(one.message) for one in told)
    build(value * factor)
