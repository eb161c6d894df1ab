"""Bonds and outer faces by counting and geometry; mass properties by independent integration."""

import numpy as np
import pytest

from taichi_dem import PAPER_BLOCK, InputError, checked_mesh, read_mesh
from taichi_dem.mesh import tetrahedra as geometry
from taichi_dem.mesh.shapes import bar, pair, single
from taichi_dem.mesh.topology import body_properties, face_vertices, faces_of_group, topology_of

MESHES = {
    "single": single(),
    "pair": pair(),
    "bar": bar(1.0, 0.2, (5, 2, 3)),
    "block": read_mesh(PAPER_BLOCK),
}
EACH = pytest.mark.parametrize("name", MESHES)


def shuffled(mesh, seed):
    """The same mesh with points, bodies and corners in another order."""
    rng = np.random.default_rng(seed)
    place = rng.permutation(mesh.point_count)  # old point -> new point
    points = np.empty_like(mesh.points)
    points[place] = mesh.points
    bodies = rng.permuted(place[mesh.tetrahedra][rng.permutation(mesh.body_count)], axis=1)
    return checked_mesh(points, bodies, {name: place[f] for name, f in mesh.groups.items()})


@EACH
def test_every_face_is_in_one_or_two_bodies(name):
    mesh, top = MESHES[name], topology_of(MESHES[name])
    assert 4 * mesh.body_count == 2 * top.bond_count + top.outer_count
    faces = np.sort(geometry.all_faces(mesh.tetrahedra), axis=1)
    distinct = np.unique(faces, axis=0)
    assert len(distinct) == top.bond_count + top.outer_count


@EACH
def test_bonds_are_sorted_with_the_master_first(name):
    top = topology_of(MESHES[name])
    assert np.all(top.master < top.slave)
    pairs = list(zip(top.master, top.slave))
    assert pairs == sorted(set(pairs))


@EACH
def test_both_bodies_of_a_bond_own_its_face(name):
    mesh, top = MESHES[name], topology_of(MESHES[name])
    of_master = face_vertices(mesh, top.master, top.master_face)
    of_slave = face_vertices(mesh, top.slave, top.slave_face)
    assert np.array_equal(of_master, top.vertices)
    assert np.array_equal(np.sort(of_slave, axis=1), np.sort(top.vertices, axis=1))


@EACH
def test_bond_normal_points_from_master_to_slave(name):
    mesh, top = MESHES[name], topology_of(MESHES[name])
    normal = geometry.area_vectors(mesh.points, top.vertices)
    middle = mesh.points[top.vertices].mean(axis=1)
    centre = mesh.points[mesh.tetrahedra].mean(axis=1)
    assert np.all(np.einsum("ij,ij->i", normal, middle - centre[top.master]) > 0.0)
    assert np.all(np.einsum("ij,ij->i", normal, centre[top.slave] - middle) > 0.0)


@EACH
def test_slots_of_the_bodies_name_their_bonds(name):
    mesh, top = MESHES[name], topology_of(MESHES[name])
    expected = np.full((mesh.body_count, 4), -1)
    for bond in range(top.bond_count):
        expected[top.master[bond], top.master_face[bond]] = bond
        expected[top.slave[bond], top.slave_face[bond]] = bond
    assert np.array_equal(top.body_bond, expected)
    outer = sorted(zip(top.outer_body, top.outer_face))
    assert outer == sorted(zip(*np.nonzero(expected < 0)))


@EACH
def test_numbers_are_32_bit_integers(name):
    arrays = vars(topology_of(MESHES[name]))
    kept = {key: array.dtype for key, array in arrays.items() if array.dtype != np.int32}
    assert kept == {"is_open": np.bool_, "bonded_share": np.float64}


@EACH
def test_local_face_lies_opposite_its_vertex(name):
    mesh = MESHES[name]
    for face in range(4):
        body = np.arange(mesh.body_count)
        corners = face_vertices(mesh, body, np.full(mesh.body_count, face))
        apex = mesh.tetrahedra[:, face]
        assert not np.any(corners == apex[:, None])
        normal = geometry.area_vectors(mesh.points, corners)
        height = np.einsum("ij,ij->i", normal, mesh.points[corners[:, 0]] - mesh.points[apex])
        # Outward, and a third of area times height is the volume.
        assert height / 3.0 == pytest.approx(
            geometry.signed_volumes(mesh.points, mesh.tetrahedra), rel=1e-9
        )


@EACH
def test_area_vectors_of_a_body_add_up_to_zero(name):
    # Gauss: the surface integral of a constant vanishes. Round-off: a few eps of the largest.
    mesh = MESHES[name]
    vectors = geometry.area_vectors(mesh.points, geometry.all_faces(mesh.tetrahedra))
    total = vectors.reshape(-1, 4, 3).sum(axis=1)
    assert np.abs(total).max() < 1e-14 * np.abs(vectors).max() * 10


@EACH
def test_outer_faces_enclose_the_volume(name):
    # Gauss: V = 1/3 of the integral of x . n over the outer faces, exact with x at the centroid.
    mesh, top = MESHES[name], topology_of(MESHES[name])
    faces = face_vertices(mesh, top.outer_body, top.outer_face)
    middle = mesh.points[faces].mean(axis=1)
    enclosed = np.sum(middle * geometry.area_vectors(mesh.points, faces)) / 3.0
    volume = geometry.signed_volumes(mesh.points, mesh.tetrahedra).sum()
    assert enclosed == pytest.approx(volume, rel=1e-12)


