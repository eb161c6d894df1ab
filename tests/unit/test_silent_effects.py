"""Effects that are compiled and never act."""

import pytest

from taichi_dem import (
    CONCRETE,
    ImplicitDashpots,
    InputError,
    Multirate,
    Scene,
    StepControl,
    Uniform,
    effects,
    needed_effects,
    simulate,
)
from taichi_dem.engine.engine import ENGINES
from taichi_dem.mesh.shapes import bar, pair
from taichi_dem.needed_effects import _without
from tests.slow import slow_but

CAN = {
    "softening": effects.Softening,
    "shear_slip": effects.ShearSlip,
    "bond_damping": effects.BondDamping,
    "friction": effects.Friction,
}
SOME = ("softening", "shear_slip")
METHODS = (
    Uniform(1e-7),
    ImplicitDashpots(2e-7),
    Multirate(8e-8, 1e-5, control=StepControl(), dashpot="limited"),
    Uniform(2.5e-8, dashpot="limited"),
)


def pulled(*listed, method=METHODS[0]):
    """A bar whose end is pulled until it breaks where it can."""
    held = [effects.Fixed("left"), effects.PrescribedMotion("right", (2.0, 1.0, 0.0), 900.0)]
    scene = Scene(bar(0.2, 0.1, (2, 1, 1)), CONCRETE, [*listed, effects.SphereContact(), *held])
    looks = {"samples": 4, "frames": 4, "progress": None}
    return simulate(scene, method=method, until=4e-4, **looks)


@pytest.mark.parametrize("method", slow_but(METHODS, METHODS[0]), ids=lambda method: method.name)
@pytest.mark.parametrize("acting", slow_but([(), ("bond_damping",), SOME], SOME))
def test_a_silent_effect_leaves_every_bit_and_report_of_a_scene_without_it(method, acting):
    loud = {name: kind() for name, kind in CAN.items()}
    mixed = [effect if name in acting else effect.silent() for name, effect in loud.items()]
    silent = pulled(*mixed, method=method)
    without = pulled(*(CAN[name]() for name in acting), method=method)
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


class OwnSoftening(effects.Softening):
    """A law of a user's own, of which the class it derives from knows nothing."""


def test_advice_tries_what_can_be_silent_on_the_engine_of_the_run():
    """A pair that falls freely needs no law of its bond; contact is left out in another engine."""
    laws = [kind() for name, kind in CAN.items() if name != "friction"]
    scene = Scene(pair(), CONCRETE, [*laws, effects.Gravity()])
    result = simulate(scene, method=Uniform(1e-7), until=1e-5)
    before = len(ENGINES._engines)
    advice = needed_effects(result)
    assert len(ENGINES._engines) == before
    assert set(advice.droppable) == {"softening", "shear_slip", "bond_damping"}


def test_advice_leaves_out_what_cannot_be_silent():
    """A class that only inherits how to be silent may have a law that acts all the same."""
    listed = [effects.Softening(), OwnSoftening(), effects.SphereContact(), effects.Friction()]
    for name, may, kept in [
        ("softening", True, ["", "sphere_contact", "friction"]),
        ("softening", False, ["sphere_contact", "friction"]),
        ("sphere_contact", True, ["softening", "softening", "friction"]),
        ("friction", True, ["softening", "softening", "sphere_contact", ""]),
    ]:
        left = _without(listed, (name,), may)
        assert [effect.name for effect in left] == kept
    both = _without(listed, ("sphere_contact", "friction"), True)
    assert [effect.name for effect in both] == ["softening", "softening"]
