"""Parts without contact: which scenes are told that they may meet, and when they have met."""

import numpy as np
import pytest
from taichi_dem.diagnostics.part_overlaps import PartOverlaps

from taichi_dem import CONCRETE, Scene, Simulation, Uniform, checked_mesh, effects
from taichi_dem.effects.base import Effect
from taichi_dem.mesh.parts import any_overlap, part_boxes, parts_of
from taichi_dem.mesh.shapes import bar, single
from taichi_dem.scene import outer_faces_warnings
from tests.unit.test_outer_faces import beside, quaternions

BAR = bar(0.2, 0.05, (4, 1, 1))
FALL, GAS = effects.Gravity(), effects.GasPressure("first left")


class Wind(Effect):
    """A load of a user's own, of which nothing is known."""

    role, name = "load", "wind"
    acts_on = wrench = lambda *_: None


def moved(which, *velocity, frequency=0.0):
    """A support that moves one bar, or both ("left")."""
    return effects.PrescribedMotion(which, velocity, frequency)


def told(shift, *listed):
    """Whether a bar, and another shifted by some metres, are told that they may meet."""
    mesh = beside(BAR, BAR, shift)
    return bool(outer_faces_warnings(Scene(mesh, CONCRETE, (effects.BondDamping(), *listed))))


HELD = effects.Fixed("first left")


@pytest.mark.parametrize(
    ("shift", "listed", "expected"),
    [
        # Driven along x into each other, past each other, away, and round in circles.
        ([3.0, 0, 0], [moved("first left", 50, 0, 0)], True),
        ([3.0, 0, 0], [HELD, moved("second right", -50, 0, 0)], True),
        ([3.0, 0, 0], [moved("first left", -50, 0, 0)], False),
        ([3.0, 1.0, 0], [moved("first left", 50, 0, 0)], False),
        ([3.0, 1.0, 0], [moved("first left", 50, 20, 0)], True),
        # A shaker moves as far as its velocity over 2 pi f: 8 mm and 8 m.
        ([3.0, 0, 0], [moved("first left", 50, 0, 0, frequency=1000.0)], False),
        ([3.0, 0, 0], [moved("first left", 50, 0, 0, frequency=1.0)], True),
        # Side by side, on one shaker or under their weight: only what is near may touch.
        ([0, 0.06, 0], [moved("left", 50, 0, 0)], True),
        ([1.0, 0, 0], [moved("left", 50, 0, 0)], False),
        ([0, 1.0, 0], [effects.Fixed("left"), FALL], False),
        # Falls upon one that is held, and beside it.
        ([0, 1.0, 0], [HELD, FALL], True),
        ([1.0, 0, 0], [HELD, FALL], False),
        # Nothing moves, or all falls alike.
        ([0, 0.06, 0], [], False),
        ([0, 0.06, 0], [HELD], False),
        ([0, 0.06, 0], [HELD, effects.Roller("second right", (1, 0, 0))], False),
        ([0, 0.06, 0], [moved("first left", 0, 0, 0)], False),
        ([0, 0.06, 0], [FALL], False),
        # What may go anywhere.
        ([3.0, 1.0, 0], [GAS], True),
        ([3.0, 1.0, 0], [effects.GasPressure("left")], True),
        ([3.0, 1.0, 0], [Wind()], True),
    ],
)
def test_parts_without_contact_are_told_where_they_may_come_to_meet(shift, listed, expected):
    assert told(shift, *listed) == expected
    assert not told(shift, *listed, effects.SphereContact(outer_faces=True))
    assert told(shift, *listed, effects.SphereContact())


@pytest.mark.parametrize("seed", range(4))
def test_overlap_of_boxes_is_that_of_all_pairs(seed):
    random = np.random.default_rng(seed)
    for _ in range(50):
        low = random.random((12, 3))
        high = low + 0.25 * random.random((12, 3))
        high[random.random((12, 3)) < 0.03] = np.inf
        meets = ((low[:, None] < high) & (low < high[:, None])).all(axis=2)
        assert any_overlap(low, high) == (meets.sum() > 12)


def test_touching_boxes_do_not_overlap():
    low = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    assert not any_overlap(low, low + 1.0)


