"""Meshes come back from files as they were written, with the groups of their faces and bodies."""

import meshio
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from _meshes import group_area
from make_meshes import write
from taichi_dem import PAPER_BLOCK, InputError, checked_mesh, read_mesh, shapes
from taichi_dem.mesh.files import write_mesh, write_vtu
from taichi_dem.mesh.mesh import volumes
from taichi_dem.mesh.shapes import bar
from tests.bad_input.refusals import assert_refused, steady

BAR = bar(1.0, 0.3, (3, 1, 2))

try:
    import gmsh
except (ImportError, OSError):  # OSError: installed, but a system library is missing
    gmsh = None
NEEDS_GMSH = pytest.mark.skipif(gmsh is None, reason="gmsh is not installed")
VARIANTS = pytest.mark.parametrize(
    ("version", "binary"), [(2.2, 0), (2.2, 1), (4.1, 0), (4.1, 1)], ids=str
)
ANY = st.text(st.characters(codec="utf-8", exclude_categories=("C", "Z"), exclude_characters='"|'))
#: Names that a reader may take for another, beside any.
NAME = st.sampled_from(["rock", "physical_1", "bodies", "0", "a\\", "'", "#"]) | ANY.filter(bool)


def assert_same(mesh, other):
    """Same arrays, bit for bit, and the same groups."""
    assert np.array_equal(mesh.points, other.points)
    assert np.array_equal(mesh.tetrahedra, other.tetrahedra)
    for kind in ("groups", "body_groups"):
        mine, others = getattr(mesh, kind), getattr(other, kind)
        assert mine.keys() == others.keys()
        assert all(np.array_equal(mine[name], others[name]) for name in mine)


@pytest.fixture
def gmsh_box():
    """A meshed box in an open Gmsh session; left and right are named, front has a number only."""
    gmsh.initialize(interruptible=False, readConfigFiles=False)
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.model.occ.addBox(0, 0, 0, 2, 1, 1)
    gmsh.model.occ.synchronize()
    for tag, surfaces, name in ((1, [1], "left"), (2, [2], "right"), (3, [1, 2], "ends")):
        gmsh.model.addPhysicalGroup(2, surfaces, tag, name=name)
    gmsh.model.addPhysicalGroup(2, [6], 7)
    gmsh.model.addPhysicalGroup(3, [1], 1, name="box")  # the same number in another dimension
    gmsh.option.setNumber("Mesh.MeshSizeMax", 0.5)
    yield gmsh.model.mesh
    gmsh.finalize()


def test_a_written_mesh_comes_back_bit_for_bit(tmp_path):
    mesh = read_mesh(PAPER_BLOCK)
    write_mesh(tmp_path / "mesh.msh", mesh)
    assert_same(read_mesh(tmp_path / "mesh.msh"), mesh)


@steady
@given(
    faces=st.dictionaries(NAME, st.sampled_from(sorted(BAR.groups)), max_size=4),
    bodies=st.dictionaries(
        NAME, st.sets(st.integers(0, BAR.body_count - 1), min_size=1), min_size=1, max_size=3
    ),
)
def test_drawn_names_of_groups_come_back(tmp_path_factory, faces, bodies):
    """Also one that faces and bodies have both; "|" joins names of bodies."""
    groups = {name: BAR.groups[side] for name, side in {**faces, "rock": "left"}.items()}
    members = {name: sorted(chosen) for name, chosen in {**bodies, "rock": {0, 5}}.items()}
    mesh = checked_mesh(BAR.points, BAR.tetrahedra, groups, body_groups=members)
    path = tmp_path_factory.mktemp("m") / "mesh.msh"
    write_mesh(path, mesh)
    assert_same(read_mesh(path), mesh)


@NEEDS_GMSH
@VARIANTS
def test_every_gmsh_format_keeps_groups_and_straight_elements(tmp_path, gmsh_box, version, binary):
    """Groups overlap, one has no name, and elements of the second order are as linear ones."""
    gmsh.option.setNumber("Mesh.MshFileVersion", version)
    gmsh.option.setNumber("Mesh.Binary", binary)
    gmsh_box.generate(3)
    gmsh.write(str(tmp_path / "linear.msh"))
    gmsh_box.setOrder(2)
    gmsh.write(str(tmp_path / "curved.msh"))
    mesh = read_mesh(tmp_path / "curved.msh")
    assert_same(mesh, read_mesh(tmp_path / "linear.msh"))
    assert set(mesh.groups) == {"left", "right", "ends", "physical_7"}
    assert np.all(mesh.points[mesh.group_faces("left")][..., 0] == 0.0)
    assert np.all(mesh.points[mesh.group_faces("physical_7")][..., 2] == 1.0)
    left, right = (len(mesh.group_faces(name)) for name in ("left", "right"))
    assert len(mesh.group_faces("ends")) == left + right > left > 0


