"""Meshes come back from files as they were written, with the groups of their faces and bodies.

Cells of mesh files are cut into tetrahedra that fit.
"""

import meshio
import numpy as np
import pytest

from cases.meshes import group_area
from make_meshes import write
from taichi_dem import PAPER_BLOCK, InputError, read_mesh, shapes
from taichi_dem.mesh.files import write_mesh
from taichi_dem.mesh.mesh import volumes
from taichi_dem.mesh.shapes import bar
from taichi_dem.mesh.tetrahedra import all_faces, area_vectors
from taichi_dem.mesh.topology import topology_of

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


@pytest.mark.parametrize(("name", "each"), [("hexahedron", 6), ("wedge", 3)])
def test_solid_cells_are_cut_into_tetrahedra_that_fit_together(tmp_path, name, each):
    """Neighbours agree on the diagonals: no face is left over but the two of each outer square."""
    points, cells = boxes()
    if name == "wedge":
        cells = np.vstack([cells[:, [0, 1, 3, 4, 5, 7]], cells[:, [1, 2, 3, 5, 6, 7]]])
    meshio.write(tmp_path / "mesh.vtu", meshio.Mesh(points, [(name, cells)]))
    mesh = read_mesh(tmp_path / "mesh.vtu")
    assert mesh.body_count == each * len(cells)
    # 3 x 2 x 2 boxes have 32 outer squares.
    top = topology_of(mesh)
    assert top.outer_count == 64 and 2 * top.bond_count + 64 == 4 * mesh.body_count
    # A closed surface of outward area vectors, that holds what the bodies fill.
    outer = all_faces(mesh.tetrahedra)[4 * top.outer_body + top.outer_face]
    area, middle = area_vectors(mesh.points, outer), mesh.points[outer].mean(axis=1)
    assert np.abs(area.sum(axis=0)).max() < 1e-12
    assert (area * middle).sum() / 3.0 == pytest.approx(volumes(mesh).sum(), rel=1e-12)
