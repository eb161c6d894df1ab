"""What mesh files hold beside tetrahedra: cells that are cut, and what is told or refused."""

import os
import re
import shlex
import subprocess

import meshio
import numpy as np
import pytest

from taichi_dem import InputError, read_mesh
from taichi_dem.mesh.mesh import volumes
from taichi_dem.mesh.reorder import in_space_order
from taichi_dem.mesh.shapes import bar
from taichi_dem.mesh.split import triangles_in
from taichi_dem.mesh.tetrahedra import all_faces, area_vectors
from taichi_dem.mesh.topology import topology_of

BAR = bar(1.0, 0.3, (3, 1, 2))

try:
    import gmsh
except (ImportError, OSError):  # OSError: installed, but a system library is missing
    gmsh = None


def refused(path):
    """The sentence with which the file is refused."""
    with pytest.raises(InputError) as caught:
        read_mesh(path)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def boxes(cells=(3, 2, 2), seed=1):
    """Points of a warped grid and the corners of its boxes, in the order of VTK."""
    nx, ny, nz = cells
    index = np.arange((nx + 1) * (ny + 1) * (nz + 1)).reshape(nx + 1, ny + 1, nz + 1)
    random = np.random.default_rng(seed)
    points = np.argwhere(index >= 0) + 0.1 * random.standard_normal((index.size, 3))
    shuffled = random.permutation(index.size)  # the lowest corner may be any
    steps = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
    steps += [(i, j, 1) for i, j, _ in steps]
    corners = [index[a : nx + a, b : ny + b, c : nz + c].ravel() for a, b, c in steps]
    moved = np.empty_like(points)
    moved[shuffled] = points
    return moved, shuffled[np.stack(corners, axis=1)]


