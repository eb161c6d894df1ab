"""Meshes: what checked_mesh mends (and says), what it refuses (and how), and the known shapes."""

import itertools

import numpy as np
import pytest

from taichi_dem import PAPER_BLOCK, InputError, checked_mesh, read_mesh
from taichi_dem.mesh import tetrahedra as geometry
from taichi_dem.mesh.mesh import group_area, volumes
from taichi_dem.mesh.shapes import bar, pair, single, with_neighbours
from taichi_dem.mesh.topology import topology_of

# Two tetrahedra on both sides of the triangle 0 1 2, apexes 3 (z > 0) and 4 (z < 0).
POINTS = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0.2, 0.2, 1], [0.2, 0.2, -1]]
BODIES = [[0, 1, 2, 3], [0, 2, 1, 4]]


def built(points=POINTS, bodies=BODIES, groups=None, **options):
    return checked_mesh(points, bodies, groups or {}, **options)


def refused(*arguments, **options):
    """The sentence with which the mesh is refused."""
    with pytest.raises(InputError) as caught:
        built(*arguments, **options)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_good_mesh_passes_unchanged_and_without_notes():
    mesh = built(groups={"top": [[1, 2, 3]]}, source="here")
    assert mesh.points.dtype == np.float64 and np.array_equal(mesh.points, POINTS)
    assert mesh.tetrahedra.dtype == np.int32 and np.array_equal(mesh.tetrahedra, BODIES)
    assert (mesh.body_count, mesh.point_count) == (2, 5)
    assert (mesh.notes, mesh.source) == ((), "here")


def test_the_mesh_does_not_share_memory_with_its_input():
    points = np.array(POINTS, dtype=float)
    mesh = built(points)
    points[0] = 7.0
    assert np.array_equal(mesh.points, POINTS)


@pytest.mark.parametrize(
    ("points", "words"),
    [
        ("points", "array of numbers"),
        (np.zeros((4, 2)), "shape (n, 3), got (4, 2)"),
        ([*POINTS[:4], [0.0, np.nan, 0.0]], "the first is number 4"),
        ([*POINTS[:4], [0.0, np.inf, 0.0]], "the first is number 4"),
    ],
)
def test_bad_points_are_refused(points, words):
    assert words in refused(points)


@pytest.mark.parametrize(
    ("bodies", "words"),
    [
        ([], "tetrahedra must not be empty"),
        ([[0, 1, 2]], "shape (n, 4), got (1, 3)"),
        ([[0.0, 1.0, 2.0, 3.0]], "integer"),
        ([[0, 1, 2, 3], [0, 2, 1, 5]], "[0, 4], but row 1 is [0, 2, 1, 5]"),
        ([[0, 1, 2, 3], [0, 2, 1, -1]], "[0, 4], but row 1 is [0, 2, 1, -1]"),
        ([[0, 1, 2, 2]], "number 0 with 0 m3"),
        ([*BODIES, [2, 1, 0, 3]], "0 and 2 have the same four points"),
    ],
)
def test_bad_tetrahedra_are_refused(bodies, words):
    assert words in refused(bodies=bodies)


def test_negative_volumes_are_turned_and_said():
    mesh = built(bodies=[[0, 1, 2, 3], [0, 1, 2, 4]])
    # One sixth of base 1 x 1 times height 1, both.
    assert volumes(mesh) == pytest.approx([1 / 6, 1 / 6])
    assert mesh.notes == ("turned 1 tetrahedra of negative volume",)


def test_flat_is_measured_against_the_longest_edge():
    # V = height / 6 and the longest edge is sqrt 2: flat below height = 6 * 2^1.5 * 1e-12.
    limit = 6.0 * 2.0**1.5 * 1e-12
    for scale in (1e-3, 1.0, 1e3):
        for factor, bad in ((0.5, True), (2.0, False)):
            points = scale * np.array([*POINTS[:3], [0.2, 0.2, factor * limit]])
            if bad:
                assert "1 tetrahedra have no volume, the first is number 0" in refused(
                    points, BODIES[:1]
                )
            else:
                assert built(points, BODIES[:1]).body_count == 1


