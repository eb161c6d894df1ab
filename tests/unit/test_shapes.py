"""Simple solids have their exact sizes and named sides."""

import numpy as np
import pytest

from _meshes import group_area
from taichi_dem import shapes
from taichi_dem.mesh.mesh import volumes
from taichi_dem.mesh.tetrahedra import all_faces, outer_rows

#: Name to a solid, its volume [m3] and the areas of its sides [m2]; round walls apart.
SOLIDS = {
    "block": (
        shapes.block((0.1, 0.06, 0.08), element=0.02),
        0.1 * 0.06 * 0.08,
        {"left": 0.0048, "right": 0.0048, "bottom": 0.008, "top": 0.008, "front": 0.006},
    ),
    "plate": (
        shapes.plate(width=0.2, height=0.1, thickness=0.02, element=0.01),
        0.02 * 0.02,
        {"left": 0.002, "bottom": 0.004, "top": 0.004, "front": 0.02},
    ),
}


def drilled(element):
    return shapes.plate(width=0.3, height=0.2, thickness=0.03, hole=0.06, element=element)


@pytest.mark.parametrize("name", SOLIDS)
def test_a_solid_with_flat_sides_has_its_volume_and_areas(name):
    mesh, volume, areas = SOLIDS[name]
    assert volumes(mesh).sum() == pytest.approx(volume, rel=1e-12)
    for side, area in areas.items():
        assert group_area(mesh, side) == pytest.approx(area, rel=1e-12), side


def test_a_round_wall_is_a_polygon_on_its_circle(element=0.03):
    """n chords of a circle: area n / 2 r^2 sin(2 pi / n), circumference 2 n r sin(pi / n)."""
    mesh, count = drilled(element), max(8, round(np.pi * 0.06 / element))
    hole = 0.5 * count * 0.03**2 * np.sin(2.0 * np.pi / count)
    assert volumes(mesh).sum() == pytest.approx(0.03 * (0.06 - hole), rel=1e-12)
    around = 2.0 * count * 0.03 * np.sin(np.pi / count)
    assert group_area(mesh, "hole") == pytest.approx(0.03 * around, rel=1e-12)


def test_every_outer_face_is_in_one_group():
    for mesh in (*(solid for solid, _, _ in SOLIDS.values()), drilled(0.02)):
        faces = all_faces(mesh.tetrahedra)
        named = np.vstack(list(mesh.groups.values()))
        assert len(np.unique(np.sort(named, axis=1), axis=0)) == len(named)
        assert len(named) == len(outer_rows(faces))
