"""A scene whose parts may meet, or whose number has another unit, is told so before a run.

It begins in the motion that it is given; its supports act together, and bear no contradiction.
"""

import pickle
import warnings

import numpy as np
import pytest

from ca_damper import Spheres
from taichi_dem import (
    CONCRETE,
    InputError,
    Scene,
    Simulation,
    Uniform,
    checked_mesh,
    effects,
    shapes,
    simulate,
)
from taichi_dem.kit.likely_units import UnitWarning
from taichi_dem.mesh.shapes import bar, placed_together, single
from taichi_dem.scene import outer_faces_warnings
from tests.scenes import beside, matrix, quaternion
from tests.structures import filled

BAR = bar(0.2, 0.05, (4, 1, 1))
SIDE, FALL, HELD = "base", effects.Gravity(), effects.Fixed("first_left")
START = bar(0.2, 0.1, (2, 1, 1))
CENTRE = START.points[START.tetrahedra].mean(axis=1)
COUNT, METHOD = START.body_count, Uniform(1e-7)
ROWS = np.random.default_rng(3).uniform(-1.0, 1.0, (2, COUNT, 3))


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
        ([3.0, 1.0, 0], [moved("first_left", 50, 0, 0)], False),
        ([3.0, 0, 0], [moved("first_left", -50, 0, 0)], False),
        # A shaker moves as far as its velocity over 2 pi f: 8 mm and 8 m.
        ([3.0, 0, 0], [moved("first_left", 50, 0, 0, frequency=1000.0)], False),
        ([3.0, 0, 0], [moved("first_left", 50, 0, 0, frequency=1.0)], True),
        # Side by side on one shaker: only what is near may touch.
        ([0, 0.06, 0], [moved("left", 50, 0, 0)], True),
        ([1.0, 0, 0], [moved("left", 50, 0, 0)], False),
        # Falls upon one that is held, and beside it; all falls alike; gas may go anywhere.
        ([0, 1.0, 0], [HELD, FALL], True),
        ([1.0, 0, 0], [HELD, FALL], False),
        ([0, 0.06, 0], [FALL], False),
        ([3.0, 1.0, 0], [effects.GasPressure("first_left")], True),
    ],
)
def test_parts_without_contact_are_told_where_they_may_come_to_meet(shift, listed, expected):
    assert told(shift, *listed) == expected
    assert not told(shift, *listed, effects.SphereContact(outer_faces=True))
    assert told(shift, *listed, effects.SphereContact(outer_faces=False))


def test_a_moving_scene_begins_in_its_motion_also_after_pickling():
    moving = Scene(START, CONCRETE, [], velocity=lambda x: ROWS[0], spin=ROWS[1])
    for scene in (moving, pickle.loads(pickle.dumps(moving))):
        motion = Simulation(scene, METHOD).state.motion()
        assert np.array_equal(motion["velocity"], ROWS[0])
        assert motion["spin"] == pytest.approx(ROWS[1], rel=1e-13)


def test_body_groups_move_and_turn_each_for_itself_as_one_rigid_body():
    two = placed_together({"a": (START, (0, 0, 0)), "b": (START, (1.0, 0, 0))})
    spin = np.array([0.0, 3.0, -4.0])
    made = Scene(two, CONCRETE, [], velocity={"a": (1, 0, 0)}, spin={"b": spin})
    expected, motion = np.cross(spin, CENTRE - [0.1, 0.05, 0.05]), made.initial_motion
    assert (motion["velocity"][:COUNT] == [1.0, 0.0, 0.0]).all()
    assert not motion["spin"][:COUNT].any() and (motion["spin"][COUNT:] == spin).all()
    np.testing.assert_allclose(motion["velocity"][COUNT:], expected, atol=1e-14)


#: Builder, a value in the wrong unit, how many of the unit it is read in are one of the likely one.
CASES = {
    "peak": (lambda x: effects.GasPressure(peak=x), 575.0, 1e6),
    "rise": (lambda x: effects.GasPressure(rise=x), 0.133, 1e-3),
    "element": (lambda x: shapes.block(4.0 * x, element=x), 100.0, 1e-3),
    "particle_mass": (lambda x: Spheres(particle_mass=x), 0.2, 1e-3),
}


