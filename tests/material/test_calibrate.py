"""Calibration: moduli by statics, strengths by specimens, and misfits said plainly."""

import numpy as np
import pytest

from taichi_dem import CONCRETE, InputError, Targets, calibrate, mesh_stiffness
from taichi_dem.calibration.calibrate import _strengths
from taichi_dem.calibration.specimens import ARC, disc, prism
from taichi_dem.mesh.mesh import group_area, volumes
from taichi_dem.stability.elastic_report import element_sizes
from tests.material.blocks import random_block, rock


def test_moduli_are_met_and_all_else_stays():
    mesh, material = random_block(3, seed=1), rock()
    found = calibrate(mesh, material, Targets(young=20e9, poisson=0.3), tolerance=0.01)
    assert found.met
    assert found.runs == 0
    shown = mesh_stiffness(mesh, found.material)
    assert (shown.young, shown.poisson) == pytest.approx((20e9, 0.3), rel=0.01, abs=0.01)
    assert [match.found for match in found.matches] == pytest.approx([shown.young, shown.poisson])
    for name in ("density", "tensile_strength", "cohesion", "friction", "fracture_energy"):
        assert getattr(found.material, name) == getattr(material, name)
    ratios = {rule.ratio for rule in (found.material.normal_damping, material.normal_damping)}
    assert len(ratios) == 1
    assert found.material.contact_stiffness.modulus == found.material.normal_stiffness.modulus


def test_one_modulus_alone_leaves_the_ratio_of_the_other():
    """E is in proportion to both moduli, so one step of the fixed point is exact."""
    mesh, material = random_block(2, seed=1), rock()
    found = calibrate(mesh, material, Targets(young=10e9)).material
    before = material.shear_stiffness.modulus / material.normal_stiffness.modulus
    after = found.shear_stiffness.modulus / found.normal_stiffness.modulus
    assert after == pytest.approx(before, rel=1e-9)
    assert mesh_stiffness(mesh, found).young == pytest.approx(10e9, rel=1e-9)


def test_a_poissons_ratio_that_the_mesh_cannot_show_is_said_with_its_reach():
    """Boxes cut in six show 0.02 more than asked at the low end: at -0.2 they stop short."""
    mesh = random_block(2, seed=0)
    found = calibrate(mesh, rock(), Targets(poisson=-0.2), tolerance=1e-3)
    assert not found.met
    assert found.warnings[0].startswith("poisson must be at least -0.1")
    assert "got -0.2" in found.warnings[0]
    assert "is not met" in found.warnings[1]
    assert "warning: poisson must be" in str(found)


def made_up(name, material, target):
    """Strengths of a made-up specimen that are not in proportion to the constants."""
    of = {
        "tension": 1.2 * material.tensile_strength**0.9,
        "brazilian": 0.7 * material.tensile_strength,
        "compression": 5.0 * material.cohesion + material.tensile_strength,
    }
    return of[name]


def test_strengths_are_met_by_constants_of_their_own():
    """A power law is met in three rounds, one in proportion and one by the power then known.

    Here tension is 1.2 s^0.9, and compression nearly a power of the cohesion.
    """
    targets = Targets(tension=1.5e6, compression=60e6)
    material, matches, runs = _strengths(rock(), made_up, targets, 0.01)
    assert all(match.is_met(0.01) for match in matches)
    assert runs <= 8
    assert made_up("tension", material, None) == pytest.approx(1.5e6, rel=0.01)


def test_of_tension_and_brazilian_one_is_met_and_the_other_compared():
    targets = Targets(tension=1.5e6, brazilian=9e6)
    material, matches, _ = _strengths(rock(), made_up, targets, 0.01)
    by_name = {match.name: match for match in matches}
    assert by_name["tension"].is_met(0.01)
    assert by_name["brazilian"].found == pytest.approx(0.7 * material.tensile_strength)
    assert not by_name["brazilian"].is_met(0.5)
    alone = _strengths(rock(), made_up, Targets(brazilian=2e6), 0.01)[1]
    assert alone[0].is_met(0.01)


def test_a_specimen_that_does_not_fail_is_no_match():
    _, matches, runs = _strengths(rock(), lambda *_: np.nan, Targets(tension=1e6), 0.01)
    assert runs == 1
    assert not matches[0].is_met(0.5)


def test_specimens_have_elements_of_the_size_asked_for_and_two_loaded_groups():
    """Boxes of edge / 2^(1/6) cut in six; points shifted by a fifth change single volumes."""
    for make, name in ((prism, ("left", "right")), (disc, ("bottom", "top"))):
        mesh = make(0.01, 3)
        mean = np.cbrt(6.0 * np.sqrt(2.0) * volumes(mesh).mean())
        assert mean == pytest.approx(0.01, rel=0.02)
        assert np.median(element_sizes(mesh)) == pytest.approx(0.01, rel=0.05)
        areas = [group_area(mesh, each) for each in name]
        assert min(areas) > 0.5 * max(areas)
    # Arcs of 20 degrees: in a disc of stairs, faces of the rim within them, up to twice the chord.
    radius, depth = (0.5 * np.ptp(mesh.points[:, 0]), np.ptp(mesh.points[:, 2]))
    chord = 2.0 * radius * np.sin(np.radians(ARC)) * depth
    assert 0.7 * chord < areas[0] < 2.0 * chord


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"targets": None}, "targets must be a Targets"),
        ({"material": CONCRETE}, "material must have moduli over the distance of bodies"),
        ({"mesh": 3}, "mesh must be a Mesh"),
        ({"tolerance": 0.0}, "tolerance must be a number from 0.0001 to 0.5"),
        ({"targets": Targets(compression=1e8)}, "slip_energy must be a number where compression"),
        ({"slip_energy": -1.0}, "slip_energy must be a positive"),
        ({"seed": 1.5}, "seed must be a whole number"),
    ],
)
def test_wrong_questions_are_refused_before_any_run(change, words):
    usual = {"mesh": random_block(2, seed=0), "material": rock(), "targets": Targets(young=1e9)}
    with pytest.raises(InputError, match=f"^{words}"):
        calibrate(**{**usual, **change})


@pytest.mark.parametrize("value", [0.0, -1.0, np.nan, "1"])
def test_targets_out_of_range_are_refused(value):
    for name in ("young", "tension", "brazilian", "compression"):
        with pytest.raises(InputError, match=f"^{name} must be"):
            Targets(**{name: value})
    with pytest.raises(InputError, match=r"^targets must hold one value"):
        Targets()
