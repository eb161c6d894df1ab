"""Contact of spheres with faces: geometry, energy, momentum, and sliding without interlocking."""

from dataclasses import replace

import numpy as np
import pytest

from taichi_dem import CONCRETE, Scene, Simulation, Uniform, effects
from taichi_dem.mesh.face_rims import face_rims
from taichi_dem.mesh.shapes import bar, single
from taichi_dem.mesh.tetrahedra import all_faces
from taichi_dem.mesh.topology import topology_of
from tests.faces import AtABlock, triangle_distance

EPS = np.finfo(float).eps
LOSSLESS = replace(CONCRETE, contact_damping=0.0)


@pytest.fixture(scope="module")
def at_a_block():
    """A tetrahedron that is put at a block of 72, without bonds' dashpots."""
    return AtABlock(material=LOSSLESS)


def touching(scene, random, count):
    """Places and orientations in which some sphere touches, and no centre is within a body."""
    found = []
    while len(found) < count:
        drawn = scene.drawn(random)
        scene.put(*drawn)
        gaps, within = scene.gaps()
        if gaps.min() < -1e-5 and not within:
            found.append(drawn)
    return found


def test_a_side_of_many_faces_ends_at_its_own_edges_and_corners():
    """A box has 6 sides of 4 edges and 4 corners, however many faces they are made of."""
    mesh = bar(0.12, 0.08, (3, 2, 2))
    outer = topology_of(mesh).body_bond.reshape(-1) < 0
    rims = face_rims(mesh, outer)
    corners = mesh.points[all_faces(mesh.tetrahedra)]
    edge = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
    rim = edge[outer][rims.edge[outer]].sum()
    assert rim == pytest.approx(2 * (4 * 0.12 + 4 * 0.08 + 4 * 0.08), rel=1e-12)
    assert rims.corner[outer].sum() == 24
    assert rims.edge[~outer].all() and rims.corner[~outer].all()


def test_an_intact_block_does_not_touch_itself(at_a_block):
    at_a_block.put((1.0, 1.0, 1.0), (1.0, 0.0, 0.0, 0.0))
    # Spheres of different faces of bodies touch their own planes to a rounding of 0.1 m.
    count = at_a_block.simulation.contacts.store.sphere_count[None]
    assert at_a_block.energy() <= 0.5 * CONCRETE.contact_stiffness * (8 * EPS * 0.1) ** 2 * count


def test_energy_is_that_of_six_flat_sides_and_four_triangles(at_a_block):
    """The block's 56 outer faces act as six rectangles: no bump where they meet."""
    random = np.random.default_rng(1)
    for drawn in touching(at_a_block, random, 60):
        at_a_block.put(*drawn)
        overlap = np.maximum(0.0, -at_a_block.gaps()[0])
        wanted = 0.5 * CONCRETE.contact_stiffness * (overlap**2).sum()
        # Distances of 0.1 m are known to some roundings.
        error = CONCRETE.contact_stiffness * (overlap * 100 * EPS * 0.1).sum()
        assert at_a_block.energy() == pytest.approx(wanted, abs=error)
