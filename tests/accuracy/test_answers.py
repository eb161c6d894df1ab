"""Answers of real scenes hold beside far finer runs, whose brief runs tell what whole ones tell.

Values of goals are those of formulas of the tests' own.
"""

import numpy as np
import pytest

from taichi_dem import (
    CONCRETE,
    ImplicitDashpots,
    Scene,
    Simulation,
    SimulationDiverged,
    effects,
    goals,
    simulate,
    solve,
)
from taichi_dem.accuracy.levels import Levels
from taichi_dem.accuracy.runs import Runs
from taichi_dem.goals import Goal
from taichi_dem.mesh.shapes import placed_together, single
from tests.scenes import BROKEN_UNTIL, UNTIL, broken_bar, struck_bar
from tests.structures import filled

ENERGY = goals.kinetic_energy()


def finer(scene, until, goal, answer, levels=3):
    """Value of a goal with the step of an answer over 2^levels."""
    return Runs(Levels(scene, until, goal)).value(answer.plan.begin + 1 + levels)


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
    monkeypatch.setattr(Runs, "parting", lambda self, level, tolerance: 1e-5)
    answer = solve(broken_bar(), until=BROKEN_UNTIL, goal=ENERGY, progress=None)
    assert answer.plan.parting_s == 1e-5 and "1e-05 s" in str(answer)
    assert known() == before


@pytest.mark.parametrize("unit", ["1", "mm", "m/s", "J", "N"])
def test_a_quantity_that_is_zero_has_the_bar_of_its_noise(unit):
    """A sum of speeds less the same in another order, as a share of what the unit has here.

    It is not reached in a unit of which nothing is known.
    """

    def nothing(result):
        speed = result.frames[-1].velocity[:, 0]
        sizes = {"mm": 100.0, "m/s": result.peak_speed.max(), "J": ENERGY.value(result)}
        return sizes.get(unit, 1.0) * float(speed.sum() - speed[::-1].cumsum()[-1]) / speed.sum()

    answer = solve(struck_bar(), until=UNTIL, goal=Goal("nothing", unit, nothing), progress=None)
    assert answer.reached == (unit != "N")
    assert not answer.reached or 0.0 < abs(answer.value) <= answer.error < 1e-12


def test_bodies_that_fly_freely_have_an_answer_to_rounding():
    """No spring limits the step; v t is exact at any."""
    parts = {name: (single(), (shift, 0.0, 0.0)) for name, shift in (("one", 0.0), ("two", 1.0))}
    laws, velocity = filled("bonds", group="one_base"), (0.0, 0.0, -3.0)
    scene = Scene(placed_together(parts), CONCRETE, laws, velocity=[velocity] * 2)
    answer = solve(scene, until=0.2, goal=goals.body_displacement(1), progress=None)
    assert answer.reached and answer.value == pytest.approx(1e3 * 3.0 * 0.2, rel=1e-9)


GOALS = ENERGY, goals.displacement("left"), goals.broken_faces()


def both(scene, until, goal=GOALS[0]):
    """A brief run and a whole one of a scene."""
    runs = Runs(Levels(scene, until, goal))
    return [runs._simulated(0, 0, False, 1, brief) for brief in (True, False)]


@pytest.mark.parametrize("made, until", [(struck_bar, UNTIL), (broken_bar, BROKEN_UNTIL)])
def test_a_brief_run_has_the_values_of_a_whole_one(made, until):
    """Bit for bit, with the counts that say whether one rounding may decide."""
    brief, whole = both(made(), until)
    assert [goal.value(brief) for goal in GOALS] == [goal.value(whole) for goal in GOALS]
    for name in ("broken_faces", "pair_evaluations", "energy_balance"):
        assert getattr(brief.report, name) == getattr(whole.report, name)
    # A brief run looks less often where bonds slip.
    assert bool(brief.report.bond_slip) == bool(whole.report.bond_slip)
    peak = goals.peak_speed(3)
    brief, whole = both(made(), until, peak)
    assert peak.value(brief) == peak.value(whole) > 0.0


