"""Bodies that creep where friction would hold them are told, and no others are.

Friction without springs is a drag, here of spheres. A tetrahedron on a slope, of which
``test_sticking_friction`` says how the ground is made: friction of 0.4 holds it up to 21.8 degrees.
"""

import math
from dataclasses import replace

import numpy as np
import pytest

from taichi_dem import (
    CONCRETE,
    ImplicitDashpots,
    Scene,
    checked_mesh,
    effects,
    goals,
    simulate,
    solve,
)
from taichi_dem.mesh.shapes import single

GROUND, EDGE, G, MU = 2e4, 0.1, 9.81, 0.4
METHOD = ImplicitDashpots(1e-4)


def slope(degrees, above=1e-6, velocity=0.0):
    """The body above the ground [m], with gravity at an angle and a velocity along it [m/s]."""
    touching = [above, 0.1 * GROUND / math.sqrt(3.0), -0.1 * GROUND]
    body = single(EDGE).points * [-1.0, 1.0, 1.0] + touching
    points = np.vstack([single(GROUND).points, body])
    mesh = checked_mesh(points, [[0, 1, 2, 3], [4, 5, 7, 6]], {"ground": [[1, 2, 3]]})
    material = replace(CONCRETE, contact_stiffness=1e4, contact_damping=5.0, friction=MU)
    angle = math.radians(degrees)
    gravity = effects.Gravity((-G * math.cos(angle), G * math.sin(angle), 0.0))
    drag = effects.SphereContact(), effects.Friction()
    listed, moves = [gravity, effects.Fixed("ground"), *drag], [[0.0] * 3, [0.0, velocity, 0.0]]
    return Scene(mesh, material, "auto", loads=listed, velocity=moves)


@pytest.mark.parametrize(
    ("case", "creeps"),
    [
        ({"degrees": 20.0}, True),
        ({"degrees": 15.0, "above": 0.005}, True),
        ({"degrees": 22.5}, False),
        ({"degrees": 0.0, "above": 0.02}, False),
        ({"degrees": 0.0, "velocity": 1.0}, False),
    ],
)
def test_a_body_creeps_below_the_angle_of_friction_and_slides_or_rests_elsewhere(case, creeps):
    found = simulate(slope(**case), method=METHOD, until=0.3, samples=200, progress=None)
    assert [one.effect for one in found.report.missing_effects] == ["StickingFriction"] * creeps
    assert found.certificate.holds == (not creeps)
    if creeps:
        share = 100.0 * math.tan(math.radians(case["degrees"])) / MU
        assert f"this takes {share:.2g} % of the friction" in found.report.needs[0]


def test_an_answer_of_a_body_that_creeps_is_not_reached():
    asked = {"until": 0.2, "goal": goals.body_displacement(1), "tolerance": 0.1}
    answer = solve(slope(15.0), **asked)
    assert not answer.reached and "list StickingFriction" in answer.shortfall
