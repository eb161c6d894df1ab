"""A run with an effect silenced is exactly the run of a scene without it."""

import pytest

from taichi_dem import CONCRETE, Scene, Uniform, effects, needed_effects, simulate
from taichi_dem.engine import ENGINES
from taichi_dem.mesh.shapes import bar

LAWS = effects.Softening, effects.ShearSlip, effects.BondDamping
METHOD = Uniform(1e-7)


def pulled(*listed, speed=2.0):
    """A bar whose end is pulled until it breaks where it can."""
    drive = effects.PrescribedMotion("right", (speed, 0.5 * speed, 0.0), 900.0)
    return Scene(bar(0.2, 0.1, (2, 1, 1)), CONCRETE, [*listed, effects.Fixed("left"), drive])


def result_of(scene):
    return simulate(scene, method=METHOD, until=4e-4, samples=4, frames=4, progress=None)


@pytest.fixture(scope="module")
def scene(taichi_session):
    return pulled(*(law() for law in LAWS))


def test_a_silent_effect_leaves_every_bit_and_report_of_a_scene_without_it(scene):
    assert result_of(scene).report.broken_faces > 0
    before = len(ENGINES._engines)
    silent = result_of(pulled(*(law().silent() for law in LAWS)))
    assert len(ENGINES._engines) == before
    without = result_of(pulled())
    for key, values in silent.series.items():
        assert values.tobytes() == without.series[key].tobytes(), key
    for frame, other in zip(silent.frames, without.frames):
        assert frame.position.tobytes() == other.position.tobytes()
    assert silent.report.effects == without.report.effects
    assert silent.report.energy_balance == without.report.energy_balance


def test_advice_tries_what_can_be_silent_on_the_engine_of_the_run():
    """What is hardly moved needs no law of failure."""
    result = result_of(pulled(*(law() for law in LAWS), speed=1e-9))
    before = len(ENGINES._engines)
    advice = needed_effects(result)
    assert len(ENGINES._engines) == before
    assert {"softening", "shear_slip"} <= set(advice.droppable)
