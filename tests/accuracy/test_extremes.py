"""An extreme at the start of a run, or one that still grows at its end, is no answer."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from taichi_dem import CONCRETE, Scene, effects, goals, solve
from taichi_dem.accuracy.extremes import BEFORE, change, extreme_doubts
from taichi_dem.goals import Goal
from tests.made_result import made_result
from tests.scenes import apart

MADE = made_result()
ROWS = 2001


def ripple(share, cycles):
    """Rise to 1 with waves on it, after whose last crest it has fallen at the end."""
    return lambda t: t + share * np.sin(2.0 * np.pi * cycles * t)


class History:
    """Stands for Runs: a history of time over the end of the run, whose extreme is asked for."""

    def __init__(self, history, read):
        goal = Goal("made up", "N", lambda result: read(result.series["force_N"]), "extreme")
        self.history, self.levels = history, SimpleNamespace(goal=goal, until=1.0)
        self.results, self.longer = {0: self.until(1.0)}, 0

    def until(self, end):
        t = np.linspace(0.0, end, ROWS)
        return replace(MADE, series={"time_s": t, "force_N": self.history(t)})

    def value(self, level):
        return self.levels.goal.value(self.results[level])

    def late_change(self, level):
        return change(self.levels.goal, self.results[level], BEFORE, MADE.peak_speed)

    def longer_change(self, level):
        self.longer += 1
        return change(self.levels.goal, self.until(1.0 / BEFORE), 1.0, MADE.peak_speed)


def doubts(history, read=np.max, bar=1e-3, budget=9.0):
    """Reasons to doubt the extreme of a history, and the longer runs that were made."""
    runs = History(history, read)
    found = list(extreme_doubts(runs, 0, 0, bar, lambda more, level: more <= budget))
    return found, runs.longer


@pytest.mark.parametrize(
    ("history", "read"),
    [
        (lambda t: t, np.max),
        (lambda t: -t, np.min),
        (lambda t: np.sqrt(t), np.max),
        # Its last crest lies before the end, or is the largest of ever larger ones.
        (ripple(0.05, 9.8), np.max),
        (lambda t: t * np.sin(2.0 * np.pi * 9.4 * t), np.max),
    ],
)
def test_an_extreme_that_still_grows_is_in_doubt(history, read):
    found, longer = doubts(history, read)
    assert len(found) == longer == 1 and "last tenth" in found[0]


@pytest.mark.parametrize(
    ("history", "longer"),
    [
        (lambda t: t * np.exp(-10.0 * t), 0),
        # A rise that has come to its limit to within the bar.
        (lambda t: 1.0 - np.exp(-20.0 * t), 0),
        # A peak shortly before the end, which only a longer run can tell from a rise.
        (lambda t: np.exp(-(((t - 0.96) / 0.02) ** 2)), 1),
        (lambda t: np.minimum(1.0, t / 0.97), 1),
    ],
)
def test_an_extreme_that_is_passed_is_none(history, longer):
    assert doubts(history) == ([], longer)


@pytest.mark.parametrize("history", [np.ones_like, lambda t: np.exp(-t), lambda t: 1.0 + 1e-4 * t])
def test_an_extreme_that_is_the_value_at_the_start_is_in_doubt(history):
    (found,), longer = doubts(history)
    assert "start" in found and not longer


def test_what_cannot_be_followed_is_in_doubt_and_what_fails_when_it_stands_still_is_not():
    (found,), longer = doubts(lambda t: t, budget=1.0)
    assert "budget" in found and not longer
    assert doubts(lambda t: t, lambda force: 1.0 / np.ptp(np.diff(force)[-9:])) == ([], 0)


def falling(velocity=None):
    """Bodies that fall freely, from rest or thrown upwards."""
    return Scene(apart(3), CONCRETE, [effects.Gravity((0.0, 0.0, -9.81))], velocity=velocity)


@pytest.mark.parametrize(
    ("up", "word", "speed"), [(0.0, "last tenth", 9.81), (20.0, "start", 20.0)]
)
def test_a_largest_speed_of_a_falling_body_is_no_answer(up, word, speed):
    """g t at the end of a second, and the start of a throw; between, 9.81 (1 / 0.9 - 1)."""
    scene = falling((0.0, 0.0, up) if up else None)
    answer = solve(scene, until=1.0, goal=goals.peak_speed(1), progress=None)
    assert not answer.reached and word in answer.shortfall
    assert answer.value == pytest.approx(speed, rel=1e-9)
