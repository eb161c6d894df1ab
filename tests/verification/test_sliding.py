"""Friction of faces made of spheres: they interlock, which docs/papers.md states with figures."""

import pytest

from taichi_dem import CONCRETE
from tests.sliding import GRAVITY, deceleration, tetrahedron

COULOMB = CONCRETE.friction * GRAVITY
#: Of the way against the edges of the plate's boxes.
ANGLE = 0.4


@pytest.fixture(scope="module")
def measured():
    """Deceleration of a tetrahedron at 1 m/s over that of Coulomb, by friction, divisions."""
    return {
        (friction, divisions): deceleration(tetrahedron(), 1.0, ANGLE, friction, divisions)[0]
        / COULOMB
        for friction in (0.0, CONCRETE.friction)
        for divisions in (5, 20)
    }


@pytest.mark.slow
def test_a_frictionless_face_brakes_as_its_spheres_meet_others(measured):
    """Without friction nothing should brake: spheres that strike others do, as their dashpots."""
    assert measured[0.0, 5] > 0.2
    assert measured[0.0, 20] < 0.5 * measured[0.0, 5]


@pytest.mark.slow
def test_friction_of_a_face_exceeds_coulomb_and_comes_nearer_with_more_spheres(measured):
    six, many = measured[CONCRETE.friction, 5], measured[CONCRETE.friction, 20]
    assert six > 1.2
    assert abs(many - 1.0) < abs(six - 1.0)
