"""A mesh is mended or refused, never silently wrong; shapes, turned and joined ones are right.

Bonds, outer faces and mass properties of bodies are those of the mesh, whatever its order.
Contact spheres against their definition, face by face (Konno et al., 2.2, Fig. 5).
"""

from functools import partial

import numpy as np
import pytest

from cases.meshes import group_area
from taichi_dem import PAPER_BLOCK, InputError, join, read_mesh, shapes
from taichi_dem.mesh.mesh import checked_mesh, volumes
from taichi_dem.mesh.shapes import bar
from taichi_dem.mesh.tetrahedra import (
    LOCAL_EDGES,
    all_faces,
    outer_faces,
    unit_normals,
)
from taichi_dem.mesh.topology import (
    body_properties,
    edge_colours,
    spheres_of_faces,
    topology_of,
)
from tests.scenes import matrix, quaternion

# Two tetrahedra on both sides of the triangle 0 1 2, apexes 3 (z > 0) and 4 (z < 0).
POINTS = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0.2, 0.2, 1], [0.2, 0.2, -1]]
BODIES = [[0, 1, 2, 3], [0, 2, 1, 4]]
BAR = bar(0.2, 0.1, (2, 1, 1))
EPS = np.finfo(float).eps


def built(points=POINTS, bodies=BODIES, groups=None, **options):
    return checked_mesh(points, bodies, groups or {}, **options)


def refused(*arguments, **options):
    """The sentence with which the mesh is refused."""
    with pytest.raises(InputError) as caught:
        built(*arguments, **options)
    return str(caught.value)


def test_negative_volumes_are_turned_and_said():
    mesh = built(bodies=[[0, 1, 2, 3], [0, 1, 2, 4]])
    # One sixth of base 1 x 1 times height 1, both.
    assert volumes(mesh) == pytest.approx([1 / 6, 1 / 6])
    assert mesh.notes == ("turned 1 tetrahedra of negative volume",)


@pytest.mark.parametrize("scale", [1e-3, 1e3])
def test_flat_is_measured_against_the_longest_edge(scale):
    # V = height / 6 and the longest edge is sqrt 2: flat below height = 6 * 2^1.5 * 1e-12.
    limit = 6.0 * 2.0**1.5 * 1e-12
    flat, full = (scale * np.array([*POINTS[:3], [0.2, 0.2, x * limit]]) for x in (0.5, 2.0))
    assert "1 tetrahedra have no volume, the first is number 0" in refused(flat, BODIES[:1])
    assert built(full, BODIES[:1]).body_count == 1


def test_bodies_that_lie_in_each_other_are_refused():
    words = refused([*POINTS[:4], [0.3, 0.3, 2.0]], [[0, 1, 2, 3], [0, 1, 2, 4]])
    assert "tetrahedra 0 and 1 lie on the same side" in words


def doubled(gap=0.0):
    """The two bodies without a common point; the second's copies lie ``gap`` away."""
    points = np.vstack([POINTS, np.subtract(POINTS[:3], [0.0, 0.0, gap])])
    return points, [[0, 1, 2, 3], [5, 7, 6, 4]]


@pytest.mark.parametrize("gap", [0.0, 1.9e-9])  # m; below 1e-9 of the extent
def test_coincident_points_are_refused_with_the_way_out(gap):
    words = refused(*doubled(gap))
    assert words.startswith("3 points coincide with another, the first at (0, 0, 0) m")
    # The tolerance it names does join them.
    tolerance = float(words.split("weld_tolerance=")[1].split()[0])
    assert topology_of(built(*doubled(gap), weld_tolerance=tolerance)).bond_count == 1


@pytest.mark.parametrize(("tolerance", "points"), [(1.1e-5, 5), (0.9e-5, 8)])
def test_points_are_welded_within_the_tolerance_only(tolerance, points):
    assert built(*doubled(1e-5), weld_tolerance=tolerance).point_count == points


def test_loose_points_are_dropped_and_groups_keep_their_faces():
    points = [[9.0, 9.0, 9.0], *POINTS, [8.0, 8.0, 8.0]]
    mesh = built(points, np.array(BODIES) + 1, {"top": [[2, 3, 4]]})
    assert np.array_equal(mesh.points, POINTS) and np.array_equal(mesh.tetrahedra, BODIES)
    assert sorted(mesh.group_faces("top")[0]) == [1, 2, 3]


def test_a_moved_mesh_turns_about_its_middle_and_keeps_its_groups():
    named = BAR.body_group("half", lambda x: x[:, 0] < 0.1)
    turned = named.moved(turned=(30.0, -40.0, 70.0), by=(1.0, 2.0, 3.0))
    angle = np.radians(np.sqrt(30.0**2 + 40.0**2 + 70.0**2))
    turn = matrix(quaternion([30.0, -40.0, 70.0], angle))
    middle = np.array([0.1, 0.05, 0.05])
    expected = middle + (BAR.points - middle) @ turn.T + [1.0, 2.0, 3.0]
    np.testing.assert_allclose(turned.points, expected, atol=2e-15)
    assert turned.body_groups["half"].tolist() == named.body_groups["half"].tolist()
    assert all((turned.groups[name] == BAR.groups[name]).all() for name in BAR.groups)


