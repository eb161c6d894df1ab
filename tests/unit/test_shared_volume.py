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


class Sunk(Looked):
    """A vertex of a regular tetrahedron of 3 m above the middle of a block of elements of 0.3 m."""

    def __init__(self):
        block, large = bar(5 * CELL, 3 * CELL, (5, 3, 3)), single(SIZE)
        parts = {"block": (block, (0, 0, 0)), "large": (large, (0, 20.0, 0))}
        super().__init__(placed_together(parts), effects.BodyContact(outer_faces=True))
        top = self.model.mesh.points[: len(block.points)]
        self.top = np.array([0.5 * np.ptp(top[:, 0]), top[:, 1].max(), 0.5 * np.ptp(top[:, 2])])
        self.top += [top[:, 0].min(), 0.0, top[:, 2].min()]
        arms = self.volume.arms[-1]
        down = arms[0] / np.linalg.norm(arms[0])
        # Turned by the shortest way, so that its first corner is the lowest.
        axis = np.cross(down, [0.0, -1.0, 0.0])
        self.turn = np.array([1.0 - down[1], *axis])
        self.turn /= np.linalg.norm(self.turn)
        self.reach = np.linalg.norm(arms[0])

    def at(self, depth, aside=(0.0, 0.0)):
        """Figures of the vertex at a depth [m] and a place from the middle [m]."""
        place, still = (
            self.model.centre.copy(),
            np.tile([1.0, 0, 0, 0], (len(self.model.centre), 1)),
        )
        place[-1] = self.top + np.array([aside[0], self.reach - depth, aside[1]])
        still[-1] = self.turn
        # Looks anew, with nothing before it.
        self.volume = SharedVolume(self.simulation.parts)
        self.shares(place, still, 1.0)
        return self.volume.worst, self.volume.findings()


def test_a_vertex_deep_in_bonded_bodies_is_told_with_its_depth():
    """The vertex may be anywhere between the elements.

    In the middle of a face, less deep than half of the way to its border, its depth is the way that
    parts the two; beside a border of elements one of them parts by less, and never by more.
    """
    sunk, random = Sunk(), np.random.default_rng(1)
    corners = sunk.model.mesh.points[all_faces(sunk.model.mesh.tetrahedra[:-1])]
    upper = np.isclose(corners[..., 1], sunk.top[1]).all(axis=1)
    middles = (corners[upper].mean(axis=1) - sunk.top)[:, [0, 2]]
    least = sunk.volume.height[:-1].min()
    for depth, aside in zip(random.uniform(0.02, 0.03, 6), middles):
        worst, told = sunk.at(depth, aside)
        assert worst.depth_m == pytest.approx(depth, rel=1e-9)
        assert any(f"{1e3 * depth:.3g} mm" in words for words in told)
    for depth in random.uniform(0.06, 0.12, 12):
        worst, told = sunk.at(depth, random.uniform(-0.3, 0.3, 2))
        assert worst.deepest[1] == len(sunk.model.centre) - 1 and worst.share < 0.1
        assert DEPTH * least < worst.depth_m <= depth * (1.0 + 1e-9) and told
    for depth in (-1e-3, 0.9 * DEPTH * least):
        worst, told = sunk.at(depth)
        assert not (worst.depth_share or told)


def test_bodies_side_by_side_are_not_deep_in_each_other():
    """Bonded or not, with a rounding between them, flat, or long and thin."""
    random = np.random.default_rng(3)
    for scale in ([1.0, 1.0, 1.0], [1.0 / 40.0, 1.0, 1.0], [1.0, 1.0 / 40.0, 1.0 / 40.0]):
        for mesh in (bar(1.0, 1.0, (2, 2, 2)), pair(1.0)):
            whole = mesh.moved(by=(0.0, 0.0, 0.0))
            flat = checked_mesh(whole.points * scale, whole.tetrahedra, {})
            cut = checked_mesh(
                flat.points[flat.tetrahedra].reshape(-1, 3),
                np.arange(4 * flat.body_count).reshape(-1, 4),
                {},
                keep_coincident=True,
            )
            for one in (flat, cut):
                looked = Looked(one, effects.BodyContact(outer_faces=True))
                noise = 1e-15 * random.standard_normal(looked.model.centre.shape)
                looked.shares(looked.model.centre + noise, time_s=1.0)
                assert not looked.volume.worst.depth_share and not looked.volume.findings()
