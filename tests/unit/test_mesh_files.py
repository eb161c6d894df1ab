"""Mesh files: what is written comes back, foreign formats are read, bad files are refused."""

import os
import sys
import xml.etree.ElementTree as ElementTree

import meshio
import numpy as np
import pytest

from taichi_dem import PAPER_BLOCK, InputError, checked_mesh, read_mesh
from taichi_dem.mesh.files import write_mesh, write_pvd, write_vtu
from taichi_dem.mesh.gmsh import block_with_hole
from taichi_dem.mesh.shapes import bar, single

BAR = bar(1.0, 0.3, (3, 1, 2))

try:
    import gmsh
except (ImportError, OSError):  # OSError: installed, but a system library is missing
    gmsh = None
NEEDS_GMSH = pytest.mark.skipif(gmsh is None, reason="gmsh is not installed")
VARIANTS = pytest.mark.parametrize(
    ("version", "binary"), [(2.2, 0), (2.2, 1), (4.1, 0), (4.1, 1)], ids=str
)


def assert_same(mesh, other):
    """Same arrays, bit for bit, and the same groups."""
    assert np.array_equal(mesh.points, other.points)
    assert np.array_equal(mesh.tetrahedra, other.tetrahedra)
    assert mesh.groups.keys() == other.groups.keys()
    for name in mesh.groups:
        assert np.array_equal(mesh.groups[name], other.groups[name])


def refused(*arguments, **options):
    """The sentence with which the file is refused."""
    with pytest.raises(InputError) as caught:
        read_mesh(*arguments, **options)
    assert "\n" not in str(caught.value)
    return str(caught.value)


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


@pytest.mark.parametrize("mesh", [BAR, read_mesh(PAPER_BLOCK)], ids=["bar", "block"])
def test_written_mesh_comes_back_bit_for_bit(tmp_path, mesh):
    path = tmp_path / "mesh.msh"
    write_mesh(path, mesh)
    again = read_mesh(path)
    assert_same(again, mesh)
    assert (again.notes, again.source) == ((), str(path))
    assert os.listdir(tmp_path) == ["mesh.msh"]


def test_mesh_without_groups_comes_back(tmp_path):
    mesh = checked_mesh(BAR.points, BAR.tetrahedra, {})
    write_mesh(tmp_path / "mesh.msh", mesh)
    assert_same(read_mesh(tmp_path / "mesh.msh"), mesh)


def test_group_names_with_spaces_and_other_letters_come_back(tmp_path):
    mesh = checked_mesh(BAR.points, BAR.tetrahedra, {"freie Fläche 1": BAR.groups["top"]})
    write_mesh(tmp_path / "mesh.msh", mesh)
    assert list(read_mesh(tmp_path / "mesh.msh").groups) == ["freie Fläche 1"]


