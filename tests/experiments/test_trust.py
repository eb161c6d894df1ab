"""What the cases of trust.py read from a run, on answers that are known."""

import sys

import numpy as np
import pytest

import _trust
from _hard_cases._statics import least_friction
from _hard_cases.blast_piles import CARD, SPAN, TALL, house
from _trust.meshes import DISTANCE, _scattered
from _trust.number import Number

# The package has functions of these names.
BLAST, BRANCHING = (sys.modules[f"{_trust.__name__}.{name}"] for name in ("blast", "branching"))
EDGE = 2e-3


def branches(angle, speed):
    """Faces of a crack that runs along x and divides at 70 mm into two at an angle to it."""
    x = np.arange(0.05, 0.1, 0.5 * EDGE)
    away = np.maximum(0.0, x - 0.07) * np.tan(angle)
    place = np.concatenate([np.column_stack([x, away]), np.column_stack([x, -away])])
    return place, np.tile((x - x[0]) / speed, 2)


@pytest.mark.parametrize("angle", [0.2, 0.5, 1.0])
def test_a_crack_has_branched_once_its_branches_are_apart(angle):
    """2 a tan(angle) > 3 edges, within the slice of two edges in which that becomes so."""
    place, when = branches(angle, 1000.0)
    order = np.argsort(when, kind="stable")
    found = BRANCHING.forked(place[order], when[order], EDGE)
    true = (0.02 + 1.5 * EDGE / np.tan(angle)) / 1000.0
    assert abs(found - true) <= 2.5 * EDGE / 1000.0


def test_a_crack_that_goes_on_straight_has_not_branched():
    place, when = branches(0.0, 1000.0)
    assert np.isnan(BRANCHING.forked(place, when, EDGE))


@pytest.mark.parametrize("speed", [500.0, 1275.0])
def test_the_speed_of_a_tip_is_right_to_a_face_in_its_window(speed):
    place, when = branches(0.5, speed)
    order, window = np.argsort(when, kind="stable"), 10.0 * EDGE / speed
    found = BRANCHING.speed(place[order, 0], when[order], window)
    assert abs(found / speed - 1.0) <= 0.5 * EDGE / (window * speed) + 1e-9


@pytest.mark.parametrize("exponent", [0.8, 1.5, 2.5])
def test_laws_of_sizes_are_found_in_curves_that_follow_them(exponent):
    x = np.geomspace(0.01, 2.0, 48)
    rosin = np.append(-np.expm1(-((x[:-1] / 0.7) ** exponent)), 1.0)
    swebrec = 1.0 / (1.0 + (np.log(x[-1] / x) / np.log(2.0 / 0.4)) ** exponent)
    assert BLAST.laws(x, rosin, 0.1)[0][0] == pytest.approx(exponent, rel=1e-9)
    assert BLAST.laws(x, swebrec, 0.1)[1][0] == pytest.approx(exponent, rel=1e-9)


def test_the_least_friction_of_a_house_of_cards_is_that_of_moments():
    """Weight of a card about the inner edge of its foot against the push at its top."""
    x, y = CARD.T
    cross = x * np.roll(y, -1) - np.roll(x, -1) * y
    middle = ((y + np.roll(y, -1)) * cross).sum() / (3.0 * cross.sum())
    assert least_friction(house()) == pytest.approx((SPAN - middle) / TALL, abs=2e-4)


def test_scattered_points_keep_their_distance_and_the_outline():
    points = _scattered(0.1, 0.04, EDGE, np.random.default_rng(0))
    away = np.linalg.norm(points[:, None] - points[None], axis=2) + np.eye(len(points))
    inner = ((points > 0.0) & (points < [0.1, 0.04])).all(axis=1)
    assert away[np.ix_(inner, inner)].min() >= DISTANCE * EDGE * (1.0 - 1e-12)
    assert points.min() == 0.0 and points.max(axis=0).tolist() == [0.1, 0.04]
    # About one on a square of an edge.
    assert inner.sum() * EDGE**2 / (0.098 * 0.038) == pytest.approx(1.0, rel=0.1)


def test_a_number_of_no_spread_says_none():
    number = Number("a", "words", "m", "source", 2.0, np.array([2.01]))
    assert number.holds and number.spread == 0.0 and "±" not in number.cells()[3]
