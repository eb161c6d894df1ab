"""Named groups of bodies: from files and predicates, kept by all that makes a mesh of a mesh."""

import pickle
from dataclasses import replace

import meshio
import numpy as np
import pytest

from taichi_dem import InputError, checked_mesh, read_mesh, with_body_group
from taichi_dem.mesh.face_groups import with_cut
from taichi_dem.mesh.files import write_mesh
from taichi_dem.mesh.reorder import in_space_order
from taichi_dem.mesh.shapes import bar, mirrored_copies, placed_together, with_moved_nodes

ORE = ("ore", lambda x: x[:, 0] > 0.5)
LOW = ("low", lambda x: x[:, 1] < 0.15)


def grouped():
    """A bar with two groups of bodies that have some in common."""
    return with_body_group(with_body_group(bar(1.0, 0.3, (4, 2, 2)), *ORE), *LOW)


def assert_by_place(mesh, names=(ORE, LOW)):
    """Groups hold exactly the bodies that their predicates choose."""
    centres = mesh.points[mesh.tetrahedra].mean(axis=1)
    for name, chosen in names:
        assert np.array_equal(mesh.body_groups[name], np.flatnonzero(chosen(centres)))


def written_and_read(mesh, folder):
    write_mesh(folder / "mesh.msh", mesh)
    return read_mesh(folder / "mesh.msh")


KEPT = {
    "replaced": lambda mesh, _: replace(mesh, notes=("said",)),
    "pickled": lambda mesh, _: pickle.loads(pickle.dumps(mesh)),
    "reordered": lambda mesh, _: in_space_order(mesh),
    "cut": lambda mesh, _: with_cut(mesh, "cut", (0.5, 0.0, 0.0), (1.0, 0.0, 0.0)),
    "bonded": lambda mesh, _: with_cut(mesh, "c", (0.5, 0, 0), (1, 0, 0)).bonded_by({"c": 0.5}),
    "moved": lambda mesh, _: with_moved_nodes(mesh, 0.0, seed=1),
    "mirrored": lambda mesh, _: mirrored_copies(mesh, 3),
    "written": written_and_read,
}


@pytest.mark.parametrize("made", KEPT)
def test_groups_are_kept(made, tmp_path):
    mesh = KEPT[made](grouped(), tmp_path)
    assert_by_place(mesh)
    assert not mesh.body_groups["ore"].flags.writeable
    assert mesh.body_groups["ore"].dtype == np.int32


def test_a_group_of_no_other_is_written_too_and_bodies_in_no_group_are_in_none(tmp_path):
    alone = with_body_group(bar(1.0, 0.3, (4, 2, 2)), *ORE)
    assert list(written_and_read(alone, tmp_path).body_groups) == ["ore"]
    assert_by_place(written_and_read(alone, tmp_path), [ORE])
    twice = replace(alone, body_groups={"a|b": [1]})
    with pytest.raises(InputError, match=r"must have a name without '\|' in a file, got 'a\|b'"):
        write_mesh(tmp_path / "mesh.msh", twice)


def test_parts_that_are_placed_together_are_groups():
    mesh = grouped()
    both = placed_together({"a": (mesh, (0, 0, 0)), "b": (mesh, (3, 0, 0))})
    count = mesh.body_count
    assert np.array_equal(both.body_groups["b"], np.arange(count, 2 * count))
    assert np.array_equal(both.body_groups["b_ore"], count + mesh.body_groups["ore"])
    assert len(both.body_groups["ore"]) == 2 * len(mesh.body_groups["ore"])


def boxes(**more):
    """Two hexahedra side by side as meshio holds them, with points that are there twice."""
    box = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], dtype=float)
    box = np.vstack([box, box + np.array([0, 0, 1])])
    points = np.vstack([box, box + np.array([1, 0, 0])])
    return meshio.Mesh(points, [("hexahedron", np.arange(16).reshape(2, 8))], **more)


@pytest.mark.parametrize(
    ("name", "more", "group"),
    [
        ("mesh.vtu", {"cell_data": {"rock": [np.array([3, 7])]}}, "rock_7"),
        ("mesh.inp", {"cell_sets": {"right": [np.array([1])]}}, "right"),
    ],
)
def test_cells_that_are_cut_keep_their_groups_through_welding(tmp_path, name, more, group):
    meshio.write(tmp_path / name, boxes(**more))
    mesh = read_mesh(tmp_path / name, weld_tolerance=1e-6)
    assert mesh.point_count == 12
    assert_by_place(mesh, [(group, lambda x: x[:, 0] > 1.0)])


def test_groups_are_refused_in_words():
    mesh = grouped()
    arrays = mesh.points, mesh.tetrahedra, {}
    for groups, words in (
        ({"ore": [mesh.body_count]}, f"body numbers from 0 to {mesh.body_count - 1}, got 96"),
        ({"ore": [-1]}, "got -1"),
        ({"ore": [0.5]}, "must be a list of at least one body number"),
        ({"ore": []}, "must be a list of at least one body number"),
        ({3: [0]}, "name of a body group"),
        ([0], "body_groups must be a dict of name to bodies"),
    ):
        with pytest.raises(InputError, match=words):
            checked_mesh(*arrays, body_groups=groups)
    with pytest.raises(InputError, match=r"no body group 'none'; its body groups are: low, ore"):
        mesh.group_bodies("none")
    with pytest.raises(InputError, match=r"\(left is a group of faces: make one of bodies\)"):
        mesh.group_bodies("left")
    with pytest.raises(InputError, match=r"\(ore is a group of bodies: make one of faces\)"):
        mesh.group_faces("ore")


@pytest.mark.parametrize(
    ("name", "chosen", "words"),
    [
        ("ore", lambda x: x[:, 0] > 0.5, "name must be that of a new group, got 'ore'"),
        ("all", lambda x: x[:, 0] > 9.0, "group all must have at least one body"),
        ("all", lambda x: x[:, 0], "one truth value for each of 96 bodies"),
        ("all", 3, "must be a function of centres of bodies"),
    ],
)
def test_choices_are_refused_in_words(name, chosen, words):
    with pytest.raises(InputError, match=words):
        with_body_group(grouped(), name, chosen)
