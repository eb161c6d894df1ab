"""Contact spheres against their definition, face by face (Konno et al., 2.2, Fig. 5)."""

import numpy as np
import pytest

from taichi_dem import PAPER_BLOCK, read_mesh
from taichi_dem.mesh.contact_spheres import interior_crossings, spheres_of_faces

EPS = np.finfo(float).eps


@pytest.fixture(scope="module")
def block():
    """Mesh of the paper's block and the centres of its bodies."""
    mesh = read_mesh(PAPER_BLOCK)
    return mesh, mesh.points[mesh.tetrahedra].mean(axis=1)


def plane_distances(mesh, points):
    """Distance of points (n, 4, k, 3) of every body from its four faces, inside positive.

    Face g is the one opposite vertex g: the distance is the share of that vertex's height.
    """
    corners = mesh.points[mesh.tetrahedra]
    distances = []
    for g in range(4):
        a, b, c = (corners[:, k] for k in range(4) if k != g)
        normal = np.cross(b - a, c - a)
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        normal *= np.sign(np.einsum("nx,nx->n", corners[:, g] - a, normal))[:, None]
        distances.append(np.einsum("nfkx,nx->nfk", points - a[:, None, None], normal))
    return np.stack(distances, axis=-1)


@pytest.mark.parametrize(("divisions", "count"), [(3, 1), (5, 6)])
def test_lines_through_n_parts_cross_at_their_number_of_points(divisions, count):
    """(n - 1)(n - 2) / 2 crossings, all inside, all multiples of 1 / n; the paper has six."""
    crossings = interior_crossings(divisions)
    assert crossings.shape == (count, 3)
    assert len(np.unique(crossings, axis=0)) == count
    assert crossings.min() > 0.0
    assert np.abs(crossings.sum(axis=1) - 1.0).max() < 4 * EPS
    assert np.array_equal(crossings * divisions, np.round(crossings * divisions))


def test_spheres_touch_their_face_and_another_and_stay_inside(block):
    """Distance r from the own face, at least r from the others, r from one of them.

    Distances are differences of coordinates of 2 m; the radius divides by 1 - m_f . m_g, which in
    this mesh is above 0.01.
    """
    mesh, centre = block
    spheres = spheres_of_faces(mesh, centre, 5)
    error = 16 * EPS * 2.0 / 0.01
    distance = plane_distances(mesh, spheres.centre + centre[:, None, None, :])
    own = distance[:, np.arange(4), :, np.arange(4)].transpose(1, 0, 2)
    assert np.abs(own - spheres.radius).max() < error
    distance[:, np.arange(4), :, np.arange(4)] = np.inf
    assert np.abs(distance.min(axis=-1) - spheres.radius).max() < error
    assert spheres.radius.min() > 1e6 * error


def test_spheres_sit_at_the_crossings(block):
    """The touching point, a radius inward of which the sphere sits, divides the face in fifths."""
    mesh, centre = block
    spheres = spheres_of_faces(mesh, centre, 5)
    corners = mesh.points[mesh.tetrahedra]
    place = spheres.centre + centre[:, None, None, :]
    for f in range(4):
        face = corners[:, [k for k in range(4) if k != f]]
        normal = np.cross(face[:, 1] - face[:, 0], face[:, 2] - face[:, 0])
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        normal *= -np.sign(np.einsum("nx,nx->n", corners[:, f] - face[:, 0], normal))[:, None]
        touch = place[:, f] + spheres.radius[:, f, :, None] * normal[:, None]
        solved = np.linalg.pinv(face.transpose(0, 2, 1)) @ touch.transpose(0, 2, 1)
        fifths = 5.0 * solved.transpose(0, 2, 1)
        # Faces in a plane through the origin do not give back the share of every corner.
        whole = np.abs(np.linalg.det(face)) > 1e-4 * np.abs(face).max() ** 2
        assert whole.sum() > 100
        assert np.abs(fifths - np.round(fifths))[whole].max() < 1e-6


def test_extent_holds_the_spheres_of_its_body_and_no_more(block):
    """The ball around the centre touches the farthest sphere from outside."""
    mesh, centre = block
    spheres = spheres_of_faces(mesh, centre, 5)
    reach = np.linalg.norm(spheres.centre, axis=-1) + spheres.radius
    assert np.array_equal(spheres.extent, reach.reshape(len(reach), -1).max(axis=1))


def test_cluster_holds_the_spheres_of_its_face(block):
    mesh, centre = block
    spheres = spheres_of_faces(mesh, centre, 5)
    middle, reach = spheres.cluster[:, :, None, :3], spheres.cluster[:, :, None, 3]
    outermost = np.linalg.norm(spheres.centre - middle, axis=-1) + spheres.radius
    assert (outermost <= reach * (1.0 + 4 * EPS)).all()
