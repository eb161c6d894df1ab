"""Simple solids: exact sizes, named sides, well-shaped elements; and what is refused."""

import numpy as np
import pytest

from taichi_dem import CONCRETE, Material, mesh_stiffness, quality_report, shapes
from taichi_dem.mesh.mesh import group_area, volumes
from taichi_dem.mesh.parts import parts_of
from taichi_dem.mesh.tetrahedra import all_faces, area_vectors, edge_lengths, outer_rows
from tests.bad_input.refusals import assert_refused

GRANITE = Material.from_elastic(
    young=32e9,
    poisson=0.2,
    density=2450.0,
    tensile_strength=5e6,
    fracture_energy=100.0,
    friction_angle=40.0,
    cohesion=10e6,
)
#: Name to a solid, its volume [m3] and the areas of its sides [m2]; walls round and slots apart.
SOLIDS = {
    "block": (
        shapes.block((0.1, 0.06, 0.08), element=0.02),
        0.1 * 0.06 * 0.08,
        {"left": 0.0048, "right": 0.0048, "bottom": 0.008, "top": 0.008, "front": 0.006},
    ),
    "cube": (shapes.block(0.1, element=0.03), 1e-3, {"back": 0.01, "top": 0.01}),
    "beam": (
        shapes.beam(length=1.0, width=0.1, height=0.05, element=0.05),
        5e-3,
        {"left": 0.005, "right": 0.005, "top": 0.1, "back": 0.05},
    ),
    "notched": (
        shapes.plate(width=0.2, height=0.1, thickness=0.02, notch=(0.05, 0.04, 0.01), element=0.01),
        (0.02 - 4e-4) * 0.02,
        {"notch": 0.09 * 0.02, "bottom": 0.19 * 0.02, "top": 0.2 * 0.02, "front": 0.0196},
    ),
}


def dihedral_angles(mesh):
    """Angles between the faces of every body [degrees]."""
    normal = area_vectors(mesh.points, all_faces(mesh.tetrahedra))
    normal = (normal / np.linalg.norm(normal, axis=1)[:, None]).reshape(-1, 4, 3)
    pairs = [(i, j) for i in range(4) for j in range(i)]
    cosines = np.stack([-(normal[:, i] * normal[:, j]).sum(axis=1) for i, j in pairs])
    return np.degrees(np.arccos(np.clip(cosines, -1.0, 1.0)))


def drilled(element, diameter=0.06):
    return shapes.plate(width=0.3, height=0.2, thickness=0.03, hole=diameter, element=element)


@pytest.mark.parametrize("name", SOLIDS)
def test_a_solid_with_flat_sides_has_its_volume_and_areas(name):
    mesh, volume, areas = SOLIDS[name]
    assert volumes(mesh).sum() == pytest.approx(volume, rel=1e-12)
    for side, area in areas.items():
        assert group_area(mesh, side) == pytest.approx(area, rel=1e-12), side


@pytest.mark.parametrize("element", [0.03, 0.015])
def test_round_walls_are_polygons_on_their_circle(element):
    """n chords of a circle: area n / 2 r^2 sin(2 pi / n), circumference 2 n r sin(pi / n)."""
    mesh, count = drilled(element), max(8, round(np.pi * 0.06 / element))
    hole = 0.5 * count * 0.03**2 * np.sin(2.0 * np.pi / count)
    assert volumes(mesh).sum() == pytest.approx(0.03 * (0.06 - hole), rel=1e-12)
    around = 2.0 * count * 0.03 * np.sin(np.pi / count)
    assert group_area(mesh, "hole") == pytest.approx(0.03 * around, rel=1e-12)
    round_bar = shapes.cylinder(radius=0.1, height=0.2, element=2 * element)
    count = max(8, round(np.pi * 0.1 / element))
    disc = 0.5 * count * 0.1**2 * np.sin(2.0 * np.pi / count)
    assert volumes(round_bar).sum() == pytest.approx(0.2 * disc, rel=1e-12)
    for name, height in (("bottom", 0.0), ("top", 0.2)):
        assert group_area(round_bar, name) == pytest.approx(disc, rel=1e-12)
        assert np.abs(round_bar.points[round_bar.groups[name], 1] - height).max() < 1e-15


