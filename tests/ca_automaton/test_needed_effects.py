"""Effects that never acted are named, and what no look saw is not."""

from ca_damper import Batch, SceneTable, needed_effects
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
