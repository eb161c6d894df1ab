"""An effect is called droppable only where a run without it has been made and is equal."""

import sys
from types import SimpleNamespace

import numpy as np
import pytest

from taichi_dem import (
    CONCRETE,
    Scene,
    Simulation,
    Uniform,
    effects,
    join,
    needed_effects,
    simulate,
)
from taichi_dem.kit.effect_usage import Advice, EffectUse
from taichi_dem.mesh.shapes import pair, single
from taichi_dem.simulate import run_simulation
from tests.scenes import apart

STEP, TWO = 1e-7, join(single(), single().moved(by=(1.0, 0.0, 0.0)))
IDLE = EffectUse("softening", "bonds softened", 0, 10, 0.0, 0.0, steers=True)
module = sys.modules[needed_effects.__module__]


def recorded(energy=(1.0, 2.0), heat=(0.0, 1e-3), broken=(np.nan, 1e-5, 2e-5), speed=3.0, slow=1.0):
    """A result of two samples and parts, one slow; of three bonds two broke, by default."""
    history = {
        "time_s": np.array([0.0, 1.0]),
        "kinetic_J": np.array(energy),
        "slip_J": np.array(heat),
        "residual_J": np.random.default_rng().random(2),
        "largest_speed_m_s": np.array([0.0, speed]),
        "hole_radial_displacement_mm": np.array([0.0, speed]),
    }
    report = SimpleNamespace(round_off_J=2e-10, until_s=1.0)
    model = SimpleNamespace(body_mass=np.array([1.0, 4.0]), mesh=TWO)
    return SimpleNamespace(
        history=history,
        peak_speed=np.array([speed, slow]),
        broken_time=np.array(broken),
        report=report,
        model=model,
    )


@pytest.mark.parametrize(
    ("other", "share"),
    [
        ({}, 0.0),
        ({"energy": (1.0, 2.02)}, 0.01),
        # Of energies, of the largest of them all; nothing that slipped is a joule.
        ({"heat": (0.0, 3e-3)}, 1e-3),
        ({"broken": (np.nan, 1e-5, 3e-5)}, 0.5),
        ({"broken": (np.nan, 1e-5, np.nan)}, np.inf),
        ({"broken": (1e-5, np.nan, 2e-5)}, np.inf),
        ({"energy": (1.0,)}, np.inf),
        # 2e-10 J move 1 kg at 2e-5 m/s, 2e-5 m in a second; a mm is a thousandth of one.
        ({"energy": (1.0, 2.0 + 1e-10)}, 0.0),
        ({"energy": (1.0, 2.0 + 3e-10)}, 1.5e-10),
        ({"speed": 3.0 + 1.9e-5}, 0.0),
        ({"speed": 3.0 + 2.1e-5}, 7e-6),
        # Beside a faster part a slow one is judged by its own speed.
        ({"slow": 1.01}, 0.01),
    ],
)
def test_difference_of_runs_is_a_share_of_what_was_recorded(other, share):
    found = module.recorded_difference(recorded(), recorded(**other))
    assert found == pytest.approx(share, rel=1e-4, abs=1e-15)


@pytest.mark.parametrize(
    ("shown", "droppable", "words"),
    [
        (
            {"softening": 0.0},
            True,
            "drop       softening        never acted (0 bonds softened); a ",
        ),
        ({"softening": 1e-9}, True, "a run without it differs by 1e-07 %"),
        ({"softening": 2e-9}, False, "a run without it differs by 2e-07 %"),
        ({"softening": np.inf}, False, "a run without it differs by inf %"),
        ({}, False, "no run without it was made"),
    ],
)
def test_what_was_shown_decides(shown, droppable, words):
    advice = Advice((IDLE,), (), 1e-9, shown)
    assert advice.droppable == ("softening",) * droppable
    assert words in str(advice) and str(advice).startswith("drop" if droppable else "keep")


FOUR = (effects.SphereContact(), effects.Friction(), effects.Softening(), effects.ShearSlip())


@pytest.mark.parametrize(
    ("needed", "expected"),
    [
        ((), {"friction", "sphere_contact", "softening", "shear_slip"}),
        (("softening",), {"friction", "sphere_contact", "shear_slip"}),
        # Contact is not left out where friction has to stay.
        (("friction",), {"softening", "shear_slip"}),
        (("softening", "sphere_contact"), {"friction", "shear_slip"}),
    ],
)
def test_what_is_called_droppable_can_be_left_out_together(monkeypatch, needed, expected):
    """Of runs that differ as soon as one of these is left out, or contact alone."""
    tried = []

    def difference(result, names):
        tried.append(set(names))
        alone = "sphere_contact" in names and "friction" not in names
        return 1.0 if alone or set(needed) & set(names) else 0.0

    monkeypatch.setattr(module, "_difference", difference)
    result = SimpleNamespace(scene=SimpleNamespace(effects=FOUR))
    found = module.differences(result, [effect.name for effect in FOUR], 1e-9)
    equal = {name for name, share in found.items() if share <= 1e-9}
    assert equal == expected and set(found) == {effect.name for effect in FOUR}
    assert equal in tried or len(needed) == 4
    assert needed or len(tried) == 1


@pytest.fixture(scope="module")
def thrown():
    """Two loose bodies, one of which was thrown away from the other."""
    scene = Scene(apart(2), CONCRETE, FOUR)
    simulation = Simulation(scene, Uniform(STEP))
    simulation.state.set_motion(simulation.model.centre, None, [[0, 0, 0], [5.0, 2.0, 1.0]])
    return run_simulation(simulation, until=1e-5, samples=2, progress=None)


def test_a_motion_that_was_set_is_set_again(thrown):
    """Else the run without them would be at rest, and differ by all."""
    advice = needed_effects(thrown)
    assert set(advice.droppable) == {effect.name for effect in FOUR}
    assert str(advice).count("a run without it is the same") == 4


def test_a_report_alone_shows_nothing(thrown):
    advice = needed_effects(thrown.report)
    assert advice.droppable == () and set(advice.inactive) == {e.name for e in FOUR}
    assert str(advice).count("keep") == str(advice).count("no run without it was made") == 4


def test_what_differs_is_kept_though_its_share_is_small():
    """Dashpots of a bond that is pushed: what is shown is the difference of the two runs."""
    listed = [effects.BondDamping(), effects.PrescribedMotion("left", (1.0, 0.0, 0.0))]
    ways = {"method": Uniform(STEP), "until": 2e-6, "samples": 2, "progress": None}
    result, without = (simulate(Scene(pair(), CONCRETE, of), **ways) for of in (listed, listed[1:]))
    share = result.report.effect_activity[0].share
    assert 0.0 < share < 0.999
    advice = needed_effects(result, 0.999)
    differs = module.recorded_difference(result, without)
    assert advice.shown == {"bond_damping": differs} and differs > 0.0
    assert ("bond_damping" in advice.droppable) == (differs <= 0.999)
    assert needed_effects(result, 0.5 * share).shown == {}