@NEEDS_GMSH
@VARIANTS
def test_every_gmsh_format_gives_the_same_mesh(tmp_path, version, binary):
    path = str(tmp_path / "again.msh")
    gmsh.initialize(interruptible=False, readConfigFiles=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.open(PAPER_BLOCK)
        gmsh.option.setNumber("Mesh.MshFileVersion", version)
        gmsh.option.setNumber("Mesh.Binary", binary)
        gmsh.write(path)
    finally:
        gmsh.finalize()
    expected, mesh = read_mesh(PAPER_BLOCK), read_mesh(path)
    assert np.allclose(mesh.points, expected.points, rtol=1e-15, atol=1e-16)
    assert np.array_equal(mesh.tetrahedra, expected.tetrahedra)
    assert mesh.groups.keys() == expected.groups.keys()
    for name, faces in expected.groups.items():
        assert np.array_equal(mesh.groups[name], faces)


@NEEDS_GMSH
@VARIANTS
def test_overlapping_and_nameless_gmsh_groups_are_whole(tmp_path, gmsh_box, version, binary):
    gmsh_box.generate(3)
    gmsh.option.setNumber("Mesh.MshFileVersion", version)
    gmsh.option.setNumber("Mesh.Binary", binary)
    gmsh.write(str(tmp_path / "box.msh"))
    mesh = read_mesh(tmp_path / "box.msh")
    assert set(mesh.groups) == {"left", "right", "ends", "physical_7"}
    assert np.all(mesh.points[mesh.group_faces("left")][..., 0] == 0.0)
    assert np.all(mesh.points[mesh.group_faces("right")][..., 0] == 2.0)
    assert np.all(mesh.points[mesh.group_faces("physical_7")][..., 2] == 1.0)
    left, right = (len(mesh.group_faces(name)) for name in ("left", "right"))
    assert len(mesh.group_faces("ends")) == left + right > left > 0


@NEEDS_GMSH
@VARIANTS
def test_second_order_elements_are_read_as_linear(tmp_path, gmsh_box, version, binary):
    gmsh_box.generate(3)
    gmsh.option.setNumber("Mesh.MshFileVersion", version)
    gmsh.option.setNumber("Mesh.Binary", binary)
    gmsh.write(str(tmp_path / "linear.msh"))
    gmsh_box.setOrder(2)
    gmsh.write(str(tmp_path / "curved.msh"))
    linear, curved = (read_mesh(tmp_path / f"{name}.msh") for name in ("linear", "curved"))
    assert_same(curved, linear)
    assert any("second-order elements as linear" in note for note in curved.notes)
    assert any("points that belong to no tetrahedron" in note for note in curved.notes)


def with_middles(mesh):
    """Points and ten-node bodies of the second order, in the order of VTK."""
    ends = mesh.tetrahedra[:, [[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]]]
    middles = mesh.points[ends].mean(axis=2).reshape(-1, 3)
    numbers = mesh.point_count + np.arange(len(middles)).reshape(-1, 6)
    return np.vstack([mesh.points, middles]), np.hstack([mesh.tetrahedra, numbers])


def test_ten_node_tetrahedra_are_read_as_linear(tmp_path):
    points, bodies = with_middles(BAR)
    meshio.write(tmp_path / "mesh.vtu", meshio.Mesh(points, [("tetra10", bodies)]))
    mesh = read_mesh(tmp_path / "mesh.vtu")
    assert np.array_equal(mesh.tetrahedra, BAR.tetrahedra)
    assert np.array_equal(mesh.points, BAR.points)
    assert mesh.notes[0] == "read 36 second-order elements as linear tetra10"


@pytest.mark.parametrize("ending", ["vtk", "vtu", "mesh", "inp"])
def test_other_formats_are_read(tmp_path, ending):
    path = tmp_path / f"mesh.{ending}"
    meshio.write(path, meshio.Mesh(BAR.points, [("tetra", BAR.tetrahedra)]))
    mesh = read_mesh(path)
    assert np.allclose(mesh.points, BAR.points, rtol=1e-15)
    assert np.array_equal(mesh.tetrahedra, BAR.tetrahedra)


@pytest.mark.parametrize("ending", ["vtk", "vtu"])
def test_integer_data_on_triangles_become_groups(tmp_path, ending):
    left, right = BAR.groups["left"], BAR.groups["right"]
    cells = [("tetra", BAR.tetrahedra), ("triangle", np.vstack([left, right]))]
    wall = np.repeat([3, 5], [len(left), len(right)])
    data = {
        "wall": [np.zeros(BAR.body_count, dtype=int), wall],
        "heat": [np.zeros(BAR.body_count), wall * 0.5],
    }
    meshio.write(tmp_path / f"mesh.{ending}", meshio.Mesh(BAR.points, cells, cell_data=data))
    mesh = read_mesh(tmp_path / f"mesh.{ending}")
    assert sorted(mesh.groups) == ["wall_3", "wall_5"]
    assert np.array_equal(mesh.group_faces("wall_3"), left)
    assert np.array_equal(mesh.group_faces("wall_5"), right)


@pytest.mark.parametrize("scale", [1e-3, 2.0])
def test_scale_turns_the_files_unit_into_metres(tmp_path, scale):
    write_mesh(tmp_path / "mesh.msh", BAR)
    mesh = read_mesh(tmp_path / "mesh.msh", scale=scale)
    assert np.array_equal(mesh.points, scale * BAR.points)


@pytest.mark.parametrize("scale", [0.0, -1.0, np.nan, np.inf, "mm"])
def test_senseless_scale_is_refused(scale):
    words = refused(PAPER_BLOCK, scale=scale)
    assert words.startswith("scale must be a positive finite number") and repr(scale) in words


def test_weld_tolerance_reaches_the_check(tmp_path):
    # Both halves of the pair have their own copies of the shared points.
    one = single()
    points = np.vstack([one.points, one.points * [-1, 1, 1]])
    bodies = np.vstack([one.tetrahedra, one.tetrahedra[:, [0, 1, 3, 2]] + 4])
    path = tmp_path / "mesh.vtu"
    write_vtu(path, points, bodies)
    assert "pass weld_tolerance=" in refused(path)
    assert read_mesh(path, weld_tolerance=1e-6).point_count == 5


def test_missing_file_is_refused(tmp_path):
    path = tmp_path / "no.msh"
    assert refused(path) == f"mesh file {path} does not exist"
    assert refused(tmp_path) == f"mesh file {tmp_path} is a folder"


@pytest.mark.parametrize("name", ["mesh.msh", "mesh.vtu", "mesh.vtk", "mesh.xyz", "mesh"])
@pytest.mark.parametrize("content", ["", "not a mesh\n", "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n"])
def test_unreadable_file_is_refused_without_noise(tmp_path, capfd, name, content):
    path = tmp_path / name
    path.write_text(content)
    assert refused(path).startswith(f"mesh file {path} ")
    assert tuple(capfd.readouterr()) == ("", "")


@pytest.mark.parametrize("share", [0.2, 0.5, 0.8, 0.99])
def test_cut_off_file_is_refused(tmp_path, share):
    with open(PAPER_BLOCK, encoding="utf-8") as file:
        text = file.read()
    path = tmp_path / "half.msh"
    path.write_text(text[: int(share * len(text))])
    assert refused(path).startswith(f"mesh file {path} ")


def test_file_without_tetrahedra_is_refused_with_what_it_holds(tmp_path):
    path = tmp_path / "flat.vtu"
    meshio.write(path, meshio.Mesh(BAR.points, [("triangle", BAR.groups["top"])]))
    said = refused(path)
    assert said.startswith(f"mesh file {path} holds no tetrahedra (it holds: triangle): fill this")
    assert "save it as surface.stl, echo 'Merge" in said


def test_bad_mesh_in_a_file_is_refused_with_its_name(tmp_path):
    path = tmp_path / "flat.vtu"
    write_vtu(path, [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1.0, 1.0, 0]], np.array([[0, 1, 2, 3]]))
    assert refused(path).startswith(f"mesh file {path}: 1 tetrahedra have no volume")


