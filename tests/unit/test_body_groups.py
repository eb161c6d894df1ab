"""Named groups of bodies: from files and predicates, kept by all that makes a mesh of a mesh."""

import numpy as np
import pytest

from _meshes import mirrored_copies
from taichi_dem import read_mesh
from taichi_dem.mesh.files import write_mesh
from taichi_dem.mesh.joined import in_space_order
from taichi_dem.mesh.mesh import with_cut
from taichi_dem.mesh.shapes import bar, placed_together

ORE = ("ore", lambda x: x[:, 0] > 0.5)
LOW = ("low", lambda x: x[:, 1] < 0.15)


def grouped():
    """A bar with two groups of bodies that have some in common."""
    return bar(1.0, 0.3, (4, 2, 2)).body_group(*ORE).body_group(*LOW)


def assert_by_place(mesh, names=(ORE, LOW)):
    """Groups hold exactly the bodies that their predicates choose."""
    centres = mesh.points[mesh.tetrahedra].mean(axis=1)
    for name, chosen in names:
        assert np.array_equal(mesh.body_groups[name], np.flatnonzero(chosen(centres)))


def written_and_read(mesh, folder):
    write_mesh(folder / "mesh.msh", mesh)
    return read_mesh(folder / "mesh.msh")


KEPT = {
    "reordered": lambda mesh, _: in_space_order(mesh),
    "cut": lambda mesh, _: with_cut(mesh, "cut", (0.5, 0.0, 0.0), (1.0, 0.0, 0.0)),
    "bonded": lambda mesh, _: with_cut(mesh, "c", (0.5, 0, 0), (1, 0, 0)).bonded_by({"c": 0.5}),
    "mirrored": lambda mesh, _: mirrored_copies(mesh, 3),
    "written": written_and_read,
}


@pytest.mark.parametrize("made", KEPT)
def test_groups_are_kept(made, tmp_path):
    mesh = KEPT[made](grouped(), tmp_path)
    assert_by_place(mesh)


def test_parts_that_are_placed_together_are_groups():
    mesh = grouped()
    both = placed_together({"a": (mesh, (0, 0, 0)), "b": (mesh, (3, 0, 0))})
    count = mesh.body_count
    assert np.array_equal(both.body_groups["b"], np.arange(count, 2 * count))
    assert np.array_equal(both.body_groups["b_ore"], count + mesh.body_groups["ore"])
    assert len(both.body_groups["ore"]) == 2 * len(mesh.body_groups["ore"])
