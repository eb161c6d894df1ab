"""Volume that bodies share, against intersections computed with planes and hulls."""

import numpy as np
import pytest
from scipy.optimize import linprog
from scipy.spatial import ConvexHull, HalfspaceIntersection

from taichi_dem import CONCRETE, Scene, Simulation, Uniform, checked_mesh, effects
from taichi_dem.diagnostics.shared_volume import DEEP, NOTABLE, SharedVolume
from taichi_dem.mesh.shapes import bar, pair, single
from taichi_dem.mesh.tetrahedra import eighths, points_of_parts
from tests.scenes import apart, beside, quaternions

EDGE = 1.0
PARTS = 512


class Looked:
    """Bodies of a mesh that are put anywhere, and looked at; no step is compiled."""

    def __init__(self, mesh, *listed):
        self.simulation = Simulation(Scene(mesh, CONCRETE, listed), Uniform())
        self.model, self.state = self.simulation.model, self.simulation.state
        self.volume = SharedVolume(self.model, self.state)

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


def test_parts_fill_a_body_and_each_holds_one_point():
    """Of equal volume; a random point of the body lies in exactly one of them."""
    parts, points = parts_of_body(), points_of_parts(3)
    assert len(parts) == len(points) == PARTS and (points > 0.0).all()
    np.testing.assert_allclose(np.abs(np.linalg.det(parts)), 1.0 / PARTS, rtol=1e-12)
    within = np.einsum("pk,pkc->pc", points, np.linalg.inv(parts))
    assert (within > 0.0).all()
    drawn = np.random.default_rng(0).dirichlet(np.ones(4), 200)
    inside = (np.einsum("nk,pkc->npc", drawn, np.linalg.inv(parts)) > 0.0).all(axis=2)
    assert (inside.sum(axis=1) == 1).all()


def bounds(small, large):
    """Parts of a body that lie within another for sure, and parts that may, with one point each."""
    corners = np.einsum("pck,kx->pcx", parts_of_body(), small)
    heights = np.einsum("fx,pcx->pfc", planes(large)[:, :3], corners) + planes(large)[:, 3, None]
    return (heights < 0.0).all(axis=(1, 2)).sum(), PARTS - (heights > 0.0).all(2).any(1).sum()


@pytest.mark.parametrize("seed", range(2))
def test_shares_are_those_of_the_intersections_of_all_pairs(seed):
    """A heap of 24 bodies turned at random, against the intersection of every two of them.

    Parts within the other body for sure are counted, and none that is out of it; so are exact
    volumes. A part that is cut is counted or not, which adds at most 1/4 to the variance of the
    sum: the errors of all pairs add up to less than five times its root.
    """
    random, count = np.random.default_rng(seed), 24
    heap = Looked(apart(count, EDGE))
    position, (turn, rotation) = EDGE * random.random((count, 3)), quaternions(random, count)
    found = heap.shares(position, turn)
    corners = position[:, None] + np.einsum("nij,ncj->nci", rotation, heap.volume.arms)
    whole = heap.model.body_mass[0] / CONCRETE.density
    near = set(map(tuple, heap.volume.near_pairs.tolist()))
    missed, cuts = 0.0, 0
    for i in range(count):
        for j in range(i + 1, count):
            exact = common_volume(corners[i], corners[j]) / whole
            assert exact == 0.0 or (i, j) in near
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
    assert len(found) > 50 and abs(missed) < 5.0 * np.sqrt(0.25 * cuts)


@pytest.mark.parametrize("depth", [1 / 64, 1 / 17, 1 / 8, 1 / 2])
def test_bodies_pressed_face_into_face_are_seen(depth):
    """Mirror images base in base, by a share of their height less than a layer of parts or more.

    The middle of the overlap is where both are cut alike: 1 - d / 2 of the way to either apex.
    """
    base = single(EDGE)
    mirrored = checked_mesh(base.points * [-1.0, 1.0, 1.0], base.tetrahedra, {})
    looked = Looked(beside(base, mirrored, [10.0, 0.0, 0.0]))
    shift = 10.0 + depth * EDGE * np.sqrt(2.0 / 3.0)
    position = looked.model.centre - np.outer([0.0, 1.0], [shift, 0.0, 0.0])
    ((_, share),) = looked.shares(position).items()
    expected = 2.0 * ((1.0 - 0.5 * depth) ** 3 - (1.0 - depth) ** 3)
    # Parts that a plane cuts: 64 or fewer a layer, three kinds each; five times the root of a 4th.
    assert abs(share - expected) < 5.0 * np.sqrt(0.25 * 2 * 192) / PARTS
    assert share > 0.0