def test_a_face_of_three_bodies_is_refused():
    points = [*POINTS, [0.3, 0.3, 2.0]]
    words = refused(points, [*BODIES, [0, 1, 2, 5]])
    assert "tetrahedra 0, 1 and 2 share one face" in words


def test_two_bodies_on_one_side_of_their_face_are_refused():
    points = [*POINTS[:4], [0.3, 0.3, 2.0]]
    words = refused(points, [[0, 1, 2, 3], [0, 1, 2, 4]])
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
    assert built(*doubled(gap), weld_tolerance=tolerance).point_count == 5


def test_near_points_are_welded_and_said():
    mesh = built(*doubled(1e-5), weld_tolerance=1.1e-5)
    assert mesh.point_count == 5
    assert mesh.notes[0] == "welded 3 points closer than 1.1e-05 m to another"
    assert len(geometry.shared_faces(mesh.tetrahedra)) == 1


def test_points_farther_apart_than_the_tolerance_stay():
    mesh = built(*doubled(1e-5), weld_tolerance=0.9e-5)
    assert mesh.point_count == 8


@pytest.mark.parametrize("tolerance", [-1e-6, np.nan, np.inf, 1.0, "little"])
def test_senseless_weld_tolerance_is_refused(tolerance):
    words = refused(weld_tolerance=tolerance)
    assert "weld_tolerance must lie in [0, 1) m" in words and repr(tolerance) in words


def test_loose_points_are_dropped_and_said():
    points = [[9.0, 9.0, 9.0], *POINTS, [8.0, 8.0, 8.0]]
    shifted = np.array(BODIES) + 1
    mesh = built(points, shifted, {"top": [[2, 3, 4]]})
    assert mesh.notes == ("dropped 2 points that belong to no tetrahedron",)
    assert np.array_equal(mesh.points, POINTS) and np.array_equal(mesh.tetrahedra, BODIES)
    assert sorted(mesh.group_faces("top")[0]) == [1, 2, 3]


def test_parts_that_share_no_face_are_counted():
    # The second body touches the first in the point 0 only, the third in an edge only.
    points = [*POINTS[:4], [-1, 0, 0], [0, -1, 0], [0, 0, -1], [0.5, 0.5, -1], [1.5, 1.5, -1]]
    mesh = built(points, [[0, 1, 2, 3], [0, 4, 5, 6], [1, 2, 7, 8]])
    assert "the mesh has 3 parts that share no face with each other" in mesh.notes


@pytest.mark.parametrize(
    ("faces", "words"),
    [
        ([[0, 3, 4]], "group 'wall': 1 of its 1 faces are not outer faces"),
        ([[0, 1, 2], [0, 3, 4]], "group 'wall': 2 of its 2 faces are not outer faces"),
        ([[1, 2, 3], [1, 3, 4], [0, 3, 4]], "2 of its 3 faces"),
        ([[0, 1]], "group 'wall' must have shape (n, 3), got (1, 2)"),
        ([[0, 1, 9]], "group 'wall': point numbers must lie in [0, 4]"),
        ([], "group 'wall' must not be empty"),
    ],
)
def test_bad_groups_are_refused(faces, words):
    assert words in refused(groups={"wall": faces})


def test_a_group_on_a_loose_point_is_refused():
    words = refused([*POINTS, [5.0, 5.0, 5.0]], groups={"wall": [[0, 1, 5]]})
    assert "1 of its 1 faces are not outer faces" in words


def test_faces_twice_in_a_group_count_once():
    mesh = built(groups={"wall": [[1, 2, 3], [3, 2, 1], [0, 1, 4]]})
    assert len(mesh.group_faces("wall")) == 2
    assert mesh.notes == ("dropped 1 repeated faces of group 'wall'",)


