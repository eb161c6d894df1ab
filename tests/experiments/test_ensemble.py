"""How ``blast_ensemble.py`` perturbs a block, and what it reads from many blasts."""

import numpy as np
import pytest

from _blast_ensemble import HOLE, hole_moves, moved, over_time, stronger
from taichi_dem import CONCRETE, PAPER_BLOCK, read_mesh
from taichi_dem.engine.model import Model
from taichi_dem.kit.plot_style import styled
from taichi_dem.mesh.shapes import bar
from taichi_dem.plot.probability import _on_front
from taichi_dem.plot.view import View

JITTER = 1e-3


def by_seed(mesh, seed, jitter=JITTER):
    return moved(mesh, jitter, np.random.default_rng(seed)).points


def test_points_move_by_a_share_of_an_edge_and_flat_sides_stay_flat():
    mesh = read_mesh(PAPER_BLOCK)
    shift = by_seed(mesh, 1) - mesh.points
    sides = (mesh.points == mesh.points.min(axis=0)) | (mesh.points == mesh.points.max(axis=0))
    assert not shift[sides].any() and shift[~sides].all()
    # The shortest edge of the block is 13 mm, the longest of the shortest at a point 0.2 m.
    assert 0.2e-3 * JITTER < np.abs(shift[~sides]).mean() < 0.2 * JITTER
    assert np.array_equal(by_seed(mesh, 1), by_seed(mesh, 1))
    assert not np.array_equal(by_seed(mesh, 1), by_seed(mesh, 2))
    assert np.array_equal(by_seed(mesh, 3, jitter=0.0), mesh.points)


def test_standard_deviation_of_the_shift_is_the_jitter_times_the_shortest_edge():
    mesh = bar(1.0, 0.4, (10, 4, 4))
    inner = ((mesh.points > mesh.points.min(axis=0)) & (mesh.points < mesh.points.max(axis=0))).all(
        1
    )
    shifts = np.array([by_seed(mesh, k)[inner] - mesh.points[inner] for k in range(50)])
    # 0.1 m; that of n normal numbers is known to 1 / sqrt(2 n).
    assert shifts.std() == pytest.approx(0.1 * JITTER, rel=4.0 / np.sqrt(2.0 * shifts.size))


def test_a_stronger_material_has_the_same_openings():
    strong = stronger(CONCRETE, 1.1)
    assert strong.tensile_strength == 1.1 * CONCRETE.tensile_strength
    assert strong.failure_opening == pytest.approx(CONCRETE.failure_opening, rel=1e-14)
    assert strong.normal_stiffness == CONCRETE.normal_stiffness


def test_mean_and_spread_of_the_hole_are_those_of_the_blasts_that_ended_well():
    table = {HOLE.format(0): np.zeros(4), HOLE.format(1): np.array([1.0, 2.0, 3.0, np.nan])}
    moves = hole_moves({**table, "broken": np.array([""] * 4)}, np.array([True] * 3 + [False]))
    columns = over_time(moves, until=8e-5, samples=1)
    assert columns["time_ms"].tolist() == pytest.approx([0.0, 0.08])
    assert columns["mean_mm"].tolist() == [0.0, 2.0] and columns["sd_mm"].tolist() == [0.0, 1.0]
    assert columns["low_mm"][1] == pytest.approx(1.1) and columns["high_mm"][1] == pytest.approx(
        2.9
    )


def test_an_edge_on_the_front_has_the_colour_of_its_most_probable_face():
    mesh = bar(0.2, 0.1, (2, 1, 1))
    model = Model(mesh, CONCRETE, ())
    with styled() as (_, axes):
        drawn = _on_front(axes, View(), model, np.linspace(0.0, 1.0, model.bond_count))
    found = drawn.get_array()
    top = model.topology.vertices
    front = mesh.points[:, 2] == mesh.points[:, 2].max()
    wanted = {
        max(k for k in range(1, model.bond_count) if np.isin(edge, top[k]).all())
        for corners in top[1:]
        for edge in [corners[front[corners]]]
        if len(edge) == 2
    }
    assert set(np.round(found * (model.bond_count - 1)).astype(int)) == wanted
