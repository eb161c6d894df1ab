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
from taichi_dem.kit.effect_table import NEEDED, EffectTable, EffectUse
from taichi_dem.mesh.shapes import bar, pair
from taichi_dem.report.energy_balance import energy_put_in
from taichi_dem.report.missing_effects import unserved
from taichi_dem.state.model import Model
from taichi_dem.state.timeline import NEVER
from tests.material.blocks import rock
from tests.structures import filled

LAWS = effects.Softening, effects.ShearSlip, effects.BondDamping
METHOD = Uniform(1e-7)


def test_energy_that_bodies_have_at_the_start_is_put_in():
    """Thrown at v against a gas, they have m v^2 / 2, of which the gas takes a part and gives none.

    It pushes with 3 N in the end, and so takes a ten thousandth at the most.
    """
    speed, mass = 2.0, Model(pair(), CONCRETE, ()).body_mass.sum()
    listed = filled("bonds", effects.GasPressure("left", peak=3e3, rise=1e-5))
    thrown = Scene(pair(), CONCRETE, listed, velocity=(-speed, 0.0, 0.0))
    result = simulate(thrown, method=METHOD, until=1e-5, samples=4, progress=None)
    held, account = 0.5 * mass * speed**2, result.report.energy_balance
    assert account["load_work"] < 0.0
    assert energy_put_in(account) == pytest.approx(held, rel=1e-12)
    share = account["kinetic"] / held
    assert goals.energy_share("kinetic").value(result) == pytest.approx(share, rel=1e-12)
    (gas,) = (use for use in result.report.effect_activity if use.effect.startswith("gas"))
    assert gas.share == pytest.approx(-account["load_work"] / held, rel=1e-9)
    words = result.report.rows()["energy put in"]
    told = [float(number) for number in re.findall(r"[-+.\de]+(?= J)", words)]
    assert told == pytest.approx([held, held, -account["load_work"]], rel=1e-5)


def pulled(*listed, mesh=None, speed=2.0, frequency=900.0):
    """A bar, or a mesh, whose end is pulled until it breaks where it can."""
    drive = effects.PrescribedMotion("right", (speed, 0.5 * speed, 0.0), frequency)
    loads = effects.Gravity(), effects.GasPressure("left", start=1.0)
    acting = [*listed, *loads, effects.Fixed("left"), drive]
    return Scene(mesh or bar(0.2, 0.1, (2, 1, 1)), CONCRETE, acting)


def result_of(scene):
    return simulate(scene, method=METHOD, until=4e-4, samples=4, frames=4, progress=None)


@pytest.fixture(scope="module")
def result(taichi_session):
    """Of the bar with all of the laws, some of whose bonds break."""
    found = result_of(pulled(*(law() for law in LAWS)))
    assert found.report.broken_faces > 0
    return found


def test_a_silent_effect_leaves_every_bit_and_report_of_a_scene_without_it(result):
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


def test_effects_that_never_acted_are_droppable_and_loads_are_not():
    """Pulled a thousand times more gently; a run without them has been made, and is equal."""
    advice = needed_effects(result_of(pulled(*(law() for law in LAWS), speed=2e-3)))
    assert {"softening", "shear_slip"} <= {*advice.droppable} and advice.missing == ()
    assert advice.shown["softening"] == 0.0 and "gravity" not in advice.droppable


def test_every_load_and_support_is_judged_by_its_own_bodies(result):
    """Weight acts on all, a gas that never comes on none, supports on those that they move."""
    found = {use.effect: use.events for use in result.report.effect_activity}
    assert list(found.values())[len(LAWS) :] == [12, 0, 2, 2]


def test_what_steers_is_judged_by_a_run_without_it(result):
    """Softening takes a share of the energy, and without it nothing breaks."""
    (use,) = (one for one in result.report.effect_activity if one.effect == "softening")
    assert use.share < 0.9
    advice = needed_effects(result, 0.9)
    assert advice.shown["softening"] == np.inf and "softening" not in advice.droppable


