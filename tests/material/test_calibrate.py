"""Calibration meets the moduli and strengths that were asked for, or says that it does not."""

import pytest

from taichi_dem import Targets, calibrate, mesh_stiffness
from taichi_dem.calibration.calibrate import _strengths
from tests.material.blocks import random_block, rock


def test_moduli_are_met_and_all_else_stays():
    mesh, material = random_block(3, seed=1), rock()
    found = calibrate(mesh, material, Targets(young=20e9, poisson=0.3), tolerance=0.01)
    assert found.met and found.runs == 0
    shown = mesh_stiffness(mesh, found.material)
    assert (shown.young, shown.poisson) == pytest.approx((20e9, 0.3), rel=0.01, abs=0.01)
    for name in ("density", "tensile_strength", "cohesion", "friction", "fracture_energy"):
        assert getattr(found.material, name) == getattr(material, name)


def test_a_poissons_ratio_that_the_mesh_cannot_show_is_said_with_its_reach():
    """Boxes cut in six show 0.02 more than asked at the low end: at -0.2 they stop short."""
    found = calibrate(random_block(2, seed=0), rock(), Targets(poisson=-0.2), tolerance=1e-3)
    assert not found.met
    assert found.warnings[0].startswith("poisson must be at least -0.1")


def made_up(name, material, target):
    """Strengths of a made-up specimen that are not in proportion to the constants."""
    if name == "tension":
        return 1.2 * material.tensile_strength**0.9
    return 5.0 * material.cohesion + material.tensile_strength


def test_strengths_are_met_by_constants_of_their_own():
    """A power law is met in three rounds, one in proportion and one by the power then known.

    Here tension is 1.2 s^0.9, and compression nearly a power of the cohesion.
    """
    targets = Targets(tension=1.5e6, compression=60e6)
    material, matches, runs = _strengths(rock(), made_up, targets, 0.01)
    assert all(match.is_met(0.01) for match in matches) and runs <= 8
    assert made_up("tension", material, None) == pytest.approx(1.5e6, rel=0.01)
