"""Volume that bodies share is that of their intersection, by planes and hulls."""

from itertools import combinations

import numpy as np
import pytest
from scipy.optimize import linprog
from scipy.spatial import ConvexHull, HalfspaceIntersection

from taichi_dem import (
    CONCRETE,
    Scene,
    Simulation,
    SimulationDiverged,
    Uniform,
    checked_mesh,
    effects,
    simulate,
)
from taichi_dem.mesh.shapes import bar, placed_together, single
from taichi_dem.mesh.tetrahedra import all_faces, penetration
from taichi_dem.report.shared_volume import DEEP, DEPTH, SharedVolume
from tests.scenes import apart, quaternions
from tests.structures import POST, filled

EDGE = 1.0
#: In how many parts a body is counted.
PARTS = 512
TOUCH = effects.BodyContact(outer_faces=True)


class Looked:
    """Bodies of a mesh that are put anywhere, and looked at; no step is compiled."""

    def __init__(self, mesh, *listed):
        self.simulation = Simulation(Scene(mesh, CONCRETE, listed), Uniform())
        self.model, self.state = self.simulation.model, self.simulation.state
        self.volume = SharedVolume(self.simulation.parts)

    def shares(self, position, orientation=None, time_s=0.0):
        """Shares by pair of bodies, of bodies at a position [m], (n, 3)."""
        self.state.set_motion(position, orientation)
        self.volume.sample(time_s, finished=True)
        return dict(zip(map(tuple, self.volume.pairs.tolist()), self.volume.share.tolist()))


def common_volume(first, second):
    """Volume of the intersection of two tetrahedra [m^3]; 0 where no ball of 1e-9 m is in both."""
    both = np.vstack([ConvexHull(corners).equations for corners in (first, second)])
    room = np.column_stack([both[:, :3], np.ones(8)])
    found = linprog([0, 0, 0, -1], room, -both[:, 3], bounds=[(None, None)] * 4)
    if found.x[3] < 1e-9:
        return 0.0
    return ConvexHull(HalfspaceIntersection(both, found.x[:3]).intersections).volume


def test_shares_are_those_of_the_intersections_of_all_pairs():
    """A heap of 14 bodies turned at random, against the intersection of every two of them.

    Each of the PARTS of a body is counted or not, which adds at most 1/4 to the variance of its
    share: errors lie below five times its root, also in the mean of all pairs.
    """
    random, count = np.random.default_rng(0), 14
    heap = Looked(apart(count, EDGE))
    position, (turn, rotation) = EDGE * random.random((count, 3)), quaternions(random, count)
    found = heap.shares(position, turn)
    corners = position[:, None] + np.einsum("nij,ncj->nci", rotation, heap.volume.arms)
    whole = heap.model.body_mass[0] / CONCRETE.density
    exact = {pair: common_volume(*corners[[*pair]]) / whole for pair in combinations(range(14), 2)}
    assert max(share for pair, share in exact.items() if pair not in found) < DEEP
    errors = np.array([share - exact[pair] for pair, share in found.items()])
    most = 5.0 * np.sqrt(0.25 / PARTS)
    assert len(errors) > 25 and np.abs(errors).max() < most
    assert abs(errors.mean()) < most / np.sqrt(len(errors))


@pytest.mark.parametrize(("shift", "share"), [(0.7, 0.0), (0.4, 14.0), (0.05, 78.0)])
def test_bodies_that_overlap_at_the_start_are_told_at_once_and_rest_as_they_are(shift, share):
    """Nothing of their overlap becomes energy; one within the other is refused."""
    parts = {"one": (single(EDGE), (0.0, 0.0, 0.0)), "other": (single(EDGE), (shift, 0.0, 0.0))}
    touch = filled("bodies", TOUCH, group="post_base")
    scene = Scene(placed_together(parts | POST), CONCRETE, touch)
    asked = {"method": Uniform(1e-7), "until": 1e-5, "samples": 1, "progress": None}
    if share > 50.0:
        with pytest.raises(SimulationDiverged, match=r"t = 0 s: .* the scene starts so"):
            simulate(scene, **asked)
        return
    words = f"bodies 0 and 1 share {share:.2g} % of the smaller one at the start"
    if not share:
        corners = single(EDGE).points[None]
        (depth,) = penetration(corners, corners + np.array([shift, 0.0, 0.0]))
        words = f"overlapped by {1e3 * depth:.3g} mm at t = 0 s"
    with pytest.warns(UserWarning, match=words):
        report = simulate(scene, **asked).report
    assert [words in sentence for sentence in report.needs] == [True]
    assert not any(report.energy_balance.values())


