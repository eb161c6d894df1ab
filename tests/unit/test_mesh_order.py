"""Bodies in the order of a space-filling curve: the same block, with neighbours near in number."""

import numpy as np
import pytest

from taichi_dem.mesh.mesh import Mesh, checked_mesh, group_area, volumes
from taichi_dem.mesh.reorder import in_space_order
from taichi_dem.mesh.shapes import bar
from taichi_dem.mesh.topology import topology_of


@pytest.fixture
def shuffled():
    """A block of 3072 bodies numbered at random."""
    mesh = bar(1.0, 1.0, (8, 8, 8))
    order = np.random.default_rng(0).permutation(mesh.body_count)
    return Mesh(mesh.points, mesh.tetrahedra[order], mesh.groups)


def test_bodies_are_the_same_in_another_order(shuffled):
    made = in_space_order(shuffled)
    rows = [sorted(map(tuple, mesh.tetrahedra.tolist())) for mesh in (shuffled, made)]
    assert rows[0] == rows[1]
    assert np.array_equal(made.points, shuffled.points) and list(made.groups) == list(
        shuffled.groups
    )
    assert group_area(made, "left") == group_area(shuffled, "left")
    assert topology_of(made).bond_count == topology_of(shuffled).bond_count
    assert volumes(made).min() > 0.0
    assert np.array_equal(in_space_order(made).tetrahedra, made.tetrahedra)


def test_octants_follow_one_another(shuffled):
    """The highest bits come first: each octant of the cube is one run of numbers, x fastest."""
    made = in_space_order(shuffled)
    centre = made.points[made.tetrahedra].mean(axis=1)
    low, high = centre.min(axis=0), centre.max(axis=0)
    octant = ((centre - low) > 0.5 * (high - low).max()) @ [1, 2, 4]
    assert (np.diff(octant) >= 0).all() and octant[-1] == 7


def test_neighbours_are_near_in_number(shuffled):
    """In a shuffled row two numbers differ by n (1 - 1 / sqrt 2) in the median, 0.29 n.

    On the curve half of all bonds lie inside cells of 6 bodies, or of 48: no further than that.
    """

    def apart(mesh):
        top = topology_of(mesh)
        return np.median(top.slave - top.master)

    assert apart(shuffled) > 0.25 * shuffled.body_count
    assert apart(in_space_order(shuffled)) < 48


def test_one_body_is_in_order():
    mesh = bar(1.0, 1.0, (1, 1, 1))
    alone = checked_mesh(mesh.points, mesh.tetrahedra[:1], {})
    assert np.array_equal(in_space_order(alone).tetrahedra, alone.tetrahedra)
