"""Cells that meet: welded before they are cut, collapsed, or left apart and told about."""

import itertools
import warnings

import meshio
import numpy as np
import pytest

from taichi_dem import InputError, checked_mesh, read_mesh
from taichi_dem.mesh.mesh import volumes
from taichi_dem.mesh.parts_in_files import parts_of, unbonded_places
from taichi_dem.mesh.shapes import bar
from taichi_dem.mesh.topology import topology_of

CUBE = np.array(
    [*((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)), *((0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))],
    dtype=float,
)
HEXAHEDRON = np.arange(8)[None]


def written(folder, points, *blocks):
    path = folder / "mesh.vtk"
    meshio.write(path, meshio.Mesh(np.asarray(points, dtype=float), list(blocks)))
    return path


def told(path, **options):
    """The mesh of a file, and the sentences of its warnings."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        mesh = read_mesh(path, **options)
    return mesh, [str(warning.message) for warning in caught]


def refused(path, **options):
    with pytest.raises(InputError) as caught:
        read_mesh(path, **options)
    assert "\n" not in str(caught.value)
    return str(caught.value)


@pytest.mark.parametrize("scale", [1.0, 1e-3])
def test_welded_hexahedra_are_bonded_however_their_points_are_numbered(tmp_path, scale):
    random = np.random.default_rng(3)
    for _ in range(20):
        number = random.permutation(16)
        points = np.empty((16, 3))
        points[number] = np.vstack([CUBE, CUBE + np.array([1.0, 0.0, 0.0])])
        path = written(tmp_path, points, ("hexahedron", number.reshape(2, 8)))
        mesh, said = told(path, scale=scale, weld_tolerance=1e-6 * scale)
        assert mesh.point_count == 12 and mesh.body_count == 12 and not said
        assert topology_of(mesh).bond_count == 6 + 6 + 2
        assert "welded 4 points" in " ".join(mesh.notes)


def test_groups_lie_on_the_welded_faces(tmp_path):
    number = np.random.default_rng(5).permutation(16)
    points = np.empty((16, 3))
    points[number] = np.vstack([CUBE, CUBE + np.array([1.0, 0.0, 0.0])])
    cells = number.reshape(2, 8)
    data = {"side": [np.zeros(2, int), np.array([4, 4])]}
    blocks = [("hexahedron", cells), ("quad", cells[:, [0, 1, 5, 4]])]
    meshio.write(tmp_path / "mesh.vtu", meshio.Mesh(points, blocks, cell_data=data))
    mesh = read_mesh(tmp_path / "mesh.vtu", weld_tolerance=1e-6)
    assert len(mesh.group_faces("side_4")) == 4


def test_points_that_coincide_are_refused_before_cells_are_judged(tmp_path):
    """A hexahedron collapsed by places and not by numbers: welded, it is a prism."""
    points = CUBE.copy()
    points[[3, 7]] = points[[2, 6]]
    path = written(tmp_path, points, ("hexahedron", HEXAHEDRON))
    assert "pass weld_tolerance=" in refused(path)
    mesh = read_mesh(path, weld_tolerance=1e-6)
    assert mesh.body_count == 3 and volumes(mesh).sum() == pytest.approx(0.5)


def test_a_tolerance_that_joins_an_edge_through_other_points_is_refused(tmp_path):
    steps = np.column_stack([np.linspace(0.0, 1.0, 11)[1:-1], np.zeros(9), np.zeros(9)])
    path = written(tmp_path, [*CUBE, *steps], ("hexahedron", HEXAHEDRON))
    assert "joins the ends of an edge of 1 m" in refused(path, weld_tolerance=0.11)


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
    for _ in range(20):
        number = random.permutation(12)
        points = np.empty((12, 3))
        points[number] = np.vstack([CUBE, CUBE[:4] - np.array([0.0, 0.0, 1.0])])
        below = number[[8, 9, 10, 11, 0, 1, 2, 3]]
        path = written(tmp_path, points, ("hexahedron", np.array([number[corners], below])))
        mesh, said = told(path)
        assert volumes(mesh).sum() == pytest.approx(1.0 + volume)
        joined = len(np.unique(parts_of(mesh.tetrahedra))) == 1
        # The others lie on a half of the square, which may be cut along the other diagonal.
        assert joined or name != "pyramid"
        assert joined == (not said)


def test_two_collapsed_hexahedra_are_bonded_over_their_square(tmp_path):
    number = np.random.default_rng(2).permutation(8)
    points = np.empty((8, 3))
    points[number] = CUBE
    halves = number[[[0, 1, 2, 2, 4, 5, 6, 6], [2, 3, 0, 0, 6, 7, 4, 4]]]
    mesh, said = told(written(tmp_path, points, ("hexahedron", halves)))
    assert mesh.body_count == 6 and topology_of(mesh).bond_count == 6 and not said


def test_a_cell_of_which_nothing_is_left_is_refused(tmp_path):
    cells = np.array([np.arange(8), [0, 1, 2, 3, 0, 1, 2, 3]])
    said = refused(written(tmp_path, CUBE, ("hexahedron", cells)))
    assert "hexahedron 1, with the points [0, 1, 2, 3, 0, 1, 2, 3], has no volume" in said


@pytest.mark.parametrize("swapped", [[0, 1, 3, 2, 4, 5, 7, 6], [0, 1, 2, 3, 5, 6, 7, 4]])
def test_corners_in_another_order_are_refused_by_the_cell(tmp_path, swapped):
    points = np.vstack([CUBE, CUBE + np.array([3.0, 0.0, 0.0])])
    cells = np.array([np.arange(8), np.array(swapped) + 8])
    said = refused(written(tmp_path, points, ("hexahedron", cells)))
    assert "these are tetrahedra that cells were cut into: hexahedron 1, with the points" in said
    assert "folds over itself" in said


def test_cells_that_lie_in_each_other_are_refused_as_cut(tmp_path):
    points = np.vstack([CUBE, CUBE[4:] + np.array([0.1, 0.0, 0.0])])
    cells = np.array([np.arange(8), [0, 1, 2, 3, 8, 9, 10, 11]])
    said = refused(written(tmp_path, points, ("hexahedron", cells)))
    assert "the same side" in said and "numbered after cells have been cut" in said


def on_a_cube(diagonal):
    """Two tetrahedra on the top of a cube, cut along a diagonal of it."""
    base = [(4, 5, 6), (4, 6, 7)] if diagonal == 0 else [(4, 5, 7), (5, 6, 7)]
    return np.array([(*face, 8) for face in base])


@pytest.mark.parametrize("apart", [False, True])
def test_two_diagonals_of_one_square_are_told(tmp_path, apart):
    """Inside a mesh that is one part elsewhere, too."""
    points = np.vstack([CUBE, [[0.5, 0.5, 2.0]]])
    blocks = [("hexahedron", HEXAHEDRON), ("tetra", on_a_cube(1))]
    if not apart:  # a tetrahedron from the cube's side to the tetrahedra
        points = np.vstack([points, [[0.5, -2.0, 2.0]]])
        blocks[1] = ("tetra", np.vstack([on_a_cube(1), [[4, 5, 8, 9], [0, 5, 4, 9]]]))
    mesh, said = told(written(tmp_path, points, *blocks))
    assert len(np.unique(parts_of(mesh.tetrahedra))) == 1 + apart
    assert len(said) == 1 and "at 1 quadrangle, the first around (0.5, 0.5, 1) m" in said[0]
    assert any(note in said[0] for note in mesh.notes)
    assert ("the mesh has 2 parts" in repr(mesh)) == apart
    blocks[1] = ("tetra", np.vstack([on_a_cube(0), blocks[1][1][2:]]))
    mesh, said = told(written(tmp_path, points, *blocks))
    assert len(np.unique(parts_of(mesh.tetrahedra))) == 1 and not said


def test_parts_that_share_points_alone_are_told(tmp_path):
    """Two cubes at an edge; cubes apart from each other are no news."""
    points = np.vstack([CUBE, CUBE + np.array([1.0, 1.0, 0.0])])
    path = written(tmp_path, points, ("hexahedron", np.arange(16).reshape(2, 8)))
    _, said = told(path, weld_tolerance=1e-6)
    assert len(said) == 1 and "2 points belong to several of the mesh's 2 parts" in said[0]
    points[8:] += 0.5
    path = written(tmp_path, points, ("hexahedron", np.arange(16).reshape(2, 8)))
    mesh, said = told(path, weld_tolerance=1e-6)
    assert not said and "the mesh has 2 parts that share no face" in repr(mesh)


@pytest.mark.parametrize("flatness", [1.0, 1e-3])
def test_neither_solids_nor_holes_of_a_tetrahedron_are_taken_for_two_diagonals(flatness):
    """A tetrahedron alone, one cut at its centre, and a hole of its shape in a block."""
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, flatness]], dtype=float)
    assert not unbonded_places(corners, np.array([[0, 1, 2, 3]]))
    block = bar(1.0, 1.0, (3, 3, 3))
    for body in range(0, block.body_count, 7):
        rest = np.delete(block.tetrahedra, body, axis=0)
        assert not unbonded_places(block.points, checked_mesh(block.points, rest, {}).tetrahedra)


def test_every_kind_of_pair_of_diagonals_is_found():
    """All orders of the points of a square give the same answer."""
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], dtype=float)
    tips = np.array([[0.5, 0.5, 1.0], [0.5, 0.5, -1.0]])
    for order in itertools.permutations(range(4)):
        a, b, c, d = order
        points = np.empty((6, 3))
        points[list(order)], points[4:] = square, tips
        for lower, crossed in (
            ([(a, b, c, 5), (a, c, d, 5)], 0),
            ([(a, b, d, 5), (b, c, d, 5)], 1),
        ):
            mesh = checked_mesh(points, [(a, b, c, 4), (a, c, d, 4), *lower], {})
            assert ("1 quadrangle" in unbonded_places(mesh.points, mesh.tetrahedra)) == crossed
