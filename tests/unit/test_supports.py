"""Supports of one body act together whatever their order; a motion bears no contradiction."""

from itertools import permutations

import numpy as np
import pytest

from taichi_dem import CONCRETE, InputError, Scene, Uniform, checked_mesh, effects, simulate
from taichi_dem.mesh.shapes import bar, single

OBLIQUE = (1.0, 0.0, 0.0), (0.6, 0.8, 0.0), (0.2, -0.3, 0.9)
PUSH = (1.0, 0.0, 0.0)


def motion_of(mesh, held, method, spin=(0.0, 0.0, 0.0)):
    """Velocities after a push, and rotations; bodies differ in the planes that hold them."""
    listed = [*held, effects.Gravity((3e4, 2e4, -4e4))]
    result = simulate(
        Scene(mesh, CONCRETE, listed, spin=spin), method=method, until=2e-5, frames=1, progress=None
    )
    return result.frames[-1].velocity, result.frames[-1].rotation


def test_the_order_of_rollers_changes_nothing_but_rounding():
    names = ("left", "bottom", "back")
    held = [effects.Roller(name, normal) for name, normal in zip(names, OBLIQUE)]
    found = [
        motion_of(bar(0.1, 0.1, (1, 1, 1)), order, Uniform(1e-8)) for order in permutations(held)
    ]
    scale = np.abs(found[0][0]).max()
    for velocity, rotation in found[1:]:
        assert np.abs(velocity - found[0][0]).max() < 1e-9 * scale
        assert np.abs(rotation - found[0][1]).max() < 1e-9


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
    [
        lambda group: effects.Fixed(group),
        lambda group: effects.PrescribedMotion(group, PUSH, 10.0),
    ],
)
def test_supports_that_contradict_a_motion_are_refused(other):
    mesh = single(0.1)
    (name, *_) = mesh.groups
    for held in permutations([effects.PrescribedMotion(name, PUSH), other(name)]):
        with pytest.raises(InputError, match=r"must not share bodies .* got body 0 in both"):
            motion_of(mesh, held, Uniform(1e-7))
