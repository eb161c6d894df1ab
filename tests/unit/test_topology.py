"""Bonds, outer faces and mass properties of bodies are those of the mesh, whatever its order."""

import numpy as np
import pytest

from taichi_dem import PAPER_BLOCK, checked_mesh, read_mesh
from taichi_dem.mesh import tetrahedra as geometry
from taichi_dem.mesh.shapes import bar
from taichi_dem.mesh.topology import body_properties, face_vertices, faces_of_group, topology_of

MESHES = {"bar": bar(1.0, 0.2, (5, 2, 3)), "block": read_mesh(PAPER_BLOCK)}
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
    assert sorted(zip(top.outer_body, top.outer_face)) == sorted(zip(*np.nonzero(expected < 0)))


def test_faces_of_a_group_are_its_own_in_its_order():
    mesh = shuffled(MESHES["block"], 4)
    top = topology_of(mesh)
    for name, wanted in mesh.groups.items():
        body, face = faces_of_group(mesh, top, name)
        found = face_vertices(mesh, body, face)
        assert np.array_equal(np.sort(found, axis=1), np.sort(wanted, axis=1))
        assert np.all(top.body_bond[body, face] == -1)


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