def refusal(run):
    """What is said of a run that cannot begin; an exception that is kept holds its engine."""
    with pytest.raises(SimulationDiverged, match="starts so: move the bodies") as refused:
        run()
    return str(refused.value).split("its step")[0]


def test_a_question_about_bodies_within_each_other_is_refused():
    """In the words of a whole run."""
    parts = {"one": (single(0.05), (0.0, 0.0, 0.0)), "other": (single(0.05), (1e-3, 0.0, 0.0))}
    contact = effects.SphereContact(outer_faces=True)
    scene = Scene(placed_together(parts), CONCRETE, filled("held", contact, group="one_base"))
    levels = Levels(scene, 1e-6, GOALS[0])
    whole = refusal(lambda: Simulation(scene, ImplicitDashpots(1e-8)).start())
    assert "share" in whole
    assert refusal(lambda: solve(scene, until=1e-6, goal=GOALS[0], tolerance=0.1)) == whole
    assert refusal(lambda: Runs(levels)._simulated(0, 0, False, 1, True)) == whole


def test_a_brief_report_does_not_say_what_nobody_looked_for():
    """Bodies that share 14 % where no contact is listed."""
    parts = {"one": (single(0.05), (0.0, 0.0, 0.0)), "other": (single(0.05), (0.02, 0.0, 0.0))}
    scene = Scene(placed_together(parts), CONCRETE, filled("bonds", group="one_base"))
    runs = Runs(Levels(scene, 1e-7, GOALS[0]), None)
    brief, whole = (runs._simulated(0, 0, False, 1, one).report for one in (True, False))
    assert brief.interpenetration is None and whole.interpenetration.share > 0.1


BODY = 5


@pytest.fixture(scope="module")
def blast():
    """A bar that breaks into parts, with a frame at every sample."""
    looks = {"until": BROKEN_UNTIL, "samples": 100, "frames": 100, "progress": None}
    return simulate(broken_bar(), method=ImplicitDashpots(4e-7), **looks)


def moved_mm(result, bodies):
    """Distances from the centroids of the mesh at the end [mm]."""
    mesh = result.scene.mesh
    first = mesh.points[mesh.tetrahedra].mean(axis=1)
    return 1e3 * np.linalg.norm((result.frames[-1].position - first)[bodies], axis=1)


def bodies_at(mesh, group):
    """Bodies with all corners of a face of a group."""
    faces = [set(face) for face in mesh.group_faces(group).tolist()]
    corners = [set(body) for body in mesh.tetrahedra.tolist()]
    return [n for n, body in enumerate(corners) if any(face <= body for face in faces)]


def test_values_of_a_run(blast):
    """Each by a formula of its own; sums of other orders round in the last digits."""
    mesh, last, history = blast.scene.mesh, blast.frames[-1], blast.series
    speeds = np.array([frame.speed for frame in blast.frames])
    work = history["gas_work_J"][-1]
    wanted = {
        goals.displacement("left"): moved_mm(blast, bodies_at(mesh, "left")).mean(),
        goals.body_displacement(BODY): moved_mm(blast, BODY + np.arange(1)).mean(),
        goals.broken_faces(): np.isfinite(blast.broken_time).sum(),
        goals.kinetic_energy(): blast.report.energy_balance["kinetic"],
        goals.peak_speed(BODY): speeds[:, BODY].max(),
        goals.energy_share("bond_dashpot"): history["bond_dashpot_J"][-1] / work,
    }
    for goal, value in wanted.items():
        assert goal.value(blast) == pytest.approx(value, rel=1e-12), goal
    assert blast.report.broken_faces > 1
    along = 0.5 * (blast.model.body_mass * (last.velocity**2).sum(axis=1)).sum()
    assert along < goals.kinetic_energy().value(blast) < 1.5 * along
