"""Brief runs of a question tell what whole ones tell."""

import pytest

from taichi_dem import CONCRETE, Scene, Simulation, SimulationDiverged, effects, goals, solve
from taichi_dem.accuracy.runs import Job, Runs
from taichi_dem.mesh.shapes import placed_together, single
from taichi_dem.methods import Uniform
from tests.accuracy.small_bar import BROKEN_UNTIL, UNTIL, broken_bar, struck_bar

GOALS = goals.kinetic_energy(), goals.displacement("left"), goals.broken_faces()


def both(scene, until, goal=GOALS[0]):
    """A brief run and a whole one of a scene."""
    runs = Runs(Job(scene, until, goal, 0.01, 0.95), None)
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


def test_a_question_about_bodies_within_each_other_is_refused():
    """In the words of a whole run."""
    parts = {"one": (single(0.05), (0.0, 0.0, 0.0)), "other": (single(0.05), (1e-3, 0.0, 0.0))}
    contact = effects.SphereContact(outer_faces=True)
    scene = Scene(placed_together(parts), CONCRETE, [contact])
    with pytest.raises(SimulationDiverged, match=r"shares .* starts so: move the bodies") as whole:
        Simulation(scene, Uniform(1e-8)).start()
    with pytest.raises(SimulationDiverged) as asked:
        solve(scene, until=1e-6, goal=GOALS[0], tolerance=0.1)
    with pytest.raises(SimulationDiverged) as brief:
        Runs(Job(scene, 1e-6, GOALS[0], 0.1, 0.95), None)._simulated(0, 0, False, 1, True)
    words = {str(one.value).split("its step")[0] for one in (whole, asked, brief)}
    assert len(words) == 1


def test_a_brief_report_does_not_say_what_nobody_looked_for():
    """Bodies that share 14 % where no contact is listed."""
    parts = {"one": (single(0.05), (0.0, 0.0, 0.0)), "other": (single(0.05), (0.02, 0.0, 0.0))}
    runs = Runs(Job(Scene(placed_together(parts), CONCRETE, []), 1e-7, GOALS[0], 0.1, 0.95), None)
    brief, whole = (runs._simulated(0, 0, False, 1, one).report for one in (True, False))
    assert brief.interpenetration is None and whole.interpenetration.share > 0.1