def test_boxes_of_parts_hold_their_corners_whatever_the_order_of_bodies():
    mesh = beside(BAR, BAR, [1.0, 0.0, 0.0])
    mixed = np.random.default_rng(1).permutation(mesh.body_count)
    mesh = checked_mesh(mesh.points, mesh.tetrahedra[mixed], {})
    part = parts_of(mesh)
    low, high = part_boxes(mesh.points[mesh.tetrahedra], part)
    order = np.argsort(low[:, 0])
    np.testing.assert_allclose(low[order], [[0, 0, 0], [1, 0, 0]], atol=1e-15)
    np.testing.assert_allclose(high[order], [[0.2, 0.05, 0.05], [1.2, 0.05, 0.05]], atol=1e-15)


class Parts:
    """Bodies of a mesh without contact, put anywhere and looked at."""

    def __init__(self, mesh):
        simulation = Simulation(Scene(mesh, CONCRETE), Uniform())
        self.model, self.state = simulation.model, simulation.state
        self.looker = PartOverlaps(self.model, self.state, parts_of(mesh))

    def found(self, position, orientation=None):
        """Pairs that are found with the bodies at a position [m], (n, 3)."""
        still = np.tile([1.0, 0.0, 0.0, 0.0], (self.model.body_count, 1))
        self.state.set_motion(position, still if orientation is None else orientation)
        return int(self.looker.overlaps().sum())


@pytest.fixture(scope="module")
def bars():
    """Two bars, 1 m from each other along x."""
    return Parts(beside(BAR, BAR, [1.0, 0.0, 0.0]))


@pytest.mark.parametrize(
    ("shift", "meets"),
    [
        ([0, 0, 0], False),
        ([-0.8 + 1e-6, 0, 0], False),
        ([-0.8, 0, 0], False),  # end against end
        ([-0.8 - 1e-3, 0, 0], True),
        ([-1.0, 0, 0], True),  # the same place
        ([-1.0, 0.05, 0], False),  # side by side
        ([-1.0, 0.049, 0], True),
        ([-1.0, 0, 0.02], True),
        ([-2.0, 0, 0], False),  # driven through, and beyond
    ],
)
def test_parts_that_are_within_each_other_are_found(bars, shift, meets):
    second = np.arange(bars.model.body_count) >= BAR.body_count
    assert bool(bars.found(bars.model.centre + np.outer(second, shift))) == meets


def test_bodies_of_one_part_are_never_found(bars):
    """Each bar crushed into a point: its own bodies overlap, the parts stay apart."""
    second = np.arange(bars.model.body_count) >= BAR.body_count
    assert bars.found(0.05 * bars.model.centre + np.outer(second, [1.0, 0, 0])) == 0


def depth(first, second):
    """How far two tetrahedra (4, 3) overlap along the axis on which they do least [m].

    Axes: across all pairs of edges of both, which the edges of one body make its faces.
    """
    edges = [
        np.array([b - a for k, a in enumerate(body) for b in body[k + 1 :]])
        for body in (first, second)
    ]
    every = np.vstack(edges)
    axes = np.cross(every[:, None], every[None]).reshape(-1, 3)
    size = np.linalg.norm(axes, axis=1)
    axes = axes[size > 1e-9] / size[size > 1e-9, None]
    one, other = first @ axes.T, second @ axes.T
    return (np.minimum(one.max(0), other.max(0)) - np.maximum(one.min(0), other.min(0))).min()


@pytest.mark.parametrize("seed", range(3))
def test_found_pairs_are_those_that_no_plane_parts(seed):
    """A heap of single bodies turned at random, against a search over all axes with NumPy."""
    random = np.random.default_rng(seed)
    mesh = single(0.05)
    for k in range(1, 12):
        mesh = beside(checked_mesh(mesh.points, mesh.tetrahedra, {}), single(0.05), [k, 0, 0])
    heap = Parts(mesh)
    position = 0.1 * random.random((12, 3))
    turn, rotation = quaternions(random, 12)
    corners = position[:, None] + np.einsum("nij,ncj->nci", rotation, heap.looker.arms)
    depths = [depth(corners[i], corners[j]) for i in range(12) for j in range(i)]
    assert min(np.abs(depths)) > 1e-5  # no pair so close to touching that the two may differ
    assert heap.found(position, turn) == sum(d > 0 for d in depths) > 0