@pytest.mark.parametrize("element", [0.05, 0.037, 0.03, 0.02])
def test_elements_are_well_shaped_whatever_their_size(element):
    """Measured 0.02 to 0.05 m: angles 24 to 141 degrees, aspect below 3.5 (1.2 when regular)."""
    for mesh in (
        shapes.block((0.3, 0.2, 0.1), element=element),
        shapes.cylinder(radius=0.1, height=0.2, element=element),
        shapes.plate(
            width=0.5,
            height=0.3,
            thickness=0.05,
            hole=(0.35, 0.15, 0.08),
            notch=(0.12, 0.1, 0.05),
            element=element,
        ),
    ):
        angles = dihedral_angles(mesh)
        assert 20.0 < angles.min() and angles.max() < 145.0
        assert quality_report(mesh, CONCRETE).aspect_ratio.max() < 4.0
        lengths = edge_lengths(mesh.points, mesh.tetrahedra)
        assert lengths.max() < 2.0 * element and 0.75 * element < np.median(lengths)
        assert parts_of(mesh).max() == 0


def test_every_outer_face_is_in_one_group():
    for mesh in (*(solid for solid, _, _ in SOLIDS.values()), drilled(0.02)):
        faces = all_faces(mesh.tetrahedra)
        named = np.vstack(list(mesh.groups.values()))
        assert len(np.unique(np.sort(named, axis=1), axis=0)) == len(named)
        assert len(named) == len(outer_rows(faces))


def test_the_same_call_gives_the_same_mesh():
    first, second = (drilled(0.02) for _ in range(2))
    assert first.points.tobytes() == second.points.tobytes()
    assert first.tetrahedra.tobytes() == second.tetrahedra.tobytes()


def test_the_modulus_along_a_beam_does_not_depend_on_its_elements():
    """Measured 34.6 GPa at 0.05 and at 0.025 m, of 32 asked: rows of triangles are stiffer."""
    shown = []
    for element in (0.05, 0.033):
        beam = shapes.beam(length=0.5, width=0.1, height=0.1, element=element)
        shown.append(mesh_stiffness(beam, GRANITE))
    along = [one.young_along[0] for one in shown]
    assert along[0] == pytest.approx(along[1], rel=0.06)
    for one in shown:
        assert one.young == pytest.approx(32e9, rel=0.05)
        assert one.young_along[0] == pytest.approx(32e9, rel=0.15)


PLATE = {"width": 0.2, "height": 0.1, "thickness": 0.02, "element": 0.01}
REFUSED = {
    "size": (lambda: shapes.block((1, 2), element=0.1), "size must be three", "(1, 2)"),
    "negative": (lambda: shapes.block((1, -2, 1), element=0.1), "size must be a positive", "-2"),
    "element": (lambda: shapes.block(1.0, element=2.0), "element must be at most", "got 2"),
    "too fine": (lambda: shapes.block(1.0, element=1e-4), "element must be at least", "0.0001"),
    "word": (lambda: shapes.block(1.0, element="s"), "element must be a positive", "'s'"),
    "radius": (lambda: shapes.cylinder(radius=0, height=1, element=1), "radius must be", "got 0"),
    "hole": (lambda: shapes.plate(**PLATE, hole=0.09), "hole must be (x, y, diameter)", "0.09"),
    "hole at": (lambda: shapes.plate(**PLATE, hole=(0, 0, 0.02)), "hole must be", "(0, 0, 0.02)"),
    "small hole": (lambda: shapes.plate(**PLATE, hole=0.005), "hole must be", "0.005"),
    "no hole": (lambda: shapes.plate(**PLATE, hole="round"), "hole must be three", "'round'"),
    "notch": (lambda: shapes.plate(**PLATE, notch=(0.1, 0.2, 0.01)), "notch must be", "0.2"),
    "narrow": (lambda: shapes.plate(**PLATE, notch=(0.1, 0.05, 0.001)), "notch must be", "0.001"),
    "both": (
        lambda: shapes.plate(**PLATE, hole=0.03, notch=(0.1, 0.035, 0.01)),
        "notch must stay an element, 0.01 m, away from the hole",
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_a_shape_that_cannot_be_is_refused(case):
    call, *words = REFUSED[case]
    assert_refused(call, *words)
