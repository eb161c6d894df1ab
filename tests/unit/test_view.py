"""What a viewer sees of a block: projected areas, order of faces, traces of cracks."""

import numpy as np
import pytest

from taichi_dem.mesh import shapes as mesh_shapes
from taichi_dem.mesh.tetrahedra import area_vectors
from taichi_dem.mesh.topology import skin, topology_of
from taichi_dem.plot.view import View, surface, traces

AXES = [(0, 0, 1), (0, 1, 0), (1, 0, 0), (0.3, -0.2, 0.9), (-1, 2, 0.5)]


def corners_of(mesh):
    return mesh.points[mesh.tetrahedra]


def areas(polygons):
    """Signed areas of triangles in the picture, positive when counter-clockwise."""
    a, b = polygons[:, 1] - polygons[:, 0], polygons[:, 2] - polygons[:, 0]
    return 0.5 * (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])


@pytest.mark.parametrize("axis", AXES)
def test_directions_of_a_view_are_a_right_handed_frame(axis):
    view = View(axis)
    frame = np.array([view.right, view.up, view.toward])
    assert frame @ frame.T == pytest.approx(np.eye(3), abs=1e-15)
    assert np.linalg.det(frame) == pytest.approx(1.0, abs=1e-15)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_looking_down_a_coordinate_axis_the_next_two_are_right_and_up(axis):
    view = View(-2.0 * np.eye(3)[axis])  # the sign does not matter: the viewer stands at the top
    assert np.array_equal(view.right, np.eye(3)[(axis + 1) % 3])
    assert np.array_equal(view.up, np.eye(3)[(axis + 2) % 3])
    assert view.labels() == tuple(f"{'xyz'[(axis + k) % 3]} [m]" for k in (1, 2))


@pytest.mark.parametrize("axis", AXES)
def test_visible_faces_of_a_convex_block_cover_its_shadow_once(axis):
    # Each face has area vector a; those that face the viewer add up to the shadow, and so do
    # those that do not: shadow = 1/2 sum |a . toward|. Facing polygons are counter-clockwise.
    mesh = mesh_shapes.bar(0.4, 0.2, (2, 1, 1))
    topology, view = topology_of(mesh), View(axis)
    intact = np.zeros(topology.bond_count, dtype=bool)
    polygons, _, crack = surface(topology, view, corners_of(mesh), intact)
    faces = np.vstack([*mesh.groups.values()])
    shadow = 0.5 * np.abs(area_vectors(mesh.points, faces) @ view.toward).sum()
    assert areas(polygons).min() > 0.0
    assert areas(polygons).sum() == pytest.approx(shadow, rel=1e-12)
    assert not crack.any()


def test_nearer_faces_come_later():
    mesh = mesh_shapes.bar(0.4, 0.2, (2, 2, 2))
    triangles = corners_of(mesh)[:, [1, 2, 3]]
    view = View((0.2, 0.1, 1.0))
    depth = triangles[view.facing(triangles)].mean(axis=1) @ view.toward
    assert np.all(np.diff(depth) >= 0.0)


def test_both_sides_of_a_broken_bond_belong_to_the_skin():
    mesh = mesh_shapes.pair()
    topology = topology_of(mesh)
    body, face, crack = skin(topology, np.array([True]))
    assert len(body) == topology.outer_count + 2 == 8
    assert sorted(body[crack]) == [0, 1]
    assert sorted(zip(body, face)) == [(i, f) for i in (0, 1) for f in range(4)]


def test_traces_are_the_edges_of_broken_faces_on_the_visible_side():
    # Seen from the front, a crack shows where an edge of a broken face lies in the front plane;
    # it has two lips, or one where it
    # runs along the rim.
    mesh = mesh_shapes.bar(0.4, 0.2, (3, 2, 1))
    topology = topology_of(mesh)
    front = mesh.points[:, 2] == mesh.points[:, 2].max()
    broken_time = np.random.default_rng(7).permutation(topology.bond_count).astype(float)
    broken_time[broken_time > 0.7 * topology.bond_count] = np.nan
    body, ends, time_s = traces(mesh, topology, View(), broken_time)
    found = {}
    for i, pair, moment in zip(body, ends, time_s):
        found.setdefault(tuple(sorted(mesh.tetrahedra[i][pair])), []).append(moment)
    expected = {}
    for triangle, moment in zip(topology.vertices, broken_time):
        for k in range(3):
            edge = tuple(sorted((triangle[k], triangle[k - 1])))
            if front[list(edge)].all() and not np.isnan(moment):
                expected[edge] = min(moment, expected.get(edge, np.inf))
    assert len(expected) > 1
    assert {edge: min(moments) for edge, moments in found.items()} == expected
    assert all(min(moments) == max(moments) for moments in found.values())
    low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
    for edge, moments in found.items():
        ends = mesh.points[list(edge), :2]
        on_rim = ((ends == low[:2]).all(axis=0) | (ends == high[:2]).all(axis=0)).any()
        assert len(moments) == (1 if on_rim else 2)


def test_an_unbroken_block_has_no_traces():
    mesh = mesh_shapes.pair()
    body, ends, time_s = traces(mesh, topology_of(mesh), View(), np.array([np.nan]))
    assert len(body) == len(ends) == len(time_s) == 0
