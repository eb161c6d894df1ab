"""Groups of faces and of bodies come back from a file by name, or are refused in words."""

import meshio
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from taichi_dem import checked_mesh, read_mesh
from taichi_dem.mesh.files import write_mesh
from taichi_dem.mesh.shapes import bar
from tests.bad_input.refusals import assert_refused, steady
from tests.unit.test_mesh_files import NEEDS_GMSH, VARIANTS, gmsh, gmsh_box  # noqa: F401

BAR = bar(1.0, 0.3, (3, 1, 2))
ANY = st.text(st.characters(codec="utf-8", exclude_categories=("C", "Z"), exclude_characters='"'))
#: Names that a reader may take for another, beside any.
NAMES = st.sampled_from(
    ["rock", "physical_1", "physical_2", "bodies", "0", "a\\", "a\\\\b", "'", "#"]
)
NAME = NAMES | ANY.filter(bool)


def again(mesh, folder):
    write_mesh(folder / "mesh.msh", mesh)
    return read_mesh(folder / "mesh.msh")


def assert_same_groups(mesh, other):
    """The same names in each kind, and the same members."""
    for kind in ("groups", "body_groups"):
        mine, others = getattr(mesh, kind), getattr(other, kind)
        assert mine.keys() == others.keys()
        assert all(np.array_equal(mine[name], others[name]) for name in mine)


@steady
@given(
    faces=st.dictionaries(NAME, st.sampled_from(sorted(BAR.groups)), max_size=4),
    bodies=st.dictionaries(
        NAME, st.sets(st.integers(0, BAR.body_count - 1), min_size=1), min_size=1, max_size=3
    ),
)
@pytest.mark.parametrize("shared", [None, "rock", "physical_1"])
def test_drawn_names_come_back(tmp_path_factory, shared, faces, bodies):
    """Also one that faces and bodies have both; "|" joins names of bodies and is refused there."""
    if shared:
        faces, bodies = {**faces, shared: "left"}, {**bodies, shared: {0, 5}}
    groups = {name: BAR.groups[side] for name, side in faces.items()}
    members = {name: sorted(chosen) for name, chosen in bodies.items()}
    mesh = checked_mesh(BAR.points, BAR.tetrahedra, groups, body_groups=members)
    if any("|" in name for name in bodies):
        assert_refused(lambda: again(mesh, tmp_path_factory.mktemp("m")), "name without '|'")
    else:
        assert_same_groups(again(mesh, tmp_path_factory.mktemp("m")), mesh)


@NEEDS_GMSH
@VARIANTS
def test_a_name_of_every_dimension_is_kept(tmp_path, gmsh_box, version, binary):  # noqa: F811
    """Edges, faces that are in other groups too, and the volume, all of one name."""
    gmsh.model.removePhysicalGroups([(3, 1)])  # "box": version 2.2 would hold each body twice
    add = gmsh.model.addPhysicalGroup
    for dimension, entities, tag in ((1, [1], 3), (2, [1, 2], 20), (3, [1], 31)):
        add(dimension, entities, tag, name="rock")
    gmsh_box.generate(3)
    gmsh.option.setNumber("Mesh.MshFileVersion", version)
    gmsh.option.setNumber("Mesh.Binary", binary)
    gmsh.write(str(tmp_path / "box.msh"))
    mesh = read_mesh(tmp_path / "box.msh")
    assert {*mesh.groups} == {"left", "right", "ends", "rock", "physical_7"}
    assert {*mesh.body_groups} == {"rock"}
    assert len(mesh.group_bodies("rock")) == mesh.body_count
    assert np.array_equal(mesh.group_faces("rock"), mesh.group_faces("ends"))
    assert ("rock", "lines") in mesh.unread
    assert_same_groups(again(mesh, tmp_path), mesh)


@pytest.mark.parametrize("dimension", [2, 3])
def test_a_number_that_another_group_has_for_a_name_is_refused(tmp_path, dimension):
    """A group without a name is called by its number, and must not become part of another."""
    half = np.repeat([5, 6], BAR.body_count // 2)
    sides = np.vstack([BAR.groups["left"], BAR.groups["right"]])
    cells = [("tetra", BAR.tetrahedra), ("triangle", sides)]
    tags = [half, np.repeat([5, 6], len(sides) // 2)]
    data = {"gmsh:physical": tags, "gmsh:geometrical": tags}
    names = {"physical_5": np.array([6, dimension])}
    raw = meshio.Mesh(BAR.points, cells, cell_data=data, field_data=names)
    meshio.write(tmp_path / "mesh.msh", raw, file_format="gmsh22", binary=False)
    words = "mesh file", "group of number 5 must have a name", "'physical_5'"
    assert_refused(lambda: read_mesh(tmp_path / "mesh.msh"), *words)
