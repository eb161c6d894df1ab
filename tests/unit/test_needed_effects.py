"""A run says which of its effects acted, which it could do without, and which it lacked.

An effect is called droppable only where a run without it has been made and is equal.
Estimates before a run judge each connected part by its own stress and motion.
"""

import re
from dataclasses import replace

import numpy as np
import pytest

from taichi_dem import (
    CONCRETE,
    Scene,
    Simulation,
    Uniform,
    effects,
    estimated_effects,
    goals,
    join,
    needed_effects,
    shapes,
    simulate,
)
from taichi_dem.engine import ENGINES
from taichi_dem.kit.allocation import assign, values
from taichi_dem.kit.effect_table import NEEDED
from taichi_dem.mesh.shapes import bar, pair
from taichi_dem.report.energy_balance import energy_put_in
from taichi_dem.state.model import Model
from tests.probe import BondProbe

#: Far below the strength of concrete: a block of some 1 kg that falls from rest for 1e-5 s.
STEP, UNTIL = 1e-7, 1e-5
GENTLE = effects.BondDamping, effects.Softening, effects.Gravity
LAWS = effects.Softening, effects.ShearSlip, effects.BondDamping
METHOD = Uniform(1e-7)


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


def test_energy_that_bodies_have_at_the_start_is_put_in():
    """Thrown up at v, they have m v^2 / 2, of which their weight takes a part and gives none."""
    speed, mass = 2.0, Model(pair(), CONCRETE, ()).body_mass.sum()
    listed = [make() for make in GENTLE]
    thrown = Scene(pair(), CONCRETE, listed, velocity=(0.0, speed, 0.0))
    result = simulate(thrown, method=Uniform(STEP), until=UNTIL, samples=4, progress=None)
    held, account = 0.5 * mass * speed**2, result.report.energy_balance
    assert account["load_work"] < 0.0
    assert energy_put_in(account) == pytest.approx(held, rel=1e-12)
    share = 1.0 + account["load_work"] / held
    assert goals.energy_share("kinetic").value(result) == pytest.approx(share, rel=1e-9)
    (weight,) = (use for use in result.report.effect_activity if use.effect == "gravity")
    assert weight.share == pytest.approx(-account["load_work"] / held, rel=1e-9)
    words = result.report.rows()["energy put in"]
    told = [float(number) for number in re.findall(r"[-+.\de]+(?= J)", words)]
    assert told == pytest.approx([held, held, -account["load_work"]], rel=1e-5)


def pulled(*listed, speed=2.0):
    """A bar whose end is pulled until it breaks where it can."""
    drive = effects.PrescribedMotion("right", (speed, 0.5 * speed, 0.0), 900.0)
    loads = effects.Gravity(), effects.GasPressure("left", start=1.0)
    acting = [*listed, *loads, effects.Fixed("left"), drive]
    return Scene(bar(0.2, 0.1, (2, 1, 1)), CONCRETE, acting)


def result_of(scene):
    return simulate(scene, method=METHOD, until=4e-4, samples=4, frames=4, progress=None)


@pytest.fixture(scope="module")
def scene(taichi_session):
    return pulled(*(law() for law in LAWS))


def test_a_silent_effect_leaves_every_bit_and_report_of_a_scene_without_it(scene):
    assert result_of(scene).report.broken_faces > 0
    before = ENGINES.count
    silent = result_of(pulled(*(law().silent() for law in LAWS)))
    assert ENGINES.count == before
    without = result_of(pulled())
    for key, column in silent.series.items():
        assert column.tobytes() == without.series[key].tobytes(), key
    for frame, other in zip(silent.frames, without.frames):
        assert frame.position.tobytes() == other.position.tobytes()
    assert silent.report.effects == without.report.effects
    assert silent.report.energy_balance == without.report.energy_balance


def test_every_load_and_support_is_judged_by_its_own_bodies(scene):
    """Weight acts on all, a gas that never comes on none, supports on those that they move."""
    found = {use.effect: use.events for use in result_of(scene).report.effect_activity}
    assert list(found.values())[len(LAWS) :] == [12, 0, 2, 2]


def test_what_steers_is_judged_by_a_run_without_it(scene):
    """Softening takes a share of the energy, and without it nothing breaks."""
    result = result_of(scene)
    (use,) = (one for one in result.report.effect_activity if one.effect == "softening")
    assert result.report.broken_faces > 0 and use.share < 0.9
    advice = needed_effects(result, 0.9)
    assert advice.shown["softening"] == np.inf and "softening" not in advice.droppable


EDGE = 0.05
BLOCK = shapes.block(0.1, element=0.1)
HALVES = join(BLOCK, BLOCK.moved(by=(0.101, 0.0, 0.0)), names=["left", "right"])