def pyramids(points, cells):
    """Six pyramids in every box, around its middle."""
    middle = len(points) + np.arange(len(cells))
    bases = [(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]
    made = [np.column_stack([cells[:, base], middle]) for base in bases]
    return np.vstack([points, points[cells].mean(axis=1)]), np.vstack(made)


def cut_kinds():
    """Points and cells of every kind that is cut, with the tetrahedra that one cell gives."""
    points, cells = boxes()
    prisms = np.vstack([cells[:, [0, 1, 3, 4, 5, 7]], cells[:, [1, 2, 3, 5, 6, 7]]])
    mirrored = prisms[:, [0, 2, 1, 3, 5, 4]]
    tops, pointed = pyramids(points, cells)
    extra = np.hstack([cells, np.zeros((len(cells), 12), dtype=int)])  # nodes on the edges
    return {
        "hexahedron": (points, cells, 6),
        "hexahedron20": (points, extra, 6),
        "wedge": (points, prisms, 3),
        "wedge of the other hand": (points, mirrored, 3),
        "pyramid": (tops, pointed, 2),
    }


@pytest.mark.parametrize("name", cut_kinds())
def test_solid_cells_are_cut_into_tetrahedra_that_fit_together(tmp_path, name):
    """Neighbours agree on the diagonals: no face is left over but the two of each outer square."""
    points, cells, each = cut_kinds()[name]
    kind = name.split()[0]
    meshio.write(tmp_path / "mesh.vtu", meshio.Mesh(points, [(kind, cells)]))
    mesh = read_mesh(tmp_path / "mesh.vtu")
    assert mesh.body_count == each * len(cells)
    named = "hexahedra" if kind == "hexahedron" else f"{kind}s"
    named = "hexahedron20 cells" if kind == "hexahedron20" else named
    assert f"cut {len(cells)} {named} into {mesh.body_count} tetrahedra" in mesh.notes
    assert not any("negative volume" in note for note in mesh.notes)
    # 3 x 2 x 2 boxes have 32 outer squares.
    top = topology_of(mesh)
    assert top.outer_count == 64 and 2 * top.bond_count + 64 == 4 * mesh.body_count
    # A closed surface of outward area vectors, that holds what the bodies fill.
    outer = all_faces(mesh.tetrahedra)[4 * top.outer_body + top.outer_face]
    area, middle = area_vectors(mesh.points, outer), mesh.points[outer].mean(axis=1)
    assert np.abs(area.sum(axis=0)).max() < 1e-12
    assert (area * middle).sum() / 3.0 == pytest.approx(volumes(mesh).sum(), rel=1e-12)


def test_groups_of_quadrangles_fit_the_cells_they_lie_on(tmp_path):
    points, cells = boxes()
    square = cells[:4, [0, 4, 7, 3]]  # the boxes with x = 0
    values = [np.zeros(len(cells), dtype=int), np.array([7, 7, 8, 8])]
    content = meshio.Mesh(
        points, [("hexahedron", cells), ("quad", square)], cell_data={"w": values}
    )
    meshio.write(tmp_path / "mesh.vtu", content)
    mesh = read_mesh(tmp_path / "mesh.vtu")
    assert {name: len(faces) for name, faces in mesh.groups.items()} == {"w_7": 4, "w_8": 4}


def test_hexahedra_beside_tetrahedra_leave_no_holes(tmp_path):
    points, cells = boxes((1, 1, 1))
    apex = np.vstack([points, points.mean(axis=0) + np.array([0.0, 0.0, 2.0])])
    top = triangles_in(cells[:, 4:])
    tetrahedra = np.column_stack([top, np.full(2, 8)])
    content = meshio.Mesh(apex, [("hexahedron", cells), ("tetra", tetrahedra)])
    meshio.write(tmp_path / "mesh.vtu", content)
    mesh = read_mesh(tmp_path / "mesh.vtu")
    assert mesh.body_count == 8 and topology_of(mesh).bond_count == 6 + 2 + 1


@pytest.mark.parametrize("wrong", [-1, 10**10])
def test_hexahedra_of_points_that_are_not_there_are_refused(tmp_path, wrong):
    points, cells = boxes((1, 1, 1))
    cells[0, 3] = wrong
    meshio.write(tmp_path / "mesh.vtu", meshio.Mesh(points, [("hexahedron", cells)]))
    assert "point numbers must lie in [0, 7]" in refused(tmp_path / "mesh.vtu")


def test_cells_that_cannot_be_cut_are_refused(tmp_path):
    points, cells = boxes((1, 1, 1))
    faces = [cells[0, face] for face in ([0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4])]
    faces += [cells[0, face] for face in ([1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7])]
    meshio.write(tmp_path / "mesh.vtu", meshio.Mesh(points, [("polyhedron8", [faces])]))
    said = refused(tmp_path / "mesh.vtu")
    assert "polyhedron8 cells" in said and "ParaView's filter Tetrahedralize" in said


def test_stl_is_refused_with_the_lines_that_fill_it(tmp_path):
    outer = np.vstack(list(BAR.groups.values()))
    path = tmp_path / "part.stl"
    meshio.write(path, meshio.Mesh(BAR.points, [("triangle", outer)]))
    said = refused(path)
    lines = 'Merge "part.stl"; Surface Loop(1) = Surface{:}; Volume(1) = {1};'
    assert said.endswith(f"echo '{lines}' > fill.geo && gmsh -3 fill.geo -o filled.msh")
    if gmsh is not None:
        filled = filled_by_gmsh(tmp_path, f"{lines}\n")
        assert volumes(filled).sum() == pytest.approx(volumes(BAR).sum())


@pytest.mark.skipif(os.name == "nt", reason="the lines are for a POSIX shell")
@pytest.mark.parametrize(
    "name", ["my part.stl", "it's.stl", 'a"b.stl', "$HOME.stl", "a;b`c`.STL", "-x.stl", "é.stl"]
)
def test_the_lines_that_fill_an_stl_hold_for_any_name(tmp_path, name):
    """The script names a file that is there, and copying touches no other."""
    meshio.write(tmp_path / "a.stl", meshio.Mesh(BAR.points, [("triangle", BAR.groups["top"])]))
    os.rename(tmp_path / "a.stl", tmp_path / name)
    said = refused(str(tmp_path / name))
    line = said.split("pip install gmsh): ")[1].split(" && gmsh")[0]
    subprocess.run(["sh", "-c", line], cwd=tmp_path, check=True)
    script = (tmp_path / "fill.geo").read_text()
    merged = script.split('Merge "')[1].split('"; ')[0]
    assert (tmp_path / merged).read_bytes() == (tmp_path / name).read_bytes()
    assert {path.name for path in tmp_path.iterdir()} == {name, merged, "fill.geo"}
    assert shlex.quote(merged) == merged or merged == "é.stl"


VOXELS = """# vtk DataFile Version 3.0
one voxel
ASCII
DATASET UNSTRUCTURED_GRID
POINTS 8 float
0 0 0 1 0 0 0 1 0 1 1 0 0 0 1 1 0 1 0 1 1 1 1 1
CELLS 1 9
8 0 1 2 3 4 5 6 7
CELL_TYPES 1
11
"""


def test_voxels_are_refused_in_words(tmp_path):
    (tmp_path / "mesh.vtk").write_text(VOXELS)
    said = refused(tmp_path / "mesh.vtk")
    assert "holds cells of a type that meshio does not know, such as voxels: split them" in said


@pytest.mark.parametrize("beside", [False, True])
def test_voxels_that_meshio_passes_over_are_told(tmp_path, beside):
    """In a VTU it drops them without an error; beside others they would leave holes."""
    points, cells = boxes((1, 1, 1))
    kinds = [("hexahedron", cells), ("hexahedron", cells)]
    content = meshio.Mesh(np.vstack([points, points + 9.0]), kinds[: 1 + beside])
    content.cells[-1].data = content.cells[-1].data + 8
    meshio.write(tmp_path / "mesh.vtu", content, binary=False)
    text = (tmp_path / "mesh.vtu").read_text()
    types = re.search(r'(Name="types"[^>]*>)\s*((?:12\s*)+)<', text)
    voxels = "12\n11\n" if beside else "11\n"
    (tmp_path / "mesh.vtu").write_text(text.replace(types[0], f"{types[1]}{voxels}<"))
    if not beside:
        assert "such as voxels, which cannot be read: split" in refused(tmp_path / "mesh.vtu")
        return
    with pytest.warns(UserWarning, match="such as voxels, and these are not read"):
        mesh = read_mesh(tmp_path / "mesh.vtu")
    assert mesh.body_count == 6 and any("voxels" in note for note in mesh.notes)


@pytest.mark.parametrize("error", [KeyError(1), IndexError(), ValueError(" 7 ")])
def test_a_reader_that_fails_with_a_number_is_named(tmp_path, monkeypatch, error):
    def fail(path):
        raise error

    monkeypatch.setattr(meshio, "read", fail)
    (tmp_path / "mesh.vtk").write_text(VOXELS)
    assert f"cannot be read: {type(error).__name__}" in refused(tmp_path / "mesh.vtk")


def filled_by_gmsh(folder, lines):
    """What Gmsh makes of a script in a folder."""
    (folder / "fill.geo").write_text(lines)
    gmsh.initialize(interruptible=False, readConfigFiles=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.open(str(folder / "fill.geo"))
        gmsh.model.mesh.generate(3)
        gmsh.write(str(folder / "filled.msh"))
    finally:
        gmsh.finalize()
    return read_mesh(folder / "filled.msh")


def gmsh_file(path, groups, blocks):
    """Write a Gmsh file. groups: name -> (number, dimension). blocks: (type, cells, numbers)."""
    content = meshio.Mesh(BAR.points, [(kind, cells) for kind, cells, _ in blocks])
    numbers = [np.full(len(cells), 0) + number for _, cells, number in blocks]
    content.cell_data = {"gmsh:physical": numbers, "gmsh:geometrical": numbers}
    content.field_data = {name: np.array(pair) for name, pair in groups.items()}
    meshio.write(path, content, file_format="gmsh22", binary=False)
    return path


LEFT = ("triangle", BAR.groups["left"], 5)


def test_file_of_gmsh_groups_without_a_volume_says_so(tmp_path):
    path = gmsh_file(tmp_path / "mesh.msh", {"left": (5, 2)}, [LEFT])
    assert "make a physical group of the volume too" in refused(path)


@pytest.mark.parametrize("named", [True, False])
def test_several_groups_of_volumes_are_told_and_named_when_asked_for(tmp_path, named):
    """The same number may stand for groups of other dimensions too."""
    halves = np.repeat([5, 6], BAR.body_count // 2)
    line = ("line", BAR.groups["left"][:2, :2], 5)
    groups = {"left": (5, 2), "edge": (5, 1), "rock": (5, 3), "ore": (6, 3)} if named else {}
    rock, ore, edge = ("rock", "ore", "edge") if named else (*["physical_5", "physical_6"], None)
    blocks = [("tetra", BAR.tetrahedra, halves), LEFT, *[line] * named]
    path = gmsh_file(tmp_path / "mesh.msh", groups, blocks)
    mesh = read_mesh(path)
    assert f"bodies are in the groups {rock}, {ore}, for materials of their own" in mesh.notes
    for name, first in ((rock, 0), (ore, BAR.body_count // 2)):
        assert np.array_equal(mesh.group_bodies(name), first + np.arange(BAR.body_count // 2))
    assert list(mesh.groups) == ["left" if named else "physical_5"]
    assert np.array_equal(in_space_order(mesh).unread, mesh.unread)
    with pytest.raises(InputError, match=rf"{ore} is a group of bodies: make one of faces"):
        mesh.group_faces(ore)
    if named:
        words = "only groups of faces and of solid cells are read, not"
        assert f"{words} {edge} (of lines)" in mesh.notes
        with pytest.raises(InputError, match="edge is a group of lines"):
            mesh.group_faces("edge")


def test_one_group_of_all_volumes_is_no_news(tmp_path):
    path = gmsh_file(tmp_path / "mesh.msh", {"all": (1, 3)}, [("tetra", BAR.tetrahedra, 1), LEFT])
    assert read_mesh(path).notes == ()


def test_sets_and_numbers_of_other_formats_are_told(tmp_path):
    cells = [("tetra", BAR.tetrahedra)]
    content = meshio.Mesh(BAR.points, cells, cell_sets={"part": [np.arange(5)]})
    content.point_sets = {"held": np.arange(3)}
    meshio.write(tmp_path / "mesh.inp", content)
    with pytest.warns(UserWarning, match="need groups of faces") as warned:
        mesh = read_mesh(tmp_path / "mesh.inp")
    (note,) = mesh.notes
    assert note.startswith("the sets held (of points) are not read: loads and supports need groups")
    assert mesh.group_bodies("part").tolist() == list(range(5))
    assert len(warned) == 1 and note in str(warned[0].message)
    content = meshio.Mesh(BAR.points, cells, cell_data={"rock": [np.arange(BAR.body_count) % 2]})
    meshio.write(tmp_path / "mesh.vtu", content)
    mesh = read_mesh(tmp_path / "mesh.vtu")
    assert len(mesh.notes) == 1 and "1 note" in repr(mesh)
    assert mesh.group_bodies("rock_1").tolist() == list(range(1, BAR.body_count, 2))


@pytest.mark.parametrize("number", [np.ones, np.arange, np.zeros])
def test_one_number_for_all_or_a_number_for_each_is_no_news(tmp_path, number):
    cells, data = [("tetra", BAR.tetrahedra)], {"id": [number(BAR.body_count).astype(int)]}
    meshio.write(tmp_path / "mesh.vtu", meshio.Mesh(BAR.points, cells, cell_data=data))
    assert read_mesh(tmp_path / "mesh.vtu").notes == ()


def abaqus_file(path, lines, **sets):
    content = meshio.Mesh(BAR.points, [("tetra", BAR.tetrahedra)], **sets)
    meshio.write(path, content)
    path.write_text(path.read_text() + lines)
    return path


def test_abaqus_sets_of_everything_are_noted_without_a_warning(tmp_path):
    sets = {"cell_sets": {"all": [np.arange(BAR.body_count)]}}
    path = abaqus_file(
        tmp_path / "mesh.inp", "", point_sets={"n": np.arange(BAR.point_count)}, **sets
    )
    assert read_mesh(path).notes == (
        "only groups of faces and of solid cells are read, not n (of points)",
    )


@pytest.mark.parametrize(
    "head", ["*Surface, type=ELEMENT, name=Load", "*SURFACE,NAME=Load", '*surface, name="Load"']
)
def test_abaqus_surfaces_are_told(tmp_path, head):
    path = abaqus_file(tmp_path / "mesh.inp", f"{head}\n1, S1\n")
    with pytest.warns(UserWarning, match=r"Load \(of element sides\) are not read"):
        mesh = read_mesh(path)
    with pytest.raises(InputError, match="Load is a group of element sides"):
        mesh.group_faces("Load")
    path = abaqus_file(tmp_path / "mesh.inp", "*Surface Interaction, name=Load\n** *Surface\n")
    assert read_mesh(path).notes == ()