def test_vtu_holds_points_and_data(tmp_path):
    path = tmp_path / "frame.vtu"
    speed = np.linspace(0.0, 1.0, BAR.body_count)
    moved = np.random.default_rng(1).normal(size=BAR.points.shape)
    write_vtu(path, BAR.points, BAR.tetrahedra, {"displacement": moved}, {"speed": speed})
    raw = meshio.read(path)
    assert np.array_equal(raw.points, BAR.points)
    assert np.array_equal(raw.cells_dict["tetra"], BAR.tetrahedra)
    assert np.array_equal(raw.point_data["displacement"], moved)
    assert np.array_equal(raw.cell_data["speed"][0], speed)
    assert os.listdir(tmp_path) == ["frame.vtu"]


def test_vtu_is_compressed(tmp_path):
    mesh = read_mesh(PAPER_BLOCK)
    path = tmp_path / "frame.vtu"
    write_vtu(path, mesh.points, mesh.tetrahedra, cell_data={"zero": np.zeros((966, 100))})
    assert path.stat().st_size < 966 * 100 * 8 / 5


def test_pvd_lists_every_file_at_its_exact_time(tmp_path):
    times = [0.0, 1e-7, 0.1 + 0.2]
    write_pvd(tmp_path / "run.pvd", np.array(times), ["a.vtu", "b.vtu", "c & d.vtu"])
    root = ElementTree.parse(tmp_path / "run.pvd").getroot()
    assert root.get("type") == "Collection"
    sets = list(root.iter("DataSet"))
    assert [float(one.get("timestep")) for one in sets] == times
    assert [one.get("file") for one in sets] == ["a.vtu", "b.vtu", "c & d.vtu"]
    assert os.listdir(tmp_path) == ["run.pvd"]