@pytest.mark.parametrize("shown", [None, {}])
def test_what_defines_the_problem_is_kept_however_little_it_did(shown):
    """Beside an effect of the same share that may be left out, where counts decide."""
    slight = EffectUse("friction", "bodies rubbed", 3, energy_J=1e-9, share=1e-9)
    drive = replace(slight, effect="gravity", kept="a load defines the problem")
    table = EffectTable(acting=(slight, drive), tolerance=1e-3, shown=shown)
    assert table.droppable == (() if shown == {} else ("friction",))
    advice = dict(zip(table.table()["effect"], table.table()["advice"]))
    assert advice["gravity"] == "keep" != advice["friction"]


BOTH = effects.BodyContact(), effects.StickingFriction()
LISTED = {
    "nothing": (),
    "one part of the law of bonds": (effects.ShearSlip(),),
    "a law of bonds as a whole": (effects.MixedMode(1e3), effects.BondDamping()),
    "contact": BOTH[:1],
    "contact and friction": BOTH,
}


@pytest.mark.parametrize("listed", LISTED.values(), ids=LISTED)
@pytest.mark.parametrize(
    "material", [CONCRETE, replace(CONCRETE, friction=0.0), rock()], ids=["", "smooth", "rock"]
)
def test_a_scene_lacks_what_auto_would_add_to_it(listed, material):
    """But friction without contact, which then cannot rub; a silent law is lacking, too."""
    mesh, touches = bar(0.2, 0.1, (2, 1, 1)), BOTH[0] in listed
    added = {*Scene(mesh, material, "auto", loads=listed).effects} - {*listed}
    wanted = {type(one).__name__ for one in added if touches or one.role != "friction"}
    silent = [effects.Softening().silent()] * ("Softening" in wanted)
    model = Model(mesh, material, [*listed, *silent])
    assert {need.effect for need in unserved(model).values()} == wanted


def strained(*listed):
    """A bar of bodies moved a little at random, whose bonds have been evaluated once."""
    simulation = Simulation(Scene(bar(0.4, 0.2, (4, 2, 2)), CONCRETE, listed), METHOD)
    shift = np.random.default_rng(1).standard_normal(simulation.model.centre.shape)
    place = simulation.model.centre + 3.0 * CONCRETE.onset_opening * shift
    simulation.state.set_motion(place)
    simulation.start()
    return simulation


def test_limits_are_those_of_the_laws():
    """Tension and slip are noted where Softening and ShearSlip would have acted, bond by bond.

    What has softened bears less shear, and so slips later than an elastic bond passes its limit.
    """
    elastic = strained()
    noted = elastic.values(elastic.state.passed) != NEVER
    acting = strained(*filled("bonds", effects.Softening(), effects.ShearSlip()))
    acted = acting.readings.active_bonds()
    whole = ~noted[:, 0]
    assert np.array_equal(noted[:, 0], acted[:, 0])
    assert np.array_equal(noted[whole], acted[whole])
    assert 0.1 < noted[:, 0].mean() < 0.9 and 0.1 < noted[whole, 1].mean() < 0.9


def test_a_limit_passed_between_two_samples_is_seen():
    """A bond is pulled past its strength and pushed back; at both samples it holds little.

    The pull lasts half a period of 1e-5 s; in between it opens by v / (pi f), five times its onset.
    """
    mesh, frequency = pair(0.05), 1e5
    speed = np.pi * frequency * 5.0 * CONCRETE.onset_opening
    simulation = Simulation(pulled(mesh=mesh, speed=speed, frequency=frequency), METHOD)
    simulation.advance_to(100)
    simulation.sample()
    found = {one.effect: one for one in simulation.report().missing_effects}["Softening"]
    assert found.count == 1 and 0.0 < found.first_s < 5e-6
    middle = mesh.points[simulation.model.topology.vertices[0]].mean(axis=0)
    assert found.place_m == pytest.approx(tuple(middle), rel=1e-15)


BLOCK = shapes.block(0.1, element=0.1)
HALVES = join(BLOCK, BLOCK.moved(by=(0.101, 0.0, 0.0)), names=["left", "right"])


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
