"""A number that only another unit explains is warned about once, in words; a usual one never is."""

import warnings
from dataclasses import replace

import numpy as np
import pytest

from ca_damper import Automaton, Spheres
from taichi_dem import CONCRETE, Material, Targets, effects, read_mesh, shapes
from taichi_dem.kit import likely_units
from taichi_dem.kit.likely_units import Quantity, UnitWarning
from taichi_dem.mesh.files import write_mesh
from tests.bad_input.options import ROCK

#: How many of the unit on the left are one of the unit on the right.
FACTOR = {
    **{("kg/m^3", "g/cm^3"): 1e3, ("Pa", "GPa"): 1e9, ("Pa", "MPa"): 1e6},
    **{("degrees", "radians"): 180.0 / np.pi, ("s", "ms"): 1e-3, ("s", "us"): 1e-6},
    **{("m", "mm"): 1e-3, ("m/s^2", "mm/s^2"): 1e-3, ("kg", "g"): 1e-3},
}
QUANTITIES = {name: one for name, one in vars(likely_units).items() if isinstance(one, Quantity)}


def rock(**options):
    """A material from what is measured."""
    return Material.from_elastic(**{**ROCK, **options})


def block(element):
    """A block of four elements along each edge."""
    return shapes.block(4.0 * element, element=element)


#: Builder, name, a value in the wrong unit, the unit it is read in, and the likely one.
CASES = [
    (lambda x: effects.GasPressure(peak=x), "peak", 575.0, "Pa", "MPa"),
    (lambda x: effects.GasPressure(rise=x), "rise", 0.133, "s", "ms"),
    (lambda x: effects.GasPressure(rise=x), "rise", 133.0, "s", "us"),
    (lambda x: effects.Pressure("left", x), "values", 10.0, "Pa", "MPa"),
    (lambda x: effects.Pressure.triangle("left", x, 1e-5, 1e-5), "values", -30.0, "Pa", "MPa"),
    (lambda x: effects.Gravity((0.0, x, 0.0)), "acceleration", -9810.0, "m/s^2", "mm/s^2"),
    (lambda x: rock(young=x), "young", 30.0, "Pa", "GPa"),
    (lambda x: rock(friction_angle=x), "friction_angle", 0.6, "degrees", "radians"),
    (lambda x: rock(density=x), "density", 2.35, "kg/m^3", "g/cm^3"),
    (lambda x: rock(cohesion=x), "cohesion", 10.0, "Pa", "MPa"),
    (lambda x: replace(CONCRETE, tensile_strength=x), "tensile_strength", 6.66, "Pa", "MPa"),
    (lambda x: Targets(young=x), "young", 30.0, "Pa", "GPa"),
    (lambda x: Targets(tension=x), "tension", 3.0, "Pa", "MPa"),
    (block, "element", 100.0, "m", "mm"),
    (lambda x: Spheres(young=x), "young", 0.5, "Pa", "GPa"),
    (lambda x: Spheres(particle_mass=x), "particle_mass", 0.2, "kg", "g"),
    (lambda x: Spheres(diameter=x, width=10 * x, height=10 * x), "diameter", 6.0, "m", "mm"),
    (lambda x: Spheres(width=x), "width", 60.0, "m", "mm"),
    (lambda x: Automaton(width=x), "width", 6.0, "m", "mm"),
    (lambda x: Automaton(particle_mass=x), "particle_mass", 0.1, "kg", "g"),
]
IDS = [f"{name} {value}" for _, name, value, _, _ in CASES]


@pytest.mark.parametrize(("build", "name", "value", "unit", "likely"), CASES, ids=IDS)
def test_a_number_in_the_likely_unit_is_warned_about(build, name, value, unit, likely):
    """The sentence has name, value, unit and likely unit, and points at the user's line."""
    with pytest.warns(UnitWarning) as told:
        try:
            build(value)
        except ValueError:
            pass  # a wrong unit may lie out of the range of another option too
    (first, *_) = [one for one in told if name in str(one.message)]
    assert first.filename == __file__
    size = abs(value) if name == "acceleration" else value
    assert f"is read in {unit}, got {size:g}: likely {likely} is meant" in str(first.message)


@pytest.mark.parametrize(("build", "name", "value", "unit", "likely"), CASES, ids=IDS)
def test_the_same_number_in_its_unit_is_not(build, name, value, unit, likely):
    build(value * FACTOR[unit, likely])


def test_zero_rubber_and_a_unit_load_are_not():
    rock(friction_angle=0.0, cohesion=0.0, young=1e6, tensile_strength=2e6, fracture_energy=1e7)
    effects.Pressure("left", 1.0)
    effects.GasPressure(peak=1.0, rise=1.0)
    effects.Gravity((0.0, 0.0, 0.0))


@pytest.mark.parametrize("name", QUANTITIES)
def test_no_number_is_usual_in_both_units(name):
    """What a likely unit explains would not be explained by it again, once it is converted."""
    unit, others = QUANTITIES[name]
    for least, most, likely in others:
        low, high = sorted(end * FACTOR[unit, likely] for end in (least, most))
        assert not any(low < top and bottom < high for bottom, top, _ in others)


def test_a_mesh_in_millimetres_is_told(tmp_path):
    mesh = shapes.block(4.0, element=1.0)
    write_mesh(tmp_path / "mesh.msh", mesh)
    with pytest.warns(UnitWarning, match=r"mesh\.msh at scale=100 is read in m, got 1\d\d"):
        read_mesh(tmp_path / "mesh.msh", scale=100.0)
    read_mesh(tmp_path / "mesh.msh", scale=0.1)


def test_a_line_warns_once():
    """Also where it is run again, as in a sweep."""
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("default")
        for _ in range(3):
            rock(young=30.0)
    assert len(told) == 1