def test_pvd_of_unequal_lists_is_refused(tmp_path):
    with pytest.raises(InputError, match="2 times, but 1 file names"):
        write_pvd(tmp_path / "run.pvd", [0.0, 1.0], ["a.vtu"])


@pytest.mark.parametrize(
    "write",
    [
        lambda path: write_mesh(path, BAR),
        lambda path: write_vtu(path, BAR.points, BAR.tetrahedra),
        lambda path: write_pvd(path, [0.0], ["a.vtu"]),
    ],
)
def test_writing_into_a_missing_folder_is_refused(tmp_path, write):
    path = tmp_path / "no" / "file"
    with pytest.raises(InputError, match="there is no folder"):
        write(path)
    assert os.listdir(tmp_path) == []


def test_failed_write_leaves_the_old_file(tmp_path):
    path = tmp_path / "frame.vtu"
    path.write_text("old")
    with pytest.raises(Exception, match=r".+"):
        write_vtu(path, BAR.points, BAR.tetrahedra, cell_data={"short": np.zeros(3)})
    assert path.read_text() == "old" and os.listdir(tmp_path) == ["frame.vtu"]


# Meshes made with Gmsh.


def test_missing_gmsh_is_said_with_the_way_to_get_it(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "gmsh", None)
    with pytest.raises(InputError, match=r"needs gmsh .*pip install gmsh, or run make mesh"):
        block_with_hole(tmp_path / "block.msh")


@NEEDS_GMSH
def test_stored_block_is_what_the_generator_writes_twice(tmp_path):
    block_with_hole(tmp_path / "a.msh")
    block_with_hole(tmp_path / "b.msh")
    assert (tmp_path / "a.msh").read_bytes() == (tmp_path / "b.msh").read_bytes()
    mesh, stored = read_mesh(tmp_path / "a.msh"), read_mesh(PAPER_BLOCK)
    # Another release of Gmsh may place points otherwise; groups and sizes hold.
    assert mesh.groups.keys() == stored.groups.keys()
    assert abs(mesh.body_count - stored.body_count) < 100


@NEEDS_GMSH
def test_block_follows_its_parameters(tmp_path):
    block_with_hole(
        tmp_path / "block.msh",
        **{"width": 1.0, "height": 0.8, "depth": 0.1, "hole": (0.3, 0.5), "hole_diameter": 0.2},
        **{"hole_segments": 12, "size_hole": 0.05, "size_far": 0.2, "distance_far": 0.5},
    )
    mesh = read_mesh(tmp_path / "block.msh")
    assert mesh.points.min(axis=0) == pytest.approx([0, 0, 0], abs=1e-15)
    assert mesh.points.max(axis=0) == pytest.approx([1.0, 0.8, 0.1])
    wall = np.unique(np.round(mesh.points[np.unique(mesh.group_faces("hole"))][:, :2], 6), axis=0)
    assert len(wall) == 12
    assert np.hypot(*(wall - [0.3, 0.5]).T) == pytest.approx(0.1, abs=2e-6)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"depth": 0.0}, "depth must be a positive finite number"),
        ({"size_far": "coarse"}, "size_far must be a positive finite number"),
        ({"hole_segments": 6}, "hole_segments must be 4, 8, 12"),
        ({"hole": (1.99, 1.0)}, "hole must be (x, y) with x in (0.025, 1.975) m"),
        ({"hole": (1.0, -1.0)}, "got (1.0, -1.0)"),
    ],
)
def test_impossible_block_is_refused(tmp_path, options, words):
    with pytest.raises(InputError) as caught:
        block_with_hole(tmp_path / "block.msh", **options)
    assert words in str(caught.value)
    assert os.listdir(tmp_path) == []
