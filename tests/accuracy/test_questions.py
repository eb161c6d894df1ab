"""Questions that cannot be asked, budgets that run out, and goals of one's own."""

import math

import numpy as np
import pytest

from taichi_dem import InputError, Scene, goals, solve
from taichi_dem.goals import Goal
from taichi_dem.kit.accuracy.answer import Answer
from tests.accuracy.small_bar import UNTIL, struck_bar
from tests.bad_input.refusals import ends_within

MOVED = goals.displacement("right")
NAN, INF = float("nan"), float("inf")


def asked(scene=None, **changed):
    """Answer to a question of the bar, with other arguments."""
    question = {"until": UNTIL, "goal": MOVED, "tolerance": 0.05, "progress": None, **changed}
    return solve(struck_bar() if scene is None else scene, **question)


BAD = [
    *(("tolerance", value) for value in (0, 0.0, NAN, INF, -0.01, 1.5, None, "1%", [0.01], True)),
    *(("confidence", value) for value in (0, 1, 1.0, NAN, INF, -0.5, 95, None, "95%")),
    *(("until", value) for value in (0, NAN, INF, -1e-5, None, "1e-5", [1e-5])),
    *(("budget_s", value) for value in (0, NAN, INF, -1.0, "1 s", True, [1.0])),
    *(("goal", value) for value in (None, "hole", goals.displacement, [MOVED], 3)),
    *(("progress", value) for value in ("bar", 3)),
]


@pytest.mark.parametrize(("name", "value"), BAD)
def test_what_cannot_be_asked_is_refused_in_a_sentence_that_names_it(name, value):
    with ends_within(20.0), pytest.raises(InputError) as refused:
        asked(**{name: value})
    words = str(refused.value)
    assert name in words and "must" in words and "\n" not in words, words


@pytest.mark.parametrize("scene", [None, "block", struck_bar().mesh, Scene])
def test_a_scene_is_asked_for(scene):
    with pytest.raises(InputError, match="scene must be a Scene"):
        solve(scene, until=UNTIL, goal=MOVED, progress=None)


LACKING = (goals.hole_displacement(), goals.displacement("roof"), goals.peak_speed(72).mean())


@pytest.mark.parametrize("goal", LACKING, ids=str)
def test_a_goal_that_the_scene_lacks_is_refused_before_any_run(goal):
    told = []
    with pytest.raises(InputError):
        asked(goal=goal, progress=told.append)
    assert not told


def test_a_goal_of_five_lines():
    def spread(result):
        """Standard deviation of the bodies' speeds at the end."""
        return result.frames[-1].speed.std()

    answer = asked(goal=Goal("spread of the speeds", "m/s", spread))
    assert isinstance(answer, Answer) and answer.reached and answer.unit == "m/s"
    assert 0.0 < answer.error <= 0.05 * answer.value
    # No run but the finer of two belongs to the answer.
    assert answer.value == spread(answer.result) and answer.plan.runs >= 2


@pytest.mark.parametrize("found", [NAN, INF, None, np.ones(2)])
def test_a_goal_that_gives_no_number_is_named(found):
    goal = Goal("odd one", "m", lambda result: found)
    with pytest.raises(InputError, match="function of the goal 'odd one' must return a finite"):
        asked(goal=goal)


def test_an_error_of_a_goal_s_own_function_reaches_the_user():
    goal = Goal("wrong one", "m", lambda result: result.no_such_figure)
    with pytest.raises(AttributeError, match="no_such_figure"):
        asked(goal=goal)


def test_a_budget_too_small_is_said_and_the_bar_is_honest():
    """It refuses, or answers with the bar that it has and says what is missing."""
    best = asked(tolerance=0.003)
    try:
        answer = asked(tolerance=1e-6, budget_s=1e-3)
    except InputError as error:
        assert "budget_s must" in str(error)
        return
    assert not answer.reached and answer.error > 1e-6 * answer.value
    assert "budget" in answer.shortfall and "\n" not in answer.shortfall
    assert abs(answer.value - best.value) <= answer.error + best.error


def test_a_budget_that_is_enough_changes_nothing():
    free, bounded = asked(), asked(budget_s=1e6)
    assert free.reached and (free.value, free.error) == (bounded.value, bounded.error)


@pytest.mark.parametrize("tolerance", [1.0, 0.1])
def test_a_wide_tolerance_is_reached(tolerance):
    answer = asked(tolerance=tolerance)
    assert answer.reached and answer.share <= tolerance and answer.tolerance == tolerance


def test_an_answer_has_a_value_a_bar_a_price_and_words_for_them():
    answer = asked(tolerance=0.01)
    assert answer.reached and "+-" in str(answer) and str(answer).count("\n") == 0
    assert {round(one.tolerance, 6) for one in answer.cost_curve} >= {0.1, 0.03, 0.01, 0.003}
    assert all(one.seconds > 0.0 for one in answer.cost_curve)
    assert answer.plan.seconds == answer.plan.pilot_s + answer.plan.final_s > 0.0
    assert math.isclose(answer.share, answer.error / answer.value)
    assert (answer.tolerance, answer.confidence) == (0.01, 0.95)


def test_progress_is_told_in_rising_shares():
    told = []
    asked(progress=told.append)
    shares = [one.share for one in told if type(one).__name__ != "Compiling"]
    assert shares and shares == sorted(shares) and 0.0 < shares[0] and shares[-1] <= 1.0