@pytest.mark.parametrize("name", CASES)
def test_a_number_in_the_likely_unit_is_warned_about_and_in_its_own_is_not(name):
    build, value, factor = CASES[name]
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        try:
            build(value)
        except ValueError:
            pass  # a wrong unit may lie out of the range of another option too
    assert any(one.category is UnitWarning and name in str(one.message) for one in told)
    build(value * factor)


def on_planes(*normals, spin=(0.0, 0.0, 0.0)):
    """Velocity and rotation of a body of no symmetry that is pushed, its face held on planes."""
    regular = single(0.1)
    mesh = checked_mesh(regular.points * [1.0, 1.5, 0.8], regular.tetrahedra, regular.groups)
    held = [effects.Roller(SIDE, normal) for normal in normals]
    scene = Scene(mesh, CONCRETE, [*held, effects.Gravity((3e4, 2e4, -4e4))], spin=spin)
    (frame,) = simulate(scene, method=METHOD, until=2e-5, frames=1, progress=None).frames[-1:]
    return frame.velocity[0], frame.rotation[0]


def test_a_body_on_two_planes_slides_along_both_and_does_not_turn():
    """The third plane is the first, seen from its other side."""
    planes = np.array([(1.0, 0.0, 0.0), (0.6, 0.8, 0.0), (-1.0, 0.0, 0.0)])
    velocity, rotation = on_planes(*planes)
    assert np.abs(planes @ velocity).max() < 1e-12 * np.abs(velocity).max()
    assert np.abs(velocity).max() > 0.1
    assert np.array_equal(rotation, np.eye(3))


def test_a_body_on_one_plane_turns_about_its_normal_alone():
    """As fast as it did, for it has no torque about it: by 1e4 rad/s in 2e-5 s."""
    normal = np.array([0.6, 0.8, 0.0])
    velocity, rotation = on_planes(normal, normal, -normal, spin=1e4 * normal)
    assert abs(velocity @ normal) < 1e-12 * np.abs(velocity).max()
    assert np.abs(rotation @ normal - normal).max() < 1e-12
    assert np.trace(rotation) == pytest.approx(1.0 + 2.0 * np.cos(0.2), abs=1e-9)


@pytest.mark.parametrize("other", [effects.Fixed(SIDE), moved(SIDE, 1.0, 0.0, 0.0, frequency=10.0)])
def test_supports_that_contradict_a_motion_are_refused(other):
    scene = Scene(single(0.1), CONCRETE, [moved(SIDE, 1.0, 0.0, 0.0), other])
    with pytest.raises(InputError, match=r"must not share bodies .* got body 0 in both"):
        Simulation(scene, METHOD)


def test_pressure_turns_with_the_body():
    """From rest in a turned position, one face of four: v = R f J / m, L = R t J, of one J.

    f, t: force per pressure and its torque about the centre, from the corners alone [m^2, m^3].
    """
    points = np.array([[0, 0, 0], [0.06, 0.01, 0], [0.01, 0.05, 0], [0.02, 0.01, 0.055]])
    mesh = checked_mesh(points, [[0, 1, 2, 3]], {"left": [[1, 2, 3]]})
    gas = effects.GasPressure("left", peak=575e6, rise=2.0**-13)
    body = Simulation(Scene(mesh, CONCRETE, filled("bonds", gas)), Uniform(2.0**-19))
    turn = quaternion([1.0, 2.0, -0.5], 2.0)
    body.state.set_motion(body.model.centre, [turn])
    body.advance_to(1)
    a, b, c = points[1:]
    force = -0.5 * np.cross(b - a, c - a)
    torque = np.cross((a + b + c) / 3.0 - points.mean(axis=0), force)
    force, torque = matrix(turn) @ force, matrix(turn) @ torque
    motion, booked = body.state.motion(), body.values(body.state.load_impulse)[0]
    given = body.model.body_mass[0] * motion["velocity"][0]
    impulse = given @ force / (force @ force)
    assert impulse > 0.0
    assert given == pytest.approx(impulse * force, rel=1e-13)
    assert motion["angular_momentum"][0] == pytest.approx(impulse * torque, rel=1e-12)
    assert booked[:3] == pytest.approx(impulse * force, rel=1e-13)


def test_effects_that_are_absent_have_no_fields():
    fields = Simulation(Scene(single(), CONCRETE, []), METHOD).state.fields()
    assert fields.keys().isdisjoint({"bond_drag", "bond_heat"})
