"""A scene whose parts may meet or whose friction never acts is told so before a run."""

from dataclasses import replace

import pytest

from taichi_dem import CONCRETE, Scene, effects
from taichi_dem.mesh.shapes import bar, pair
from taichi_dem.scene import outer_faces_warnings, scene_warnings
from tests.scenes import beside

BAR = bar(0.2, 0.05, (4, 1, 1))
FALL, HELD = effects.Gravity(), effects.Fixed("first left")


def moved(which, *velocity, frequency=0.0):
    """A support that moves one bar, or both ("left")."""
    return effects.PrescribedMotion(which, velocity, frequency)


def told(shift, *listed):
    """Whether a bar, and another shifted by some metres, are told that they may meet."""
    mesh = beside(BAR, BAR, shift)
    return bool(outer_faces_warnings(Scene(mesh, CONCRETE, (effects.BondDamping(), *listed))))


@pytest.mark.parametrize(
    ("shift", "listed", "expected"),
    [
        # Driven along x past each other, and away.
        ([3.0, 1.0, 0], [moved("first left", 50, 0, 0)], False),
        ([3.0, 0, 0], [moved("first left", -50, 0, 0)], False),
        # A shaker moves as far as its velocity over 2 pi f: 8 mm and 8 m.
        ([3.0, 0, 0], [moved("first left", 50, 0, 0, frequency=1000.0)], False),
        ([3.0, 0, 0], [moved("first left", 50, 0, 0, frequency=1.0)], True),
        # Side by side on one shaker: only what is near may touch.
        ([0, 0.06, 0], [moved("left", 50, 0, 0)], True),
        ([1.0, 0, 0], [moved("left", 50, 0, 0)], False),
        # Falls upon one that is held, and beside it; all falls alike; gas may go anywhere.
        ([0, 1.0, 0], [HELD, FALL], True),
        ([1.0, 0, 0], [HELD, FALL], False),
        ([0, 0.06, 0], [FALL], False),
        ([3.0, 1.0, 0], [effects.GasPressure("first left")], True),
    ],
)
def test_parts_without_contact_are_told_where_they_may_come_to_meet(shift, listed, expected):
    assert told(shift, *listed) == expected
    assert not told(shift, *listed, effects.SphereContact(outer_faces=True))
    assert told(shift, *listed, effects.SphereContact(outer_faces=False))


@pytest.mark.parametrize(
    ("friction", "damping", "count"),
    [(effects.Friction, 0.0, 1), (effects.Friction, 1.0, 0), (effects.StickingFriction, 0.0, 0)],
)
@pytest.mark.parametrize("contact", [effects.SphereContact(), effects.BodyContact()])
def test_friction_that_no_dashpot_carries_is_told_before_a_run(contact, friction, damping, count):
    """A scene is damped by the dashpots of its contact, and no other."""
    lossless = {"contact_damping": 0.0, "normal_damping": 0.0, "shear_damping": 0.0}
    material = replace(CONCRETE, **{**lossless, contact.constants[1]: damping})
    made = Scene(pair(), material, [contact, friction()])
    assert len(scene_warnings(made)) == count
    assert made.damped() == (damping > 0.0) and not made.damped(touching=False)
