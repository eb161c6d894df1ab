"""Calibration meets the moduli and strengths that were asked for."""

import pytest

from calibrate_material import calibrate
from taichi_dem import Material, mesh_stiffness
from tests.material.blocks import random_block

ROCK = {
    **{"young": 32e9, "poisson": 0.2, "density": 2450.0, "tensile_strength": 3e6},
    **{"fracture_energy": 100.0, "friction_angle": 30.0, "cohesion": 6e6},
}


def test_moduli_are_met_and_all_else_stays():
    mesh = random_block(3, seed=1)
    targets = {"young": 20e9, "poisson": 0.3}
    constants, _, found = calibrate(mesh, ROCK, targets, 0.01, test=None)
    assert found == pytest.approx(targets, rel=0.01)
    shown = mesh_stiffness(mesh, Material.from_elastic(**constants))
    assert (shown.young, shown.poisson) == pytest.approx((20e9, 0.3), rel=0.01, abs=0.01)
    assert {name: constants[name] for name in ROCK if name not in targets} == {
        name: value for name, value in ROCK.items() if name not in targets
    }


def made_up(name, constants, target):
    """Strengths of a made-up specimen that are not in proportion to the constants."""
    if name == "tension":
        return 1.2 * constants["tensile_strength"] ** 0.9
    if name == "brazilian":
        return float("nan")
    return 5.0 * constants["cohesion"] + constants["tensile_strength"]


def test_strengths_are_met_by_constants_of_their_own():
    """Here tension is 1.2 s^0.9, and compression nearly a power of the cohesion.

    A disc is then only compared, and has not failed.
    """
    targets = {"tension": 1.5e6, "brazilian": 3e6, "compression": 60e6}
    constants, (rounds,), found = calibrate(random_block(2, 0), ROCK, targets, 0.01, made_up)
    assert found == pytest.approx({**targets, "brazilian": float("nan")}, rel=0.01, nan_ok=True)
    assert len(rounds) <= 4
    assert made_up("tension", constants, None) == pytest.approx(1.5e6, rel=0.01)
