"""Effects that are compiled and never act."""

import pytest

from taichi_dem import CONCRETE, InputError, Scene, Uniform, effects, needed_effects, simulate
from taichi_dem.engine.engine import ENGINES
from taichi_dem.mesh.shapes import bar, pair
from tests.slow import slow_but

CAN = {
    "softening": effects.Softening,
    "shear_slip": effects.ShearSlip,
    "bond_damping": effects.BondDamping,
    "friction": effects.Friction,
}


def pulled(*listed):
    """A bar whose end is pulled until it breaks where it can."""
    held = [effects.Fixed("left"), effects.PrescribedMotion("right", (2.0, 1.0, 0.0), 900.0)]
    scene = Scene(bar(0.2, 0.1, (2, 1, 1)), CONCRETE, [*listed, effects.SphereContact(), *held])
    looks = {"samples": 4, "frames": 4, "progress": None}
    return simulate(scene, method=Uniform(1e-7), until=4e-4, **looks)


@pytest.mark.parametrize(
    "acting", slow_but([(), ("bond_damping",), ("softening", "shear_slip")], ("bond_damping",))
)
def test_a_silent_effect_leaves_every_bit_and_report_of_a_scene_without_it(acting):
    silent = pulled(*(kind() if name in acting else kind().silent() for name, kind in CAN.items()))
    without = pulled(*(CAN[name]() for name in acting))
    for key, values in silent.history.items():
        assert values.tobytes() == without.history[key].tobytes(), key
    for frame, other in zip(silent.frames, without.frames):
        assert frame.position.tobytes() == other.position.tobytes()
    assert silent.report.effects == without.report.effects
    assert silent.report.energy_balance == without.report.energy_balance
    assert str(needed_effects(silent)) == str(needed_effects(without))


def test_silent_effects_compile_nothing_that_loud_ones_have_not():
    assert pulled(*(kind() for kind in CAN.values())).report.broken_faces > 0
    before = len(ENGINES._engines)
    assert pulled(*(kind().silent() for kind in CAN.values())).report.broken_faces == 0
    assert len(ENGINES._engines) == before


@pytest.mark.parametrize(
    "effect", [effects.Gravity(), effects.SphereContact(), effects.StickingFriction()]
)
def test_effects_without_harmless_numbers_are_refused(effect):
    with pytest.raises(InputError, match=f"{effect.name} cannot be silent"):
        effect.silent()


def test_a_silent_effect_is_not_listed():
    loud = effects.Softening()
    scene = Scene(pair(), CONCRETE, [loud.silent()])
    assert not scene.has("softening") and loud.name == "softening"
