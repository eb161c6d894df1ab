"""Effects that never acted are named, and what no look saw is not."""

import pytest

from ca_damper import Batch, SceneTable, needed_effects
from ca_damper.scenes.scene_fields import SceneFields
from ca_damper.spheres.effect_activity import EffectActivity
from taichi_dem.kit.allocation import FieldTree
from taichi_dem.kit.effect_usage import Advice
from tests.paper import expected, paper


def ran(filling, particles, amplitude):
    """The report of three cycles of a container that stands still, or shakes."""
    batch = Batch(filling, SceneTable(particles, 1, 1e-4, 6.0, amplitude))
    with expected(batch):
        batch.start()
    batch.run(3, 0)
    return batch.report()


def test_one_particle_meets_the_floor_and_nobody_else():
    report = ran(paper(), 1, 0.0)
    assert needed_effects(report).inactive == ("pairs", "ejection", "static contact")
    uses = {use.effect: use.events for use in report.effect_activity}
    assert uses["landing"] > 0
    assert needed_effects(ran(paper(), 40, 2e-3)).droppable == ()


@pytest.mark.parametrize("turning", [0.0, 1e-9])
def test_what_no_look_saw_of_spheres_is_kept(turning):
    """Looks are 64 steps apart, and a blow takes 5: only a spin, which lasts, would be seen."""
    with FieldTree():
        table = SceneFields(1, {})
        acted = EffectActivity(table)
    table.load(SceneTable(1, 1, 1e-4))
    acted.motion[0] = [1.0, turning]
    advice = Advice(acted.uses(("normal contact", "friction", "rotation")), (), 1e-3)
    assert advice.droppable == (() if turning else ("rotation",))
    assert "touches between two looks leave no trace" in str(advice)