@pytest.fixture(scope="module")
def probes(taichi_session):
    """The pair with elastic bonds, and with bonds that soften and slip."""
    laws = effects.Softening(), effects.ShearSlip()
    return BondProbe(pair(EDGE), []), BondProbe(pair(EDGE), laws)


@pytest.mark.parametrize(
    ("pull", "slide", "expected"),
    [
        # Shares of the strength, and of the cohesion; friction lowers the limit in tension.
        (0.999, 0.0, [False, False]),
        (1.001, 0.0, [True, False]),
        (-1.0, 1.57, [False, False]),
        (-1.0, 1.59, [False, True]),
        (0.5, 0.72, [False, True]),
        (0.5, 0.70, [False, False]),
    ],
)
def test_limits_are_those_of_the_laws(probes, pull, slide, expected):
    """Tension and slip are noted where Softening and ShearSlip would have acted, unit by unit.

    Strength and cohesion of concrete are one number; the limit in shear is c - 0.58 of the pull.
    """
    elastic, acting = probes
    tractions = CONCRETE.tensile_strength * np.array([pull, slide, 0.0])
    for probe in probes:
        probe.reset()
        assign(probe.state.passed, -1)
        probe.open(tractions / probe.model.bond_stiffness[0][[0, 1, 1]])
    assert [tick >= 0 for tick in values(elastic.state.passed)[0]] == expected
    assert list(acting.simulation.readings.active_bonds()[0]) == expected


def test_a_limit_passed_between_two_samples_is_seen():
    """A bond is pulled past its strength and pushed back; at both samples it holds little.

    The pull lasts half a period of 1e-5 s; in between it opens by v / (pi f), five times its onset.
    """
    speed, frequency = np.pi * 1e5 * 5.0 * CONCRETE.onset_opening, 1e5
    pull = effects.PrescribedMotion("right", (speed, 0.0, 0.0), frequency)
    scene = Scene(pair(EDGE), CONCRETE, [effects.Fixed("left"), pull])
    simulation = Simulation(scene, Uniform(STEP))
    simulation.advance_to(100)
    simulation.sample()
    found = {one.effect: one for one in simulation.report().missing_effects}["Softening"]
    assert found.count == 1 and 0.0 < found.first_s < 5e-6
    middle = pair(EDGE).points[simulation.model.topology.vertices[0]].mean(axis=0)
    assert found.place_m == pytest.approx(tuple(middle), rel=1e-15)
    assert simulation.followed.missing_effects.strain[0] < 1e-2


def groups(mesh=HALVES, **motion):
    found = estimated_effects(Scene(mesh, CONCRETE, "auto", **motion), 1e-3)
    return {one.effect: one.group for one in found}, {one.effect: one.verdict for one in found}


def test_a_blow_has_the_stress_of_its_wave():
    """Two equal blocks that meet at v: the wave in each carries v / 2."""
    speed = 2.0
    found, verdicts = groups(velocity={"left": (speed, 0.0, 0.0)})
    model = Model(HALVES, CONCRETE, ())
    wave = np.sqrt(CONCRETE.normal_stiffness * 2.0 * model.body_radius.mean() / CONCRETE.density)
    stress = CONCRETE.density * wave * 0.5 * speed
    assert found["softening"] == pytest.approx(stress / CONCRETE.tensile_strength, 1e-9)
    assert verdicts["contact"] == NEEDED


def test_a_solid_that_turns_has_the_stress_of_its_rim():
    rate = 100.0
    found, _ = groups(BLOCK, spin=(0.0, 0.0, rate))
    centre = BLOCK.points[BLOCK.tetrahedra].mean(axis=1) - 0.05
    rim = rate * np.sqrt((centre[:, :2] ** 2).sum(axis=1).max())
    stress = CONCRETE.density * rim**2
    assert found["softening"] == pytest.approx(stress / CONCRETE.tensile_strength, 1e-6)


def test_a_part_keeps_its_estimates_beside_any_other():
    """Of damping, too: a median over the bonds of all would hide the one bar that is damped."""
    still = replace(CONCRETE, normal_damping=0.0, shear_damping=0.0)
    small, large = bar(2e-3, 5e-4, (4, 1, 1)), bar(4.0, 1.0, (8, 2, 2))
    pulled = effects.Pressure("small_right", -1e5)
    mesh = join(small, large.moved(by=(20.0, 0.0, 0.0)), names=["small", "large"])
    beside = Scene(mesh, CONCRETE, "auto", loads=[pulled], materials={"large": still})
    alone = Scene(small, CONCRETE, "auto", loads=[effects.Pressure("right", -1e5)])
    found, own = (
        {one.effect: one.group for one in estimated_effects(scene, 1e-3)}
        for scene in (beside, alone)
    )
    for name in ("softening", "slip", "friction", "bond damping", "air drag"):
        assert found[name] == pytest.approx(own[name], 1e-12), name