@pytest.mark.parametrize("seed", range(2))
def test_share_is_that_of_the_smaller_body_whichever_is_first(seed):
    """A small body in a large one is within it, whole."""
    random = np.random.default_rng(seed)
    small = checked_mesh(single(0.1).points, single(0.1).tetrahedra, {})
    large = checked_mesh(single(EDGE).points, single(EDGE).tetrahedra, {})
    for mesh in (beside(small, large, [9, 0, 0]), beside(large, small, [9, 0, 0])):
        looked = Looked(mesh)
        turn, _ = quaternions(random, 2)
        assert looked.shares(np.zeros((2, 3)), turn) == {(0, 1): 1.0}


def test_bonded_bodies_are_left_out_until_their_bond_breaks():
    """Pressed into each other by half; the bond holds them, or has been released."""
    looked = Looked(pair(EDGE))
    assert looked.shares(0.5 * looked.model.centre) == {}
    looked.state.broken_tick.fill(0)
    ((bodies, share),) = looked.shares(0.49 * looked.model.centre).items()
    assert bodies == (0, 1) and share > DEEP


def test_a_solid_whose_bonds_hold_shares_little_though_it_is_pressed():
    """By a thousandth: bodies that share an edge or a corner are within each other by as much."""
    looked = Looked(bar(0.4, 0.1, (4, 1, 1)))
    assert max(looked.shares(0.999 * looked.model.centre).values(), default=0.0) < 0.01


def test_bodies_are_compared_once_one_has_moved_by_a_quarter_of_its_radius():
    looked = Looked(apart(2, EDGE))
    radius = looked.model.body_radius[0]
    for way, compared in ((0.0, False), (0.24, False), (0.26, True), (0.1, False), (0.52, True)):
        position = looked.model.centre + np.outer([0.0, 1.0], [way * radius, 0.0, 0.0])
        looked.state.set_motion(position)
        assert looked.volume.sample(1.0) == compared, way
    assert looked.volume.sample(1.0, finished=True) is False
    looked.state.set_motion(position + 1e-6)
    assert looked.volume.sample(1.0, finished=True) is True


def test_the_worst_pair_is_kept_and_survives_a_checkpoint():
    looked = Looked(apart(4, EDGE))
    centre = looked.model.centre
    seen = []
    for time_s, shift in ((1.0, 0.2), (2.0, 0.02), (3.0, 0.5)):
        position = centre.copy()
        position[1] = position[0] + [shift * EDGE, 0.0, 0.0]
        position[3] = position[2] + [0.1 * EDGE, 0.0, 0.0]
        seen.append(looked.shares(position, None, time_s))
    worst = looked.volume.worst
    assert (worst.bodies, worst.time_s, worst.deep) == ((0, 1), 2.0, 2)
    assert worst.share == seen[1][0, 1] > NOTABLE
    words = f"at most {100 * worst.share:.2g} % of a body, by bodies 0 and 1 at 2 s; 2 pairs above"
    assert str(worst).startswith(words)
    again = SharedVolume(looked.model, looked.state)
    assert str(again.worst) == "no volume shared"
    again.resume(looked.volume.saved())
    assert again.worst == worst and again.way() == looked.volume.way()


@pytest.mark.parametrize(
    ("listed", "words"),
    [
        ([], None),  # told as a missing effect
        ([effects.SphereContact(3)], "a larger contact_stiffness, or more divisions"),
        ([effects.SphereContact(3, outer_faces=False)], "SphereContact(outer_faces=True) lets"),
    ],
)
def test_contact_that_kept_nothing_apart_is_told(listed, words):
    looked = Looked(apart(2, EDGE), *listed)
    along = np.array([[0.0, 0.0, 0.0], [EDGE, 0.0, 0.0]])
    looked.shares(0.5 * along, None, 3.0)
    assert 0.0 < looked.volume.worst.share < NOTABLE and looked.volume.findings() == ()
    looked.shares(0.1 * along, None, 4.0)
    assert [words in found for found in looked.volume.findings()] == ([True] if words else [])
    assert all("at t = 4 s" in found for found in looked.volume.findings())


@pytest.mark.parametrize("broken", [(), (0,), (1, 4), range(14)])
def test_fragments_are_pieces_that_intact_bonds_hold(broken):
    looked = Looked(bar(0.2, 0.1, (2, 1, 1)))
    ticks = np.full(looked.state.broken_tick.to_numpy().shape, -1)
    ticks[list(broken)] = 5
    looked.state.broken_tick.from_numpy(ticks)
    top, group = looked.model.topology, list(range(12))
    for b in set(range(14)) - set(broken):
        old, new = group[top.master[b]], group[top.slave[b]]
        group = [new if g == old else g for g in group]
    assert looked.volume.fragments() == len(set(group))
