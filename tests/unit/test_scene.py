"""A scene whose parts may meet, or whose number has another unit, is told so before a run.

A scene that begins in motion runs as one whose bodies were set in motion by hand.
"""

import pickle
import warnings

import numpy as np
import pytest

from ca_damper import Spheres
from taichi_dem import (
    CONCRETE,
    Multirate,
    Scene,
    Simulation,
    Uniform,
    effects,
    shapes,
    simulate,
)
from taichi_dem.kit.likely_units import UnitWarning
from taichi_dem.mesh.shapes import bar, placed_together
from taichi_dem.scene import outer_faces_warnings
from taichi_dem.simulate import run_simulation
from tests.scenes import apart, beside

BAR = bar(0.2, 0.05, (4, 1, 1))
FALL, HELD = effects.Gravity(), effects.Fixed("first_left")
START = bar(0.2, 0.1, (2, 1, 1))
CENTRE = START.points[START.tetrahedra].mean(axis=1)
COUNT, METHOD, UNTIL = START.body_count, Uniform(1e-7), 2e-6
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


def scene(**options):
    return Scene(START, CONCRETE, [], **options)


@pytest.fixture(scope="module")
def by_hand(taichi_session):
    """Result of a run whose motion was set before it."""
    simulation = Simulation(scene(), METHOD)
    simulation.state.set_motion(simulation.model.centre, velocity=ROWS[0], spin=ROWS[1])
    return run_simulation(simulation, until=UNTIL, samples=2, frames=1, progress=None)


def assert_same(result, other):
    for name in ("position", "velocity", "rotation"):
        first, second = (getattr(one.frames[-1], name) for one in (result, other))
        assert first.tobytes() == second.tobytes(), name
    for name, column in result.series.items():
        assert column.tobytes() == other.series[name].tobytes(), name


def test_a_moving_scene_has_the_bits_of_a_motion_set_by_hand(by_hand):
    moving = scene(velocity=lambda x: ROWS[0], spin=ROWS[1])
    options = {"method": METHOD, "until": UNTIL, "samples": 2, "frames": 1, "progress": None}
    assert_same(simulate(moving, **options), by_hand)
    assert_same(simulate(pickle.loads(pickle.dumps(moving)), **options), by_hand)


def test_body_groups_move_and_turn_each_for_itself_as_one_rigid_body():
    two = placed_together({"a": (START, (0, 0, 0)), "b": (START, (1.0, 0, 0))})
    spin = np.array([0.0, 3.0, -4.0])
    made = Scene(two, CONCRETE, [], velocity={"a": (1, 0, 0)}, spin={"b": spin})
    expected, motion = np.cross(spin, CENTRE - [0.1, 0.05, 0.05]), made.initial_motion
    assert (motion["velocity"][:COUNT] == [1.0, 0.0, 0.0]).all()
    assert not motion["spin"][:COUNT].any() and (motion["spin"][COUNT:] == spin).all()
    np.testing.assert_allclose(motion["velocity"][COUNT:], expected, atol=1e-14)


@pytest.mark.parametrize("kind", [Uniform, Multirate])
def test_no_body_moves_further_than_the_distance_in_a_step(kind):
    """dt_i <= l / |v_i| (Konno et al., 3.1), and none could be twice as long; dt0 is a step of all.

    A uniform run takes the step of the fastest for all. Every body is visited when its own step
    ends, and not more often.
    """
    count, dt0, distance = 40, 1e-6, 1e-8
    speed = 10.0 ** np.random.default_rng(5).uniform(-4.0, 0.5, count)
    velocity = speed[:, None] * [1.0, 0.0, 0.0]
    simulation = Simulation(Scene(apart(count), CONCRETE, velocity=velocity), kind(dt0, distance))
    simulation.advance_to(3)
    allowed = speed if kind is Multirate else np.full(count, speed.max())
    wanted = np.maximum(0, np.ceil(np.log2(allowed * dt0 / distance))).astype(int)
    assert simulation.values(simulation.state.level).tolist() == wanted.tolist()
    assert simulation.report().body_updates == 3 * (2**wanted).sum()


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
