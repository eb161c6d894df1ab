"""An answer of a real scene holds beside far finer runs, and has the same bits every time."""

import pytest

from taichi_dem import CONCRETE, ImplicitDashpots, Scene, effects, goals, simulate, solve
from taichi_dem.accuracy.runs import Job, Runs
from tests.accuracy.small_bar import BROKEN_UNTIL, UNTIL, broken_bar, struck_bar
from tests.scenes import apart

ENERGY = goals.kinetic_energy()


def finer(scene, until, goal, answer, levels=3):
    """Value of a goal with the step of an answer over 2^levels."""
    job = Job(scene, until, goal, answer.tolerance, answer.confidence)
    return Runs(job, None).value(answer.plan.begin + 1 + levels)


@pytest.fixture(scope="module")
def broken():
    """Energy of the bar that breaks, to a hundredth."""
    return solve(broken_bar(), until=BROKEN_UNTIL, goal=ENERGY, progress=None)


def test_twins_of_a_scene_without_events_differ_by_rounding_alone():
    """The mean over them is no dearer than ten runs, as their step is that of their run."""
    goal = goals.displacement("right").mean()
    answer = solve(struck_bar(), until=UNTIL, goal=goal, tolerance=0.003, progress=None)
    assert answer.reached and answer.parts.chance < 1e-6 * answer.value
    assert answer.plan.runs <= 30


@pytest.mark.parametrize("goal", [goals.displacement("right"), ENERGY], ids=lambda goal: goal.name)
def test_a_bar_of_an_elastic_scene_holds(goal):
    answer = solve(struck_bar(), until=UNTIL, goal=goal, tolerance=0.003, progress=None)
    assert answer.reached and 0.0 < answer.error <= 0.003 * answer.value
    assert abs(answer.value - finer(struck_bar(), UNTIL, goal, answer)) <= answer.error


def test_a_bar_of_a_scene_that_breaks_holds(broken):
    assert broken.result.report.broken_faces > 0
    assert abs(broken.value - finer(broken_bar(), BROKEN_UNTIL, ENERGY, broken)) <= broken.error


def test_the_same_question_has_the_same_bits_also_after_another(broken):
    solve(struck_bar(), until=UNTIL, goal=goals.displacement("right"), progress=None)
    again = solve(broken_bar(), until=BROKEN_UNTIL, goal=ENERGY, progress=None)
    assert (again.value, again.error, again.plan.runs) == (
        broken.value,
        broken.error,
        broken.plan.runs,
    )


def test_a_run_has_the_same_report_whatever_was_asked_before(monkeypatch):
    """Also after an answer whose twins separate: its plan says so, no report of another run."""

    def known():
        method, until = ImplicitDashpots(1e-6), BROKEN_UNTIL
        return simulate(broken_bar(), method=method, until=until, progress=None).report.known_error

    before = known()
    monkeypatch.setattr(Runs, "parting", lambda self, level: 1e-5)
    answer = solve(broken_bar(), until=BROKEN_UNTIL, goal=ENERGY, progress=None)
    assert answer.plan.parting_s == 1e-5 and "1e-05 s" in str(answer)
    assert known() == before


def test_bodies_that_fall_freely_have_an_answer_to_rounding():
    """No spring limits the step; half of g t^2 is exact at any."""
    scene = Scene(apart(3), CONCRETE, [effects.Gravity((0.0, 0.0, -9.81))])
    answer = solve(scene, until=0.2, goal=goals.body_displacement(1), progress=None)
    assert answer.reached and answer.value == pytest.approx(1e3 * 0.5 * 9.81 * 0.2**2, rel=1e-9)
