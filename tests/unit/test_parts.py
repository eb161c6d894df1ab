"""Parts without contact: which scenes are told that they may meet, before a run."""

import sys

import numpy as np
import pytest

from taichi_dem import CONCRETE, Scene, Uniform, checked_mesh, effects, simulate
from taichi_dem.effects.base import Effect
from taichi_dem.mesh.parts import any_overlap, part_boxes, parts_of
from taichi_dem.mesh.shapes import bar, pair, single
from taichi_dem.scene import outer_faces_warnings
from taichi_dem.stability.step_report import step_report
from tests.scenes import beside

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
    assert told(shift, *listed, effects.SphereContact(outer_faces=False))
    assert not told(shift, *listed, effects.SphereContact())


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


EDGE = 0.05
TWO = beside(single(EDGE), single(EDGE), [1.0, 0.0, 0.0])


@pytest.mark.parametrize(
    ("mesh", "listed", "said"),
    [
        (TWO, [effects.SphereContact(outer_faces=False)], True),
        (TWO, [effects.SphereContact(outer_faces=True)], False),
        (TWO, [effects.SphereContact()], False),
        (TWO, [effects.BondDamping(), effects.GasPressure("sides")], True),
        (TWO, [effects.BondDamping()], False),
        (pair(EDGE), [effects.SphereContact(outer_faces=False)], False),
        (bar(0.2, 0.1, (2, 1, 1)), [effects.SphereContact(outer_faces=False)], False),
    ],
)
def test_parts_that_may_pass_through_each_other_are_told_before_a_run(mesh, listed, said):
    scene = Scene(mesh, CONCRETE, listed)
    sentences = outer_faces_warnings(scene)
    assert len(sentences) == said
    assert all("SphereContact(outer_faces=True)" in sentence for sentence in sentences)
    spheres = any(effect.role == "contact" for effect in listed)
    assert all(("no contact is listed" in sentence) != spheres for sentence in sentences)
    assert str(step_report(scene)).count("warning: the mesh has 2 parts") == said


def test_simulate_warns_before_anything_is_compiled(monkeypatch):
    class Reached(Exception):
        pass

    def reached(*arguments):
        raise Reached

    monkeypatch.setattr(sys.modules["taichi_dem.simulate"], "Simulation", reached)
    scene = Scene(TWO, CONCRETE, [effects.SphereContact(outer_faces=False)])
    with pytest.warns(UserWarning, match="2 parts that no bond joins"), pytest.raises(Reached):
        simulate(scene, method=Uniform(), until=1e-8)
