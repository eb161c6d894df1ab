"""Several supports of one body: their order does not matter, and contradictions are refused."""

from itertools import permutations

import numpy as np
import pytest

from taichi_dem import CONCRETE, ImplicitDashpots, InputError, Scene, Uniform, effects, simulate
from taichi_dem.mesh.shapes import bar, single

OBLIQUE = (1.0, 0.0, 0.0), (0.6, 0.8, 0.0), (0.2, -0.3, 0.9)


def two_sided(normals):
    """One body with a group for each normal; groups of the bar's sides."""
    mesh = bar(0.1, 0.1, (1, 1, 1))
    names = ("left", "bottom", "back")
    return mesh, [effects.Roller(name, normal) for name, normal in zip(names, normals)]


def motion_of(mesh, held, method):
    """Velocities after a push; bodies differ in the planes that hold them."""
    listed = [*held, effects.Gravity((3e4, 2e4, -4e4)), effects.BondDamping()]
    result = simulate(
        Scene(mesh, CONCRETE, listed), method=method, until=2e-5, frames=1, progress=None
    )
    return result.frames[-1].velocity, result.frames[-1].rotation


@pytest.mark.parametrize(
    "method", [Uniform(1e-8), pytest.param(ImplicitDashpots(2e-7), marks=pytest.mark.slow)]
)
def test_the_order_of_rollers_changes_nothing_but_rounding(method):
    mesh, held = two_sided(OBLIQUE)
    found = [motion_of(mesh, order, method) for order in permutations(held)]
    scale = np.abs(found[0][0]).max()
    for velocity, rotation in found[1:]:
        assert np.abs(velocity - found[0][0]).max() < 1e-9 * scale
        assert np.abs(rotation - found[0][1]).max() < 1e-9


def test_a_body_on_two_planes_slides_along_both_and_does_not_turn():
    mesh = single(0.1)
    names = list(mesh.groups)[:1]
    held = [effects.Roller(names[0], normal) for normal in OBLIQUE[:2]]
    velocity, rotation = motion_of(mesh, held, Uniform(1e-7))
    assert np.abs(velocity @ np.array(OBLIQUE[:2]).T).max() < 1e-12 * np.abs(velocity).max()
    assert np.abs(velocity).max() > 0.1
    assert np.array_equal(rotation[0], np.eye(3))


def test_three_planes_hold_a_body():
    mesh = single(0.1)
    (name, *_) = mesh.groups
    velocity, _ = motion_of(mesh, [effects.Roller(name, n) for n in OBLIQUE], Uniform(1e-7))
    assert np.abs(velocity).max() < 1e-12


PUSH = (1.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("other", "contradicts"),
    [
        (lambda group: effects.Fixed(group), True),
        (lambda group: effects.Roller(group, (1.0, 1.0, 0.0)), True),
        (lambda group: effects.Roller(group, (0.0, 1.0, 0.0)), False),
        (lambda group: effects.PrescribedMotion(group, PUSH), False),
        (lambda group: effects.PrescribedMotion(group, PUSH, 10.0), True),
        (lambda group: effects.PrescribedMotion(group, (1.0, 0.1, 0.0)), True),
    ],
)
def test_supports_that_contradict_a_motion_are_refused(other, contradicts):
    mesh = single(0.1)
    (name, *_) = mesh.groups
    for held in permutations([effects.PrescribedMotion(name, PUSH), other(name)]):
        if contradicts:
            with pytest.raises(InputError, match=r"must not share bodies .* got body 0 in both"):
                motion_of(mesh, held, Uniform(1e-7))
        else:
            velocity, _ = motion_of(mesh, held, Uniform(1e-7))
            assert velocity[0].tolist() == pytest.approx(PUSH, abs=1e-12)