SIZE, CELL = 3.0, 0.3
BLOCK = bar(5 * CELL, 3 * CELL, (5, 3, 3))
TOP = BLOCK.points.max(axis=0) * [0.5, 1.0, 0.5]


def sunk(depth, aside=(0.0, 0.0)):
    """A vertex of a tetrahedron of 3 m at a depth [m] in a block of elements of 0.3 m.

    aside: its place from the middle of the block's top [m]. Returns the worst of all pairs, what is
    told, and the least height of the elements [m].
    """
    up = [[0.0, 0.0, 0.0], [0.6, 0.8, 0.0], [-0.3, 0.8, 0.5], [-0.3, 0.8, -0.5]]
    corners = TOP + [aside[0], -depth, aside[1]] + SIZE * np.array(up)
    large = checked_mesh(corners, [[0, 1, 2, 3]], {})
    parts = {"block": (BLOCK, (0, 0, 0)), "large": (large, (0, 0, 0))}
    looked = Looked(placed_together(parts), TOUCH)
    looked.shares(looked.model.centre, time_s=1.0)
    return looked.volume.worst, looked.volume.findings(), looked.volume.height[:-1].min()


def test_a_vertex_deep_in_bonded_bodies_is_told_with_its_depth():
    """The vertex may be anywhere between the elements.

    In the middle of a face, less deep than half of the way to its border, its depth is the way that
    parts the two; beside a border of elements one of them parts by less, and never by more.
    """
    random = np.random.default_rng(1)
    corners = BLOCK.points[all_faces(BLOCK.tetrahedra)]
    upper = np.isclose(corners[..., 1], TOP[1]).all(axis=1)
    middles = (corners[upper].mean(axis=1) - TOP)[:, [0, 2]]
    for depth, aside in zip(random.uniform(0.02, 0.03, 4), middles):
        worst, told, _ = sunk(depth, aside)
        assert worst.depth_m == pytest.approx(depth, rel=1e-9)
        assert any(f"{1e3 * depth:.3g} mm" in words for words in told)
    for depth in random.uniform(0.06, 0.12, 6):
        worst, told, least = sunk(depth, random.uniform(-0.3, 0.3, 2))
        assert worst.deepest[1] == BLOCK.body_count and worst.share < 0.1
        assert DEPTH * least < worst.depth_m <= depth * (1.0 + 1e-9) and told
    for depth in (-1e-3, 0.9 * DEPTH * least):
        worst, told, _ = sunk(depth)
        assert not (worst.depth_share or told)


@pytest.mark.parametrize("scale", [(1, 1, 1), (0.025, 1, 1), (1, 0.025, 0.025)])
def test_bodies_side_by_side_are_not_deep_in_each_other(scale):
    """Bonded or not, with a rounding between them, flat, or long and thin."""
    mesh = bar(1.0, 1.0, (2, 2, 2))
    flat = checked_mesh(mesh.points * scale, mesh.tetrahedra, {})
    loose = flat.points[flat.tetrahedra].reshape(-1, 3)
    bodies = np.arange(len(loose)).reshape(-1, 4)
    for one in (flat, checked_mesh(loose, bodies, {}, keep_coincident=True)):
        looked = Looked(one, TOUCH)
        noise = 1e-15 * np.random.default_rng(3).standard_normal(looked.model.centre.shape)
        looked.shares(looked.model.centre + noise, time_s=1.0)
        assert not looked.volume.worst.depth_share and not looked.volume.findings()