@pytest.mark.parametrize("face", list(itertools.permutations([1, 2, 3])))
def test_group_faces_look_outward_however_they_were_given(face):
    mesh = built(groups={"wall": [face]})
    outward = geometry.area_vectors(mesh.points, mesh.group_faces("wall"))[0]
    centre = mesh.points[[0, 1, 2, 3]].mean(axis=0)
    middle = mesh.points[list(face)].mean(axis=0)
    assert outward @ (middle - centre) > 0.0


def test_unknown_group_is_refused_with_the_names_there_are():
    mesh = bar(1.0, 0.1, (2, 1, 1))
    with pytest.raises(InputError, match="'hole'; its groups are: back, bottom, front, left"):
        mesh.group_faces("hole")
    with pytest.raises(InputError, match="its groups are: none"):
        built().group_faces("hole")


def test_close_pairs_are_those_of_the_plain_double_loop():
    rng = np.random.default_rng(5)
    points = rng.integers(0, 5, (300, 3)) * 0.1 + rng.uniform(-0.01, 0.01, (300, 3))
    for distance in (0.004, 0.02, 0.05):
        gap = np.linalg.norm(points[:, None] - points, axis=-1)
        expected = np.argwhere(np.triu(gap <= distance, k=1))
        assert len(expected) > 0
        assert np.array_equal(geometry.close_pairs(points, distance), expected)


def test_components_are_those_of_a_plain_flood():
    rng = np.random.default_rng(6)
    pairs = rng.integers(0, 200, (110, 2))
    label = np.arange(200)
    for _ in range(200):
        for a, b in pairs:
            label[a] = label[b] = min(label[a], label[b])
    found = geometry.components(200, pairs)
    assert np.array_equal(found, label) and len(np.unique(found)) > 10


@pytest.mark.parametrize("cells", [(1, 1, 1), (5, 1, 2), (3, 2, 4)])
def test_bar_fills_its_box(cells):
    mesh = bar(2.0, 0.5, cells)
    assert mesh.notes == ()
    assert mesh.body_count == 6 * np.prod(cells)
    # All bodies are alike: a sixth of a box each.
    assert volumes(mesh) == pytest.approx(2.0 * 0.5 * 0.5 / mesh.body_count)
    areas = {name: group_area(mesh, name) for name in mesh.groups}
    ends, sides = pytest.approx(0.25), pytest.approx(1.0)
    assert (areas.pop("left"), areas.pop("right")) == (ends, ends)
    assert sorted(areas) == ["back", "bottom", "front", "top"]
    assert all(area == sides for area in areas.values())


@pytest.mark.parametrize(
    ("name", "axis", "value"),
    [
        *[("left", 0, 0), ("right", 0, 2), ("bottom", 1, 0)],
        *[("top", 1, 1), ("back", 2, 0), ("front", 2, 1)],
    ],
)
def test_bar_groups_lie_where_their_names_say(name, axis, value):
    mesh = bar(2.0, 1.0, (4, 2, 2))
    assert np.all(mesh.points[mesh.group_faces(name)][..., axis] == value)


@pytest.mark.parametrize("cells", [(0, 1, 1), (1, 1), (1.5, 1, 1), (1, -2, 1)])
def test_bar_refuses_senseless_cells(cells):
    with pytest.raises(InputError, match="cells must be three integers"):
        bar(1.0, 1.0, cells)


@pytest.mark.parametrize("length", [0.0, -1.0, np.nan, np.inf])
def test_shapes_refuse_senseless_lengths(length):
    for build in (
        lambda: bar(length, 1.0, (1, 1, 1)),
        lambda: bar(1.0, length, (1, 1, 1)),
        lambda: single(length),
        lambda: pair(1.0, length),
    ):
        with pytest.raises(InputError, match="must be a positive finite number"):
            build()


