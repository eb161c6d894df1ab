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
    checked_mesh,
    effects,
    join,
    needed_effects,
    simulate,
)
from taichi_dem.engine import ENGINES
from taichi_dem.kit.allocation import assign
from taichi_dem.mesh.shapes import bar, pair, single
from taichi_dem.physics.sphere_pair import CONTACT, RUBBED
from taichi_dem.report.effects import effect_uses
from taichi_dem.report.energy_balance import TERMS
from taichi_dem.report.readings import Run
from taichi_dem.simulate import run_simulation
from taichi_dem.state.model import Model
from tests.scenes import apart

#: Far below the strength of concrete: a block of some 1 kg that falls from rest for 1e-5 s.
STEP, UNTIL = 1e-7, 1e-5
GENTLE = effects.BondDamping, effects.Softening, effects.Gravity
LAWS = effects.Softening, effects.ShearSlip, effects.BondDamping
METHOD = Uniform(1e-7)
TWO = join(single(), single().moved(by=(1.0, 0.0, 0.0)))
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


@pytest.mark.parametrize(
    ("bits", "touched", "rubbed"), [(0, 0, 0), (CONTACT, 1, 0), (CONTACT | RUBBED, 1, 1)]
)
def test_contact_and_friction_are_idle_only_where_the_step_noted_neither(bits, touched, rubbed):
    """With heat or without: the step sees every push."""
    found = used([effects.SphereContact(), effects.Friction()], bits)
    names = "sphere_contact", "friction"
    assert [found[name].events for name in names] == [touched, rubbed]
    assert [found[name].idle for name in names] == [not touched, not rubbed]


@pytest.mark.parametrize("place", range(3))
def test_every_load_and_support_has_a_bit_of_its_own(place):
    """Loads first, in the order of the list, then supports."""
    listed = [effects.Gravity(), effects.GasPressure("left"), effects.Fixed("right")]
    found = used(listed, 1 << place)
    assert [use.events for use in found.values()] == [int(k == place) for k in range(3)]


def test_what_steers_is_never_negligible():
    """It acted, and took a thousandth of a thousandth of the work put in."""
    listed = [effects.Softening(), effects.SphereContact(), effects.Friction()]
    found = used(listed, CONTACT | RUBBED, marked=1, load_work=1.0, softening=1e-9)
    assert all(use.is_active and not use.negligible(1e-3) for use in found.values())


@pytest.mark.parametrize("strain, share, negligible", [(0.0, 1.0, False), (1.0, 1e-6, True)])
def test_dashpots_are_compared_with_what_bonds_hold_not_with_a_fall(strain, share, negligible):
    """A body that falls far takes work by the joule: its vibration is damped all the same."""
    account = {"bond_dashpot": 1e-6, "bond_strain": strain, "load_work": 1e6}
    use = used([effects.BondDamping()], heat=1e-6, **account)["bond_damping"]
    assert use.share == pytest.approx(share, rel=1e-5)
    assert use.negligible(1e-3) == negligible


def test_round_off_in_bonds_is_no_damping():
    """A bar in free fall, far from the origin: its bonds shake by last digits only."""
    mesh = bar(0.5, 0.1, (5, 1, 1))
    mesh = checked_mesh(mesh.points + 100.0, mesh.tetrahedra, {})
    scene = Scene(mesh, CONCRETE, [make() for make in GENTLE])
    advice = needed_effects(simulate(scene, method=Uniform(STEP), until=1e-4, samples=1), 0.0)
    (damping,) = [use for use in advice.uses if use.effect == "bond_damping"]
    assert damping.energy_J > 0.0 and damping.rounding
    assert "bond_damping" in advice.droppable and "bond_damping" not in advice.inactive


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
        series=history,
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
