"""Volume that bodies share is that of their intersection, by planes and hulls."""

import warnings

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
from taichi_dem.mesh.shapes import bar, pair, placed_together, single
from taichi_dem.mesh.tetrahedra import all_faces, eighths, penetration
from taichi_dem.report.shared_volume import DEEP, DEPTH, SharedVolume
from tests.scenes import apart, quaternions

EDGE = 1.0
PARTS = 512


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


def planes(corners):
    """Planes of a tetrahedron's faces: outward unit normals and offsets, (4, 4)."""
    rows = []
    for k in range(4):
        face = np.delete(corners, k, axis=0)
        normal = np.cross(face[1] - face[0], face[2] - face[0])
        normal *= -np.sign(normal @ (corners[k] - face[0])) / np.linalg.norm(normal)
        rows.append([*normal, -normal @ face[0]])
    return np.array(rows)


def common_volume(first, second):
    """Volume of the intersection of two tetrahedra [m^3]; 0 where no ball of 1e-9 m is in both."""
    both = np.vstack([planes(first), planes(second)])
    room = np.column_stack([both[:, :3], np.ones(8)])
    found = linprog([0, 0, 0, -1], room, -both[:, 3], bounds=[(None, None)] * 4)
    if found.x[3] < 1e-9:
        return 0.0
    return ConvexHull(HalfspaceIntersection(both, found.x[:3]).intersections).volume


def parts_of_body():
    """Corners of the 512 equal parts as shares of the body's corners, (512, 4, 4)."""
    parts = [np.eye(4)]
    for _ in range(3):
        parts = [piece for whole in parts for piece in eighths(whole)]
    return np.array(parts)


def bounds(small, large):
    """Parts of a body that lie within another for sure, and parts that may, with one point each."""
    corners = np.einsum("pck,kx->pcx", parts_of_body(), small)
    heights = np.einsum("fx,pcx->pfc", planes(large)[:, :3], corners) + planes(large)[:, 3, None]
    return (heights < 0.0).all(axis=(1, 2)).sum(), PARTS - (heights > 0.0).all(2).any(1).sum()


def test_shares_are_those_of_the_intersections_of_all_pairs():
    """A heap of 14 bodies turned at random, against the intersection of every two of them.

    Parts within the other body for sure are counted, and none that is out of it; so are exact
    volumes. A part that is cut is counted or not, which adds at most 1/4 to the variance of the
    sum: the errors of all pairs add up to less than five times its root.
    """
    random, count = np.random.default_rng(0), 14
    heap = Looked(apart(count, EDGE))
    position, (turn, rotation) = EDGE * random.random((count, 3)), quaternions(random, count)
    found = heap.shares(position, turn)
    corners = position[:, None] + np.einsum("nij,ncj->nci", rotation, heap.volume.arms)
    whole = heap.model.body_mass[0] / CONCRETE.density
    missed, cuts = 0.0, 0
    for i in range(count):
        for j in range(i + 1, count):
            exact = common_volume(corners[i], corners[j]) / whole
            # The heavier is the second where they differ in the last digit.
            small, large = (i, j) if heap.model.body_mass[i] <= heap.model.body_mass[j] else (j, i)
            own = [bounds(corners[a], corners[b]) for a, b in ((small, large), (large, small))]
            least, most = min(own[0][0], own[1][0]), max(own[0][1], own[1][1])
            assert least - 1e-6 <= PARTS * exact <= most + 1e-6
            if (i, j) not in found:
                assert exact < DEEP
                continue
            assert least <= PARTS * found[i, j] <= most
            missed, cuts = missed + PARTS * (found[i, j] - exact), cuts + most - least
    assert len(found) > 25 and abs(missed) < 5.0 * np.sqrt(0.25 * cuts)


@pytest.mark.parametrize(("shift", "share"), [(0.7, 0.0), (0.4, 14.0), (0.05, 78.0)])
def test_bodies_that_overlap_at_the_start_are_told_at_once_and_rest_as_they_are(shift, share):
    """Nothing of their overlap becomes energy; one within the other is refused."""
    parts = {"one": (single(EDGE), (0.0, 0.0, 0.0)), "other": (single(EDGE), (shift, 0.0, 0.0))}
    scene = Scene(placed_together(parts), CONCRETE, "auto")
    asked = {"method": Uniform(1e-7), "until": 1e-5, "samples": 1, "progress": None}
    corners = single(EDGE).points[None]
    depth = penetration(corners, corners + np.array([shift, 0.0, 0.0]))[0]
    words = f"bodies 0 and 1 share {share:.2g} % of the smaller one at the start"
    if not share:
        words = f"{1e3 * depth:.3g} mm within each other at t = 0 s"
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        if share > 50.0:
            with pytest.raises(SimulationDiverged, match=r"t = 0 s: .* the scene starts so"):
                simulate(scene, **asked)
            return
        report = simulate(scene, **asked).report
    for sentences in ([str(one.message) for one in told], report.needs):
        assert [words in sentence for sentence in sentences] == [True]
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
    looked = Looked(placed_together(parts), effects.BodyContact(outer_faces=True))
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
@pytest.mark.parametrize("mesh", [bar(1.0, 1.0, (2, 2, 2)), pair(1.0)], ids=["bar", "pair"])
def test_bodies_side_by_side_are_not_deep_in_each_other(mesh, scale):
    """Bonded or not, with a rounding between them, flat, or long and thin."""
    flat = checked_mesh(mesh.points * scale, mesh.tetrahedra, {})
    loose = flat.points[flat.tetrahedra].reshape(-1, 3)
    bodies = np.arange(len(loose)).reshape(-1, 4)
    for one in (flat, checked_mesh(loose, bodies, {}, keep_coincident=True)):
        looked = Looked(one, effects.BodyContact(outer_faces=True))
        noise = 1e-15 * np.random.default_rng(3).standard_normal(looked.model.centre.shape)
        looked.shares(looked.model.centre + noise, time_s=1.0)
        assert not looked.volume.worst.depth_share and not looked.volume.findings()
