"""A run says which of its effects acted, and which it could do without.

A run with an effect silenced is exactly the run of a scene without it.
An effect is called droppable only where a run without it has been made and is equal.
"""

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
    needed_effects,
    simulate,
)
from taichi_dem.engine import ENGINES
from taichi_dem.kit.allocation import assign
from taichi_dem.mesh.shapes import bar, pair
from taichi_dem.report.effects import effect_uses
from taichi_dem.report.energy_balance import TERMS
from taichi_dem.report.readings import Run
from taichi_dem.state.model import Model

#: Far below the strength of concrete: a block of some 1 kg that falls from rest for 1e-5 s.
STEP, UNTIL = 1e-7, 1e-5
GENTLE = effects.BondDamping, effects.Softening, effects.Gravity
LAWS = effects.Softening, effects.ShearSlip, effects.BondDamping
METHOD = Uniform(1e-7)
module = sys.modules[needed_effects.__module__]


def ran(*listed):
    """A pair of bodies, at rest at the start, with some effects."""
    return simulate(Scene(pair(), CONCRETE, listed), method=Uniform(STEP), until=UNTIL, samples=4)


@pytest.fixture(scope="module")
def gentle():
    """A pair that falls freely: nothing is stretched, nothing breaks."""
    return ran(*(make() for make in GENTLE))


def test_dropping_effects_that_never_acted_changes_no_bit(gentle):
    """The advice is a promise: without these effects every sample is the same."""
    advice = needed_effects(gentle)
    assert "softening" in advice.inactive and advice.missing == ()
    assert "gravity" not in advice.droppable
    again = ran(*(make() for make in GENTLE if make.name not in advice.inactive))
    for name, column in gentle.series.items():
        np.testing.assert_array_equal(again.series[name], column, err_msg=name)


def test_weight_of_all_is_all_the_work(gentle):
    """Free fall, work = m g (g t) t / 2 = weight times height; the only load, so its share is 1.

    Kicks in the middle of a step of dt give v = g t at its end; with the mean velocity of each
    kick the work is exactly m (g t)^2 / 2.
    """
    use = next(use for use in gentle.report.effect_activity if use.effect == "gravity")
    mass = gentle.model.body_mass.sum()
    assert use.events == use.of == 2
    assert use.share == pytest.approx(1.0, rel=1e-12)
    assert use.energy_J == pytest.approx(0.5 * mass * (9.81 * UNTIL) ** 2, rel=1e-9)


def used(listed, bits=0, marked=0, heat=0.0, **account):
    """What is said of effects whose account holds these terms [J]; every effect by its name.

    bits: of ``State.active_effects``, of the first body. marked: bonds softened and slipped.
    heat: in each bond [J].
    """
    model = Model(pair(), CONCRETE, listed)
    simulation = Simulation(Scene(pair(), CONCRETE), Uniform(STEP))
    state, schedule = simulation.state, simulation.schedule
    assign(state.active_effects, [bits, 0])
    assign(schedule.evaluations, [100])
    balance = SimpleNamespace(start_energy=0.0, works=lambda: np.zeros((2, 4)))
    bonds = {"active_bonds": np.full((1, 2), marked > 0), "bonds": np.full((1, 5), heat)}
    readings = SimpleNamespace(**{name: lambda one=one: one for name, one in bonds.items()})
    filled = {**dict.fromkeys(TERMS, 0.0), **account}
    run = Run(model, state, schedule, None, readings, None)
    return {use.effect: use for use in effect_uses(run, balance, filled)}


@pytest.mark.parametrize("place", range(3))
def test_every_load_and_support_has_a_bit_of_its_own(place):
    """Loads first, in the order of the list, then supports."""
    listed = [effects.Gravity(), effects.GasPressure("left"), effects.Fixed("right")]
    found = used(listed, 1 << place)
    assert [use.events for use in found.values()] == [int(k == place) for k in range(3)]


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