@pytest.mark.parametrize(("name", "solid"), [("single", 1), ("pair", 1), ("bar", 1), ("block", 0)])
def test_euler_characteristic(name, solid):
    # points - edges + faces - bodies: 1 for a ball, 0 for a block with a hole through it; its
    # surface has twice that.
    mesh, top = MESHES[name], topology_of(MESHES[name])
    ends = np.sort(mesh.tetrahedra[:, geometry.LOCAL_EDGES].reshape(-1, 2), axis=1)
    edges = len(np.unique(ends, axis=0))
    faces = top.bond_count + top.outer_count
    assert mesh.point_count - edges + faces - mesh.body_count == solid
    outer = face_vertices(mesh, top.outer_body, top.outer_face)
    rim = np.sort(outer[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    count = len(np.unique(outer)) - len(np.unique(rim, axis=0)) + len(outer)
    assert count == 2 * solid


def test_pair_has_one_bond_in_the_plane_between_its_bodies():
    mesh = pair(0.1)
    top = topology_of(mesh)
    assert (top.bond_count, top.outer_count) == (1, 6)
    assert (top.master[0], top.slave[0]) == (0, 1)
    area = np.sqrt(3.0) / 4.0 * 0.1**2
    vector = geometry.area_vectors(mesh.points, top.vertices)[0]
    assert vector == pytest.approx([area, 0.0, 0.0], abs=1e-16)


def test_bonds_do_not_depend_on_the_order_of_the_mesh():
    mesh = MESHES["bar"]
    other = shuffled(mesh, 3)
    assert not np.array_equal(mesh.points, other.points)
    middles = [np.round(m.points[topology_of(m).vertices].mean(axis=1), 9) for m in (mesh, other)]
    assert set(map(tuple, middles[0])) == set(map(tuple, middles[1]))


@pytest.mark.parametrize("mesh", [MESHES["block"], shuffled(MESHES["block"], 4)])
def test_faces_of_a_group_are_its_own_in_its_order(mesh):
    top = topology_of(mesh)
    for name, wanted in mesh.groups.items():
        body, face = faces_of_group(mesh, top, name)
        found = face_vertices(mesh, body, face)
        assert np.array_equal(np.sort(found, axis=1), np.sort(wanted, axis=1))
        assert np.all(top.body_bond[body, face] == -1)


def test_unknown_group_is_refused():
    mesh = MESHES["bar"]
    with pytest.raises(InputError, match="no face group 'hole'"):
        faces_of_group(mesh, topology_of(mesh), "hole")


def quadrature(corners, density):
    """Mass, centre, inertia by the four-point rule, exact for polynomials of second degree.

    Weights V / 4 at the points a p_k + b (sum of the others), a = (5 + 3 sqrt 5) / 20,
    b = (5 - sqrt 5) / 20 (Hammer, Marlowe and Stroud, 1956).
    """
    a, b = (5.0 + 3.0 * np.sqrt(5.0)) / 20.0, (5.0 - np.sqrt(5.0)) / 20.0
    places = (a - b) * corners + b * corners.sum(axis=0)
    weight = density * abs(np.linalg.det(corners[1:] - corners[0])) / 6.0 / 4.0
    mass = 4.0 * weight
    centre = places.mean(axis=0)
    inertia = np.zeros((3, 3))
    for r in places - centre:
        inertia += weight * (r @ r * np.eye(3) - np.outer(r, r))
    return mass, centre, inertia


@pytest.mark.parametrize("name", ["single", "block"])
def test_body_properties_equal_a_quadrature(name):
    mesh = MESHES[name]
    mass, centre, inertia = body_properties(mesh, 2390.0)
    for body in range(0, mesh.body_count, 37):
        expected = quadrature(mesh.points[mesh.tetrahedra[body]], 2390.0)
        assert mass[body] == pytest.approx(expected[0], rel=1e-12)
        assert centre[body] == pytest.approx(expected[1], rel=1e-12)
        scale = np.trace(expected[2])
        assert inertia[body] == pytest.approx(expected[2], abs=1e-11 * scale)


def test_regular_tetrahedron_has_one_moment():
    # I = m edge^2 / 20 about every axis.
    mass, _, inertia = body_properties(single(0.3), 1000.0)
    assert inertia[0] == pytest.approx(mass[0] * 0.3**2 / 20.0 * np.eye(3), abs=1e-15)


@pytest.mark.parametrize("cells", [(1, 1, 1), (2, 3, 1)])
def test_bodies_of_a_box_add_up_to_its_inertia(cells):
    # Parallel axes: sum of (I + m (r.r 1 - r r^T)) = m/12 diag(b2+c2, a2+c2, a2+b2) of the box.
    length, width, density = 0.7, 0.3, 1500.0
    mass, centre, inertia = body_properties(bar(length, width, cells), density)
    r = centre - [length / 2.0, width / 2.0, width / 2.0]
    square = np.einsum("ni,ni->n", r, r)[:, None, None] * np.eye(3)
    total = (inertia + mass[:, None, None] * (square - r[:, :, None] * r[:, None, :])).sum(axis=0)
    assert mass.sum() == pytest.approx(density * length * width**2, rel=1e-12)
    assert np.average(r, axis=0, weights=mass) == pytest.approx(np.zeros(3), abs=1e-14)
    moments = [2.0 * width**2, length**2 + width**2, length**2 + width**2]
    assert total == pytest.approx(mass.sum() / 12.0 * np.diag(moments), abs=1e-12 * mass.sum())


def test_far_from_the_origin_the_inertia_keeps_its_digits():
    # Coordinates of 1e3 m lose 2e-13 m; against 5 cm that is 4e-12, twice in the inertia.
    mesh = MESHES["single"]
    moved = checked_mesh(mesh.points + 1e3, mesh.tetrahedra, {})
    near, far = (body_properties(m, 2390.0)[2] for m in (mesh, moved))
    assert far == pytest.approx(near, abs=1e-11 * np.trace(near[0]))
