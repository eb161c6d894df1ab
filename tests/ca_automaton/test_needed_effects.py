"""What a damper says of its effects, by automaton and by spheres."""

import json

import pytest

from ca_damper import Batch, InputError, SceneTable, Spheres, needed_effects
from ca_damper.scenes.scene_fields import SceneFields
from ca_damper.spheres.effect_activity import EffectActivity
from taichi_dem.kit.allocation import FieldTree
from taichi_dem.kit.effect_usage import Advice
from tests.paper import expected, paper

#: Of a cell, and how high above the floor the one particle begins [cells].
ROW = 10


def ran(filling, particles, dt, cycles=3, amplitude=0.0):
    """The report of a container that hardly moves, or shakes."""
    batch = Batch(filling, SceneTable(particles, 1, dt, 6.0, amplitude), mount="base")
    with expected(batch):
        batch.start()
    batch.run(cycles, 0)
    return batch.report()


def test_one_particle_meets_the_floor_and_nobody_else(tmp_path):
    report = ran(paper(start=((3, ROW),)), 1, 1e-4)
    # Falling 60 mm takes 0.11 s, all bounces with e = 3/4 together (1 + e) / (1 - e) times that,
    # 0.77 s: after 0.5 s it has met the floor at 0.11, 0.27, 0.40 and 0.49 s and still flies.
    assert needed_effects(report).inactive == ("pairs", "ejection", "static contact")
    uses = {use.effect: use.events for use in report.effect_activity}
    assert uses["landing"] == 4
    report.write(tmp_path / "report.json")
    written = json.loads((tmp_path / "report.json").read_text())
    assert written["acted"][0]["effect"] == "pairs"
    assert "never acted" in str(report)


def test_shaken_box_calls_for_everything():
    report = ran(paper(), 40, 1e-4, amplitude=0.02)
    assert needed_effects(report).droppable == ()


def test_sphere_that_falls_straight_rubs_on_nobody_and_does_not_turn():
    report = ran(Spheres(rotation=True, start=((0.03, 0.05),)), 1, 2e-5)
    advice = needed_effects(report)
    assert "rotation" in advice.inactive
    assert "normal contact" not in advice.droppable


def test_shares_of_dashpots_and_friction_are_all_that_contacts_take():
    report = ran(Spheres(), 40, 2e-5, amplitude=0.02)
    normal, friction = report.effect_activity
    assert normal.share + friction.share == pytest.approx(1.0, rel=1e-15)
    assert min(normal.share, friction.share) > 0.0
    assert needed_effects(report, friction.share).droppable == ()
    assert needed_effects(report, min(1.0, 1.001 * friction.share)).droppable == ("friction",)


@pytest.mark.parametrize("turning", [0.0, 1e-9])
def test_what_no_look_saw_of_spheres_is_kept(turning):
    """Looks are 64 steps apart, and a blow takes 5: only a spin, which lasts, would be seen."""
    with FieldTree():
        table = SceneFields(1, {})
        acted = EffectActivity(table)
    table.load(SceneTable(1, 1, 1e-4))
    acted.motion[0] = [1.0, turning]
    uses = acted.uses(("normal contact", "friction", "rotation"))
    advice = Advice(uses, (), 1e-3)
    assert advice.droppable == (() if turning else ("rotation",))
    assert "touches between two looks leave no trace" in str(advice)


def test_what_is_no_result_is_refused():
    with pytest.raises(InputError, match="result must be a Response or the Report of a Batch"):
        needed_effects(1.0)