def test_single_is_regular_unless_told_otherwise():
    # Volume of a regular tetrahedron: edge^3 / (6 sqrt 2); of a cone: base height / 3.
    assert volumes(single(0.2)) == pytest.approx([0.2**3 / (6.0 * np.sqrt(2.0))])
    mesh = single(0.2, 0.5)
    base = np.sqrt(3.0) / 4.0 * 0.2**2
    assert volumes(mesh) == pytest.approx([base * 0.5 / 3.0])
    assert group_area(mesh, "base") == pytest.approx(base)
    assert len(mesh.group_faces("sides")) == 3


def test_pair_is_its_own_mirror_image():
    mesh = pair(0.1)
    centres = mesh.points[mesh.tetrahedra].mean(axis=1)
    assert centres[0] == pytest.approx(centres[1] * [-1, 1, 1]) and centres[0, 0] < 0
    assert np.all(mesh.points[mesh.group_faces("left")].min(axis=1)[:, 0] < 0)
    assert np.all(mesh.points[mesh.group_faces("right")].max(axis=1)[:, 0] > 0)
    assert volumes(mesh)[0] == pytest.approx(volumes(mesh)[1])


# The block of the paper, section 4.1: 277 nodes and 962 tetrahedra there.


def test_paper_block_has_the_size_of_the_papers_mesh():
    mesh = read_mesh(PAPER_BLOCK)
    assert abs(mesh.body_count - 962) <= 10
    assert abs(mesh.point_count - 277) <= 30
    assert mesh.notes == ()
    assert sorted(mesh.groups) == ["back", "bottom", "front", "hole", "left", "right", "top"]


def test_paper_block_fills_the_block_less_the_hole():
    # The hole is a regular octagon of circumradius 2.5 cm: area 4 sin 45 R^2, side 2 R sin 22.5.
    mesh = read_mesh(PAPER_BLOCK)
    octagon = 4.0 * np.sin(np.pi / 4.0) * 0.025**2
    assert volumes(mesh).sum() == pytest.approx((2.0 * 2.0 - octagon) * 0.2, rel=1e-12)
    perimeter = 8.0 * 2.0 * 0.025 * np.sin(np.pi / 8.0)
    assert group_area(mesh, "hole") == pytest.approx(perimeter * 0.2, rel=1e-9)
    for name, area in (("front", 4.0 - octagon), ("back", 4.0 - octagon), ("right", 0.4)):
        assert group_area(mesh, name) == pytest.approx(area, rel=1e-12)


def test_paper_blocks_hole_lies_40_cm_from_the_right_face():
    mesh = read_mesh(PAPER_BLOCK)
    wall = mesh.points[np.unique(mesh.group_faces("hole"))]
    assert np.hypot(wall[:, 0] - 1.6, wall[:, 1] - 1.0) == pytest.approx(0.025, rel=1e-9)
    assert np.all(mesh.points[mesh.group_faces("right")][..., 0] == 2.0)


def test_paper_blocks_faces_belong_to_one_group_each():
    mesh = read_mesh(PAPER_BLOCK)
    faces = np.vstack(list(mesh.groups.values()))
    outer = 4 * mesh.body_count - 2 * len(geometry.shared_faces(mesh.tetrahedra))
    assert len(np.unique(np.sort(faces, axis=1), axis=0)) == len(faces) == outer


def test_neighbours_stand_on_the_faces_opposite_to_corners_as_high_as_told():
    mesh, outward = with_neighbours(0.1, {0: 1.0, 2: 0.5})
    own, full, half = volumes(mesh)
    assert full == pytest.approx(own) and half == pytest.approx(0.5 * own)
    assert topology_of(mesh).bond_count == 2
    centre = mesh.points[mesh.tetrahedra].mean(axis=1)
    away = centre[1:] - centre[0]
    assert outward == pytest.approx(away / np.linalg.norm(away, axis=1)[:, None])
