"""Supports of one body act together; a motion bears no contradiction.

Gas pressure against eq. 4 of Konno et al. and against momentum.
"""

from itertools import permutations

import numpy as np
import pytest

from taichi_dem import (
    CONCRETE,
    InputError,
    Scene,
    Simulation,
    Uniform,
    checked_mesh,
    effects,
    simulate,
)
from taichi_dem.mesh.shapes import single
from tests.structures import filled
from tests.turns import matrix, quaternion

OBLIQUE = (1.0, 0.0, 0.0), (0.6, 0.8, 0.0), (0.2, -0.3, 0.9)
PUSH = (1.0, 0.0, 0.0)
EPS = np.finfo(float).eps
PEAK, RISE, RATIO = 575e6, 2.0**-13, 2.75
#: A whole number of steps to the peak.
STEP, TO_PEAK = RISE / 64, 64
#: One body, rotated against the axes, loaded on one face.
POINTS = np.array([[0, 0, 0], [0.06, 0.01, 0], [0.01, 0.05, 0], [0.02, 0.01, 0.055]])
FACE = [1, 2, 3]


def motion_of(mesh, held, method, spin=(0.0, 0.0, 0.0)):
    """Velocities after a push, and rotations; bodies differ in the planes that hold them."""
    listed = [*held, effects.Gravity((3e4, 2e4, -4e4))]
    result = simulate(
        Scene(mesh, CONCRETE, listed, spin=spin), method=method, until=2e-5, frames=1, progress=None
    )
    return result.frames[-1].velocity, result.frames[-1].rotation


def on_planes(*normals, spin=(0.0, 0.0, 0.0)):
    """Motion of one body, of no symmetry, whose face is held on three planes."""
    regular = single(0.1)
    mesh = checked_mesh(regular.points * [1.0, 1.5, 0.8], regular.tetrahedra, regular.groups)
    (name, *_) = mesh.groups
    held = [effects.Roller(name, normal) for normal in normals]
    return motion_of(mesh, held, Uniform(1e-7), spin)


def test_a_body_on_two_planes_slides_along_both_and_does_not_turn():
    """The third plane is the first, seen from its other side."""
    velocity, rotation = on_planes(*OBLIQUE[:2], (-1.0, 0.0, 0.0))
    assert np.abs(velocity @ np.array(OBLIQUE[:2]).T).max() < 1e-12 * np.abs(velocity).max()
    assert np.abs(velocity).max() > 0.1
    assert np.array_equal(rotation[0], np.eye(3))


def test_a_body_on_one_plane_turns_about_its_normal_alone():
    """As fast as it did, for it has no torque about it: by 1e4 rad/s in 2e-5 s."""
    normal = np.array([0.6, 0.8, 0.0])
    velocity, (rotation,) = on_planes(normal, normal, -normal, spin=1e4 * normal)
    assert np.abs(velocity @ normal).max() < 1e-12 * np.abs(velocity).max()
    assert np.abs(rotation @ normal - normal).max() < 1e-12
    assert np.trace(rotation) == pytest.approx(1.0 + 2.0 * np.cos(0.2), abs=1e-9)


@pytest.mark.parametrize(
    "other",
    [lambda group: effects.Fixed(group), lambda group: effects.PrescribedMotion(group, PUSH, 10.0)],
)
def test_supports_that_contradict_a_motion_are_refused(other):
    mesh = single(0.1)
    (name, *_) = mesh.groups
    for held in permutations([effects.PrescribedMotion(name, PUSH), other(name)]):
        with pytest.raises(InputError, match=r"must not share bodies .* got body 0 in both"):
            motion_of(mesh, held, Uniform(1e-7))


@pytest.fixture
def body():
    """A free body under the pulse."""
    mesh = checked_mesh(POINTS, [[0, 1, 2, 3]], {"hole": [FACE]})
    gas = effects.GasPressure("hole", PEAK, RISE)
    return Simulation(Scene(mesh, CONCRETE, filled("bonds", gas)), Uniform(STEP))


def push_of(body):
    """Force per pressure and its torque about the centre, from the corners alone [m^2, m^3]."""
    a, b, c = POINTS[FACE]
    area = 0.5 * np.cross(b - a, c - a)
    area *= np.sign(area @ (a - POINTS[0]))
    return -area, np.cross((a + b + c) / 3.0 - POINTS.mean(axis=0), -area)


def test_pulse_has_the_values_of_equation_4(body):
    """cos2(pi/2 (t/a - 1)), then cos(pi/(2b) (t/a - 1)), zero before and after."""
    times = RISE * np.array([-0.1, 0.0, 1 / 3, 0.5, 1.0, 1.0 + RATIO / 2, 1.0 + RATIO, 4.0, 9.0])
    shares = np.array([0.0, 0.0, 0.25, 0.5, 1.0, np.sqrt(0.5), 0.0, 0.0, 0.0])
    pressure = body.tables.loads[0].pressure_at(times)
    assert np.abs(pressure / PEAK - shares).max() < 8 * EPS


def test_pressure_turns_with_the_body(body):
    """From rest in a turned position: v = R f J / m, L = R t J after the first step.

    It acts up to its middle, at u = dt / (2 a): J = P0 a (u / 2) (1 - sin(x) / x) with x = pi u, as
    1 - cos(x) is twice a squared sine; by its series, as x is small.
    """
    turn = quaternion([1.0, 2.0, -0.5], 2.0)
    body.state.set_motion(body.model.centre, [turn])
    body.advance_to(1)
    force, torque = (matrix(turn) @ part for part in push_of(body))
    u = 0.5 / TO_PEAK
    x2 = (np.pi * u) ** 2
    shortfall = x2 / 6.0 * (1.0 - x2 / 20.0 * (1.0 - x2 / 42.0 * (1.0 - x2 / 72.0)))
    impulse = PEAK * RISE * 0.5 * u * shortfall
    motion = body.state.motion()
    expected = impulse / body.model.body_mass[0] * force
    # The cosine of an angle near pi / 2 is known to eps absolutely: 0.006 in the middle.
    error = 2 * 2 * EPS / 0.006 + 20 * EPS
    assert np.abs(motion["velocity"][0] - expected).max() < error * np.linalg.norm(expected)
    gained = motion["angular_momentum"][0] - impulse * torque
    assert np.abs(gained).max() < 4 * error * impulse * np.linalg.norm(torque)
    booked = body.values(body.state.load_impulse)[0]
    assert np.abs(booked[:3] - impulse * force).max() < error * impulse * np.linalg.norm(force)
