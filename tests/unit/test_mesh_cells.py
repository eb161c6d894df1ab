"""Cells of mesh files are cut into tetrahedra that fit; where bonds are missing, it is told."""

import warnings

import meshio
import numpy as np
import pytest

from taichi_dem import InputError, read_mesh
from taichi_dem.mesh.check import joined_bodies as parts_of
from taichi_dem.mesh.mesh import volumes
from taichi_dem.mesh.tetrahedra import all_faces, area_vectors
from taichi_dem.mesh.topology import topology_of

CUBE = np.array(
    [*((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)), *((0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))],
    dtype=float,
)


def told(folder, points, *blocks, data=None, **options):
    """The mesh of a file of these cells, and the sentences of its warnings."""
    content = meshio.Mesh(np.asarray(points, dtype=float), list(blocks), cell_data=data or {})
    meshio.write(folder / "mesh.vtu", content)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        mesh = read_mesh(folder / "mesh.vtu", **options)
    return mesh, [str(warning.message) for warning in caught]


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
    extra = np.hstack([cells, np.zeros((len(cells), 12), dtype=int)])  # nodes on the edges
    return {
        "hexahedron": (points, cells, 6),
        "hexahedron20": (points, extra, 6),
        "wedge": (points, prisms, 3),
        "wedge of the other hand": (points, mirrored, 3),
        "pyramid": (*pyramids(points, cells), 2),
    }


@pytest.mark.parametrize("name", cut_kinds())
def test_solid_cells_are_cut_into_tetrahedra_that_fit_together(tmp_path, name):
    """Neighbours agree on the diagonals: no face is left over but the two of each outer square."""
    points, cells, each = cut_kinds()[name]
    mesh, _ = told(tmp_path, points, (name.split()[0], cells))
    assert mesh.body_count == each * len(cells)
    # 3 x 2 x 2 boxes have 32 outer squares.
    top = topology_of(mesh)
    assert top.outer_count == 64 and 2 * top.bond_count + 64 == 4 * mesh.body_count
    # A closed surface of outward area vectors, that holds what the bodies fill.
    outer = all_faces(mesh.tetrahedra)[4 * top.outer_body + top.outer_face]
    area, middle = area_vectors(mesh.points, outer), mesh.points[outer].mean(axis=1)
    assert np.abs(area.sum(axis=0)).max() < 1e-12
    assert (area * middle).sum() / 3.0 == pytest.approx(volumes(mesh).sum(), rel=1e-12)


@pytest.mark.parametrize("seed", range(5))
def test_welded_hexahedra_are_bonded_however_their_points_are_numbered(tmp_path, seed):
    """And groups lie on the welded faces."""
    number = np.random.default_rng(seed).permutation(16)
    points = np.empty((16, 3))
    points[number] = np.vstack([CUBE, CUBE + np.array([1.0, 0.0, 0.0])])
    cells = number.reshape(2, 8)
    blocks = [("hexahedron", cells), ("quad", cells[:, [0, 1, 5, 4]])]
    data = {"side": [np.zeros(2, int), np.array([4, 4])]}
    mesh, said = told(tmp_path, points, *blocks, data=data, weld_tolerance=1e-6)
    assert mesh.point_count == 12 and mesh.body_count == 12 and not said
    assert topology_of(mesh).bond_count == 6 + 6 + 2
    assert len(mesh.group_faces("side_4")) == 4


def test_a_tolerance_that_joins_an_edge_through_other_points_is_refused(tmp_path):
    steps = np.column_stack([np.linspace(0.0, 1.0, 11)[1:-1], np.zeros(9), np.zeros(9)])
    with pytest.raises(InputError, match="joins the ends of an edge of 1 m"):
        told(tmp_path, [*CUBE, *steps], ("hexahedron", np.arange(8)[None]), weld_tolerance=0.11)


COLLAPSED = {
    "prism": ([0, 1, 2, 2, 4, 5, 6, 6], 0.5),
    "pyramid": ([0, 1, 2, 3, 4, 4, 4, 4], 1 / 3),
    "tetrahedron": ([0, 1, 2, 2, 5, 5, 5, 5], 1 / 6),
}


@pytest.mark.parametrize("name", COLLAPSED)
def test_a_hexahedron_with_repeated_corners_is_what_is_left_of_it(tmp_path, name):
    """Whatever its points' numbers; the hexahedron under it fits."""
    corners, volume = COLLAPSED[name]
    random = np.random.default_rng(1)
    for _ in range(5):
        number = random.permutation(12)
        points = np.empty((12, 3))
        points[number] = np.vstack([CUBE, CUBE[:4] - np.array([0.0, 0.0, 1.0])])
        below = number[[8, 9, 10, 11, 0, 1, 2, 3]]
        mesh, said = told(tmp_path, points, ("hexahedron", np.array([number[corners], below])))
        assert volumes(mesh).sum() == pytest.approx(1.0 + volume)
        joined = len(np.unique(parts_of(mesh.tetrahedra))) == 1
        # The others lie on a half of the square, which may be cut along the other diagonal.
        assert joined or name != "pyramid"
        assert joined == (not said)


def test_corners_in_another_order_are_refused(tmp_path):
    cells = np.array([[0, 1, 3, 2, 4, 5, 7, 6]])
    with pytest.raises(InputError, match="lie on the same side"):
        told(tmp_path, CUBE, ("hexahedron", cells))


@pytest.mark.parametrize("diagonal", [0, 1])
def test_two_diagonals_of_one_square_are_told(tmp_path, diagonal):
    """Two tetrahedra on the top of a cube, cut along a diagonal of it."""
    base = [[(4, 5, 6), (4, 6, 7)], [(4, 5, 7), (5, 6, 7)]][diagonal]
    blocks = ("hexahedron", np.arange(8)[None]), ("tetra", np.array([(*face, 8) for face in base]))
    mesh, said = told(tmp_path, np.vstack([CUBE, [[0.5, 0.5, 2.0]]]), *blocks)
    assert len(np.unique(parts_of(mesh.tetrahedra))) == 1 + diagonal
    assert len(said) == diagonal
    assert all("4 points belong to several of the mesh's 2 parts" in words for words in said)


def test_parts_that_share_points_alone_are_told_and_parts_apart_are_not(tmp_path):
    cells = ("hexahedron", np.arange(16).reshape(2, 8))
    for shift, sentences in (([1.0, 1.0, 0.0], 1), ([1.5, 1.5, 0.5], 0)):
        points = np.vstack([CUBE, CUBE + shift])
        _, said = told(tmp_path, points, cells, weld_tolerance=1e-6)
        assert len(said) == sentences


def test_voxels_which_the_reader_passes_over_are_told(tmp_path):
    """Beside other cells they would leave holes."""
    points = np.vstack([CUBE, CUBE + 9.0])
    content = meshio.Mesh(points, [("hexahedron", np.arange(16).reshape(2, 8))])
    meshio.write(tmp_path / "mesh.vtu", content, binary=False)
    text = (tmp_path / "mesh.vtu").read_text()
    types = text.index("12\n12")
    (tmp_path / "mesh.vtu").write_text(text[:types] + "12\n11" + text[types + 5 :])
    with pytest.warns(UserWarning, match="such as voxels, and these are not read"):
        mesh = read_mesh(tmp_path / "mesh.vtu")
    assert mesh.body_count == 6
