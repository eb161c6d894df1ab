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
from taichi_dem.mesh.shapes import pair, single
from taichi_dem.simulate import run_simulation
from tests.scenes import apart

STEP, TWO = 1e-7, join(single(), single().moved(by=(1.0, 0.0, 0.0)))
module = sys.modules[needed_effects.__module__]


def recorded(energy=(1.0, 2.0), heat=(0.0, 1e-3), broken=(np.nan, 1e-5, 2e-5), speed=3.0, slow=1.0):
    """A result of two samples and parts, one slow; of three bonds two broke, by default."""
    history = {
        "time_s": np.array([0.0, 1.0]),
        "kinetic_J": np.array(energy),
        "slip_J": np.array(heat),
        "residual_J": np.random.default_rng().random(2),
        "largest_speed_m_s": np.array([0.0, speed]),
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
        # 2e-10 J move 1 kg at 2e-5 m/s.
        ({"speed": 3.0 + 1.9e-5}, 0.0),
        ({"speed": 3.0 + 2.1e-5}, 7e-6),
        # Beside a faster part a slow one is judged by its own speed.
        ({"slow": 1.01}, 0.01),
    ],
)
def test_difference_of_runs_is_a_share_of_what_was_recorded(other, share):
    found = module.recorded_difference(recorded(), recorded(**other))
    assert found == pytest.approx(share, rel=1e-4, abs=1e-15)


def test_a_motion_that_was_set_is_set_again():
    """Else the run without them would be at rest, and differ by all."""
    idle = (effects.Softening(), effects.ShearSlip())
    simulation = Simulation(Scene(apart(2), CONCRETE, idle), Uniform(STEP))
    simulation.state.set_motion(simulation.model.centre, None, [[0, 0, 0], [5.0, 2.0, 1.0]])
    thrown = run_simulation(simulation, until=1e-5, samples=2, progress=None)
    assert set(needed_effects(thrown).droppable) == {effect.name for effect in idle}
    # A report alone shows nothing of a run without them.
    assert thrown.report.advice().droppable == ()


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