@pytest.mark.parametrize("ending", ["vtk", "vtu", "inp"])
def test_other_formats_are_read_in_the_unit_that_is_told(tmp_path, ending):
    path = tmp_path / f"mesh.{ending}"
    meshio.write(path, meshio.Mesh(1e3 * BAR.points, [("tetra", BAR.tetrahedra)]))
    mesh = read_mesh(path, scale=1e-3)
    assert np.allclose(mesh.points, BAR.points, rtol=1e-15)
    assert np.array_equal(mesh.tetrahedra, BAR.tetrahedra)


def test_integer_data_become_groups_and_sets_that_are_not_read_are_told(tmp_path):
    left, right = BAR.groups["left"], BAR.groups["right"]
    cells = [("tetra", BAR.tetrahedra), ("triangle", np.vstack([left, right]))]
    wall = np.repeat([3, 5], [len(left), len(right)])
    data = {"wall": [np.arange(BAR.body_count) % 2, wall]}
    content = meshio.Mesh(BAR.points, cells, cell_data=data)
    meshio.write(tmp_path / "mesh.vtu", content)
    mesh = read_mesh(tmp_path / "mesh.vtu")
    assert np.array_equal(mesh.group_faces("wall_3"), left)
    assert mesh.group_bodies("wall_1").tolist() == list(range(1, BAR.body_count, 2))
    content = meshio.Mesh(BAR.points, cells[:1], point_sets={"held": np.arange(3)})
    meshio.write(tmp_path / "mesh.inp", content)
    with pytest.warns(UserWarning, match="groups held are not read"):
        read_mesh(tmp_path / "mesh.inp")


@pytest.mark.parametrize("share", [0.5, 0.99])
def test_a_file_that_is_cut_off_is_refused(tmp_path, share):
    with open(PAPER_BLOCK, encoding="utf-8") as file:
        text = file.read()
    path = tmp_path / "half.msh"
    path.write_text(text[: int(share * len(text))])
    assert_refused(lambda: read_mesh(path), f"mesh file {path} ")


def test_a_vtu_holds_points_and_data_and_a_failed_one_leaves_the_old(tmp_path):
    path = tmp_path / "frame.vtu"
    speed = np.linspace(0.0, 1.0, BAR.body_count)
    write_vtu(path, BAR.points, BAR.tetrahedra, {"speed": speed})
    with pytest.raises(Exception, match=r".+"):
        write_vtu(path, BAR.points, BAR.tetrahedra, {"short": np.zeros(3)})
    raw = meshio.read(path)
    assert np.array_equal(raw.points, BAR.points)
    assert np.array_equal(raw.cell_data["speed"][0], speed)


@NEEDS_GMSH
def test_the_papers_block_is_what_gmsh_makes_of_it(tmp_path):
    write(tmp_path)
    with open(PAPER_BLOCK, "rb") as file:
        assert (tmp_path / "paper_block.msh").read_bytes() == file.read()


@NEEDS_GMSH
def test_a_closed_surface_is_filled_and_an_open_one_refused(tmp_path):
    size, path = np.array([0.2, 0.1, 0.1]), tmp_path / "box.stl"
    box = shapes.block(size, element=0.1)
    faces = np.vstack(list(box.groups.values()))
    meshio.write(path, meshio.Mesh(1e3 * box.points, [("triangle", faces)]))
    mesh = shapes.from_surface(path, element=0.03, scale=1e-3)
    assert volumes(mesh).sum() == pytest.approx(size.prod(), rel=1e-6)
    areas = sorted(group_area(mesh, name) for name in mesh.groups)
    assert areas == pytest.approx([0.01, 0.01, 0.02, 0.02, 0.02, 0.02], rel=1e-6)
    meshio.write(path, meshio.Mesh(box.points, [("triangle", faces[1:])]))
    with pytest.raises(InputError, match="must be closed"):
        shapes.from_surface(path, element=0.03)
