"""Simple solids have their exact sizes and named sides, in rows or scattered."""

from functools import partial

import numpy as np
import pytest

from _meshes import group_area
from taichi_dem import shapes
from taichi_dem.mesh.mesh import volumes
from taichi_dem.mesh.tetrahedra import LOCAL_EDGES, all_faces, outer_faces, unit_normals

#: Name to a function that makes a solid, its volume [m3] and areas of its sides [m2].
FLAT = {
    "block": (
        partial(shapes.block, (0.1, 0.06, 0.08), element=0.02),
        0.1 * 0.06 * 0.08,
        {"left": 0.0048, "right": 0.0048, "bottom": 0.008, "top": 0.008, "front": 0.006},
    ),
    "plate": (
        partial(shapes.plate, width=0.2, height=0.1, thickness=0.02, element=0.01),
        0.02 * 0.02,
        {"left": 0.002, "bottom": 0.004, "top": 0.004, "front": 0.02},
    ),
}
FORMS = {
    **{name: make for name, (make, *_) in FLAT.items()},
    "beam": partial(shapes.beam, length=0.5, width=0.05, height=0.1, element=0.05),
    "cylinder": partial(shapes.cylinder, radius=0.05, height=0.06, element=0.02),
    "drilled": partial(
        shapes.plate, width=0.1, height=0.08, thickness=0.02, element=0.01, hole=0.03
    ),
    # Its chords are half an element long.
    "narrow hole": partial(
        shapes.plate, width=0.1, height=0.1, thickness=0.02, element=0.01, hole=(0.03, 0.05, 0.012)
    ),
}


@pytest.mark.parametrize("name", FLAT)
def test_a_solid_with_flat_sides_has_its_volume_and_areas(name):
    make, volume, areas = FLAT[name]
    mesh = make()
    assert volumes(mesh).sum() == pytest.approx(volume, rel=1e-12)
    for side, area in areas.items():
        assert group_area(mesh, side) == pytest.approx(area, rel=1e-12), side


def test_a_round_wall_is_a_polygon_on_its_circle(element=0.03):
    """n chords of a circle: area n / 2 r^2 sin(2 pi / n), circumference 2 n r sin(pi / n)."""
    mesh = shapes.plate(width=0.3, height=0.2, thickness=0.03, hole=0.06, element=element)
    count = max(8, round(np.pi * 0.06 / element))
    hole = 0.5 * count * 0.03**2 * np.sin(2.0 * np.pi / count)
    assert volumes(mesh).sum() == pytest.approx(0.03 * (0.06 - hole), rel=1e-12)
    around = 2.0 * count * 0.03 * np.sin(np.pi / count)
    assert group_area(mesh, "hole") == pytest.approx(0.03 * around, rel=1e-12)


@pytest.mark.parametrize("name", FORMS)
def test_a_scattered_solid_keeps_its_form_and_its_size_of_elements(name):
    """A seed makes the same mesh again, and another one another."""
    rows, mesh, again, other = (FORMS[name](scatter=seed) for seed in (None, 7, 7, 8))
    assert np.array_equal(mesh.points, again.points)
    assert np.array_equal(mesh.tetrahedra, again.tetrahedra)
    assert not np.array_equal(mesh.points, other.points)
    assert volumes(mesh).sum() == pytest.approx(volumes(rows).sum(), rel=1e-12)
    assert volumes(mesh).min() > 0.0 and mesh.notes == ()
    assert list(mesh.groups) == list(rows.groups)
    for side in rows.groups:
        assert group_area(mesh, side) == pytest.approx(group_area(rows, side), rel=1e-12), side
    # Every outer face is in one group; one without a partner would be in none.
    named = np.sort(np.vstack(list(mesh.groups.values())), axis=1)
    assert len(np.unique(named, axis=0)) == len(named) == len(outer_faces(mesh.tetrahedra))
    assert mesh.point_count == rows.point_count
    assert mesh.body_count == pytest.approx(rows.body_count, rel=0.1)
    assert smallest_angle(mesh) > 10.0


def smallest_angle(mesh):
    """Of all angles between two faces of a body [degrees]."""
    normal = unit_normals(mesh.points, all_faces(mesh.tetrahedra)).reshape(-1, 4, 3)
    a, b = normal[:, LOCAL_EDGES].transpose(2, 0, 1, 3)
    return 180.0 - np.degrees(np.arccos((a * b).sum(axis=-1).min()))


def test_scattered_edges_have_no_directions_of_their_own():
    """Mean of cos 6 a over the angles a of edges: 1 for rows of regular triangles."""
    options = {"width": 0.3, "height": 0.3, "thickness": 0.02, "element": 0.02}
    rows, scattered = (shapes.plate(**options, scatter=seed) for seed in (None, 1))
    assert in_rows(rows) > 0.8
    # The mean of n edges at random is about the root of 1 / 2 n; the sides keep their rows.
    assert abs(in_rows(scattered)) < 0.12


def in_rows(mesh):
    """Mean of cos 6 a over the edges of the front that are two elements away from its sides."""
    edges = mesh.groups["front"][:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    middle = np.abs(mesh.points[edges].mean(axis=1)[:, :2] - 0.15).max(axis=1)
    x, y, _ = np.diff(mesh.points[edges[middle < 0.11]], axis=1)[:, 0].T
    return float(np.cos(6.0 * np.arctan2(y, x)).mean())