def test_meshes_that_touch_are_bonded_only_where_asked():
    after = BAR.moved(by=(0.2, 0.0, 0.0))
    apart, bonded = join(BAR, after), join(BAR, after, bonded=True)
    single_bonds = topology_of(BAR).bond_count
    assert topology_of(apart).bond_count == 2 * single_bonds and apart.has_open_faces
    # The end of a bar of one box is two triangles.
    assert topology_of(bonded).bond_count == 2 * single_bonds + 2
    assert set(bonded.inner_groups) == {"first_right", "second_left"}
    assert group_area(bonded, "left") == pytest.approx(0.01)


def test_bodies_of_a_box_add_up_to_its_inertia():
    # Parallel axes: sum of (I + m (r.r 1 - r r^T)) = m/12 diag(b2+c2, a2+c2, a2+b2) of the box.
    length, width, density = 0.7, 0.3, 1500.0
    mass, centre, inertia = body_properties(bar(length, width, (2, 3, 1)), density)
    r = centre - [length / 2.0, width / 2.0, width / 2.0]
    square = np.einsum("ni,ni->n", r, r)[:, None, None] * np.eye(3)
    total = (inertia + mass[:, None, None] * (square - r[:, :, None] * r[:, None, :])).sum(axis=0)
    assert mass.sum() == pytest.approx(density * length * width**2, rel=1e-12)
    assert np.average(r, axis=0, weights=mass) == pytest.approx(np.zeros(3), abs=1e-14)
    moments = [2.0 * width**2, length**2 + width**2, length**2 + width**2]
    assert total == pytest.approx(mass.sum() / 12.0 * np.diag(moments), abs=1e-12 * mass.sum())


def outward(mesh):
    """Unit normals of the four faces of every body, (n, 4, 3)."""
    return unit_normals(mesh.points, all_faces(mesh.tetrahedra)).reshape(-1, 4, 3)


def plane_distances(mesh, points):
    """Distance of points (n, 4, k, 3) of every body from its four faces, inside positive."""
    on_face = mesh.points[all_faces(mesh.tetrahedra)[:, 0]].reshape(-1, 4, 3)
    ways = on_face[:, None, None] - points[..., None, :]
    return np.einsum("nfkgx,ngx->nfkg", ways, outward(mesh))


def test_spheres_touch_their_face_and_another_and_stay_inside():
    """Distance r from the own face, at least r from the others, r from one of them.

    Distances are differences of coordinates of 2 m; the radius divides by 1 - m_f . m_g, which in
    this mesh is above 0.01.
    """
    mesh = read_mesh(PAPER_BLOCK)
    centre = mesh.points[mesh.tetrahedra].mean(axis=1)
    spheres = spheres_of_faces(mesh, centre, 5)
    error = 16 * EPS * 2.0 / 0.01
    distance = plane_distances(mesh, spheres.centre + centre[:, None, None, :])
    own = distance[:, np.arange(4), :, np.arange(4)].transpose(1, 0, 2)
    assert np.abs(own - spheres.radius).max() < error
    distance[:, np.arange(4), :, np.arange(4)] = np.inf
    assert np.abs(distance.min(axis=-1) - spheres.radius).max() < error
    assert spheres.radius.min() > 1e6 * error


def test_the_block_of_the_paper_takes_five_colours_at_most():
    """No body has two bonds of one colour; it has four faces, and so no more bonds."""
    mesh = read_mesh(PAPER_BLOCK)
    top = topology_of(mesh)
    colours = edge_colours(np.stack([top.master, top.slave], axis=1), mesh.body_count)
    seen = np.concatenate([1000 * bodies + colours for bodies in (top.master, top.slave)])
    assert len(np.unique(seen)) == len(seen) and colours.max() < 5


#: Solids of simple form, made in rows or scattered.
PLATE = partial(shapes.plate, thickness=0.02, element=0.01)
FORMS = {
    "block": partial(shapes.block, (0.1, 0.06, 0.08), element=0.02),
    "plate": partial(PLATE, width=0.2, height=0.1),
    "cylinder": partial(shapes.cylinder, radius=0.05, height=0.06, element=0.02),
    "drilled": partial(PLATE, width=0.1, height=0.08, hole=0.03),
    # Its chords are half an element long.
    "narrow hole": partial(PLATE, width=0.1, height=0.1, hole=(0.03, 0.05, 0.012)),
}


@pytest.mark.parametrize(
    ("mesh", "volume", "areas"),
    [
        (bar(2.0, 0.5, (3, 2, 4)), 0.5, {"left": 0.25, "right": 0.25, "top": 1.0, "front": 1.0}),
        (FORMS["block"](), 0.00048, {"right": 0.0048, "bottom": 0.008, "front": 0.006}),
        (FORMS["plate"](), 0.0004, {"left": 0.002, "top": 0.004, "front": 0.02}),
    ],
    ids=["bar", "block", "plate"],
)
def test_a_solid_with_flat_sides_has_its_volume_and_areas(mesh, volume, areas):
    assert volumes(mesh).sum() == pytest.approx(volume, rel=1e-12)
    assert {side: group_area(mesh, side) for side in areas} == pytest.approx(areas, rel=1e-12)


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
    a, b = outward(mesh)[:, LOCAL_EDGES].transpose(2, 0, 1, 3)
    return 180.0 - np.degrees(np.arccos((a * b).sum(axis=-1).min()))
