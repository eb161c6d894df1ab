"""An answer of a real scene holds beside far finer runs, and has the same bits every time."""

from dataclasses import replace

import numpy as np
import pytest

from taichi_dem import CONCRETE, InputError, Scene, effects, goals, solve
from taichi_dem.accuracy.runs import Job, Runs
from taichi_dem.goals import Goal
from taichi_dem.mesh.shapes import placed_together, single
from tests.accuracy.small_bar import BROKEN_UNTIL, UNTIL, broken_bar, laws, struck_bar
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


def test_bodies_that_fall_freely_have_an_answer_to_rounding():
    """No spring limits the step; half of g t^2 is exact at any."""
    scene = Scene(apart(3), CONCRETE, [effects.Gravity((0.0, 0.0, -9.81))])
    answer = solve(scene, until=0.2, goal=goals.body_displacement(1), progress=None)
    assert answer.reached and answer.value == pytest.approx(1e3 * 0.5 * 9.81 * 0.2**2, rel=1e-9)


def test_bodies_without_bonds_take_the_step_of_their_contacts():
    """A body that flies at a held one and comes back: the same energy as before."""
    parts = {"held": (single(0.05), (0.0, 0.0, 0.0)), "flying": (single(0.05), (0.06, 0.0, 0.0))}
    material, until = replace(CONCRETE, contact_damping=0.0), 2e-3
    listed = laws(peak=1.0, blown="held_base", held="held_base")
    velocity = {"flying": (-20.0, 0.0, 0.0)}
    scene = Scene(placed_together(parts), material, listed, velocity=velocity)
    answer = solve(scene, until=until, goal=ENERGY, tolerance=0.1, progress=None)
    assert answer.result.report.pair_evaluations > 0
    assert abs(answer.value - finer(scene, until, ENERGY, answer)) <= answer.error


def test_a_goal_of_one_s_own_may_check_the_scene_and_its_errors_reach_the_user():
    def check(scene):
        if scene.mesh.body_count > 72:
            raise InputError("this goal needs few bodies")

    spread = Goal("spread", "m/s", lambda result: result.frames[-1].speed.std(), check=check)
    question = {"until": UNTIL, "tolerance": 0.05, "progress": None}
    answer = solve(struck_bar(), goal=spread, **question)
    assert answer.reached and answer.value == spread.function(answer.result)
    with pytest.raises(InputError, match="this goal needs few bodies"):
        spread.mean().check_scene(broken_bar((4, 2, 2)))
    with pytest.raises(AttributeError, match="no_such_figure"):
        solve(struck_bar(), goal=Goal("x", "m", lambda result: result.no_such_figure), **question)
    with pytest.raises(InputError, match="function of the goal 'x' must return a finite"):
        solve(struck_bar(), goal=Goal("x", "m", lambda result: np.nan), **question)
