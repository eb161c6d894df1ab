"""What a run says of its effects: which acted, which it could do without, which it missed."""

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from taichi_dem import (
    CONCRETE,
    InputError,
    Scene,
    Simulation,
    Uniform,
    checked_mesh,
    effects,
    needed_effects,
    simulate,
)
from taichi_dem.diagnostics.effect_activity import effect_activity
from taichi_dem.diagnostics.energy_balance import TERMS
from taichi_dem.engine.model import Model
from taichi_dem.kit.effect_usage import Advice, EffectUse
from taichi_dem.mesh.shapes import bar, pair
from tests.unit.test_outer_faces import beside

#: Far below the strength of concrete: a block of some 1 kg that falls from rest for 1e-5 s.
STEP, UNTIL = 1e-7, 1e-5
GENTLE = (
    *(effects.BondDamping, effects.Softening, effects.ShearSlip),
    *(effects.SphereContact, effects.Friction, effects.Gravity),
)


def ran(*listed):
    """A pair of bodies, at rest at the start, with some effects."""
    return simulate(Scene(pair(), CONCRETE, listed), method=Uniform(STEP), until=UNTIL, samples=4)


@pytest.fixture(scope="module")
def gentle():
    """A pair that falls freely: nothing is stretched, nothing breaks, nothing touches."""
    return ran(*(make() for make in GENTLE))


def test_effects_that_never_act_are_named(gentle):
    advice = needed_effects(gentle)
    idle = {"softening", "shear_slip", "sphere_contact", "friction"}
    assert idle <= set(advice.inactive)
    assert "gravity" not in advice.droppable
    assert advice.missing == ()
    lines = {line.split()[1]: line for line in str(advice).splitlines()}
    assert lines["softening"].startswith("drop")
    assert "never acted (0 bonds softened)" in lines["softening"]


class Own(effects.BondDamping):
    """An effect of a user's own, of which the package knows the role alone."""

    name = "own"


#: One body is held and the other hangs: the support does no work, and weight gives next to none.
HUNG = (
    *(Own, effects.Softening, effects.ShearSlip, effects.SphereContact, effects.Friction),
    *(effects.Gravity, lambda: effects.Fixed("left")),
)


@pytest.fixture(scope="module")
def hung():
    """A pair of which one body is held."""
    return ran(*(make() for make in HUNG))


def test_what_poses_the_question_is_kept_though_it_did_nothing(hung):
    advice = needed_effects(hung, 1.0)
    assert set(advice.droppable) == {"softening", "shear_slip", "sphere_contact", "friction"}
    lines = {line.split()[1]: line for line in str(advice).splitlines()}
    assert lines["fixed"].startswith("keep       fixed            1 of 2 bodies held, 0 J")
    assert "a support is part of the question" in lines["fixed"]
    assert "a load is part of the question" in lines["gravity"]
    assert "an effect of your own" in lines["own"] and lines["own"].startswith("keep")


@pytest.mark.parametrize("scene", ["gentle", "hung"])
def test_dropping_inactive_effects_changes_no_bit(scene, request):
    """The advice is a promise: without these effects every sample is the same."""
    result, makers = request.getfixturevalue(scene), {"gentle": GENTLE, "hung": HUNG}[scene]
    dropped = needed_effects(result).inactive
    kept = [effect for effect in (make() for make in makers) if effect.name not in dropped]
    again = ran(*kept)
    assert len(kept) < len(makers)
    for name, column in result.history.items():
        np.testing.assert_array_equal(again.history[name], column, err_msg=name)


def used(
    listed, material=CONCRETE, exposed=True, heat=0.0, lacking=0, mesh=None, works=None, **account
):
    """What is said of effects whose account holds these terms [J]; every effect by its name.

    exposed: whether faces carry spheres. heat: of each body's contacts, and in each bond [J].
    lacking: recordings that saw bodies overlap where faces carry none.
    """
    simulation = Simulation(Scene(mesh or pair(), material, listed), Uniform())
    model, state = simulation.model, simulation.state
    if model.has_contact and exposed:
        state.expose(model.topology)
    bonds = model.bond_count
    tables = np.zeros((model.body_count, 6)), np.full((bonds, 5), heat), np.zeros((0, 4))
    tables[0][:, 3:5] = heat
    none = SimpleNamespace(state=state, start_energy=0.0, support_works=lambda index: works)
    filled = {**dict.fromkeys(TERMS, 0.0), **account}
    watch = SimpleNamespace(touching=0, outer=SimpleNamespace(times=lacking))
    return {use.effect: use for use in effect_activity(model, none, tables, filled, watch, 100)}


class OwnContact(effects.SphereContact):
    """A law of a user's own."""


class OwnFriction(effects.Friction):
    """A law of a user's own."""


LOSSLESS = replace(CONCRETE, contact_damping=0.0)


@pytest.mark.parametrize(
    ("contact", "material", "exposed", "idle"),
    [
        (effects.SphereContact, CONCRETE, True, True),
        (effects.SphereContact, LOSSLESS, True, False),
        (effects.SphereContact, LOSSLESS, False, True),
        (OwnContact, CONCRETE, True, False),
        (OwnContact, CONCRETE, False, True),
    ],
)
def test_contact_is_idle_only_where_a_touch_would_have_left_a_trace(
    contact, material, exposed, idle
):
    """Heat in dashpots is one; without dashpots, or by a law of one's own, only bare faces are."""
    use = used([contact(), effects.Friction()], material, exposed)["sphere_contact"]
    assert use.idle == idle
    assert bool(use.kept) != idle


@pytest.mark.parametrize("exposed", [True, False])
def test_friction_of_ones_own_is_dropped_only_with_the_contact_it_acts_in(exposed):
    found = used([effects.SphereContact(), OwnFriction()], exposed=exposed)
    assert found["friction"].idle != exposed
    assert found["sphere_contact"].idle


@pytest.mark.parametrize("exposed", [True, False])
def test_friction_that_sticks_is_kept_where_springs_may_hold(exposed):
    """They take no energy, so that no account tells; where no face carries spheres, none holds."""
    found = used([effects.SphereContact(), effects.StickingFriction()], exposed=exposed)
    assert found["sticking_friction"].idle != exposed


def test_contact_is_not_dropped_where_spheres_on_outer_faces_are_missing():
    found = used([effects.SphereContact(), effects.Friction()], exposed=False, lacking=1)
    assert not any(use.idle for use in found.values())


STEERING = (effects.Softening, effects.ShearSlip, effects.SphereContact, effects.Friction)


@pytest.mark.parametrize("make", STEERING)
def test_what_steers_is_never_negligible(make):
    """It acted, and took a thousandth of a thousandth of the work put in."""
    listed = [make()] if make is not effects.Friction else [effects.SphereContact(), make()]
    use = used(listed, heat=1e-9, load_work=1.0, slip=1e-9, softening=1e-9)[make.name]
    assert use.is_active and not use.negligible(1e-3)


@pytest.mark.parametrize("strain, share, negligible", [(0.0, 1.0, False), (1.0, 1e-6, True)])
def test_dashpots_are_compared_with_what_bonds_hold_not_with_a_fall(strain, share, negligible):
    """A body that falls far takes work by the joule: its vibration is damped all the same."""
    account = {"bond_dashpot": 1e-6, "bond_strain": strain, "load_work": 1e6}
    use = used([effects.BondDamping()], heat=1e-6, **account)["bond_damping"]
    assert use.share == pytest.approx(share, rel=1e-5)
    assert use.negligible(1e-3) == negligible


def test_weight_of_all_is_all_the_work(gentle):
    """Free fall, work = m g (g t) t / 2 = weight times height; the only load, so its share is 1.

    Kicks at the beginning of a step of dt give v = g t at its end; with the mean velocity of each
    kick the work is exactly m (g t)^2 / 2.
    """
    use = next(use for use in gentle.report.effect_activity if use.effect == "gravity")
    mass = gentle.model.body_mass.sum()
    assert use.events == use.of == 2
    assert use.share == pytest.approx(1.0, rel=1e-12)
    assert use.energy_J == pytest.approx(0.5 * mass * (9.81 * UNTIL) ** 2, rel=1e-9)


def test_missing_effect_is_told_how_often_and_where():
    """A hundred g pull nothing apart; a support that runs away does, past the strength."""
    mesh = pair()
    runs_away = effects.PrescribedMotion(next(iter(mesh.groups)), (-50.0, 0.0, 0.0))
    # In tension the limit of slip falls to nothing: with slip listed, only the strength is missed.
    result = ran(runs_away, effects.ShearSlip())
    missed = needed_effects(result).missing
    assert {finding.effect for finding in missed} == {"Softening"}
    (finding,) = missed
    middle = mesh.points[result.model.topology.vertices[0]].mean(axis=0)
    assert finding.where == 0
    assert finding.place_m == pytest.approx(tuple(middle), rel=1e-15)
    assert finding.most == 1
    # The start and four samples were looked at; nothing is stretched yet at the first.
    assert finding.looks == 5
    assert 1 <= finding.times <= 4
    written = json.loads(json.dumps(result.report.as_dict()))
    assert written["missed"][0]["times"] == finding.times
    assert written["needs"] == [str(finding)]
    assert f"seen at {finding.times} of 5 recordings" in str(needed_effects(result))


USES = (
    EffectUse("friction", "bodies rubbed", 5, 10, 1e-4, 1e-4),
    EffectUse("softening", "bonds softened", 5, 10, 1e-4, 1e-4, steers=True),
    EffectUse("rotation", "touches", 5),
    EffectUse("dashpot", "bonds damped", 5, 10, 1e-4, 1e-4, kept="it is your own"),
    EffectUse("fixed", "bodies held", 0, kept="it is part of the question"),
)


@pytest.mark.parametrize(("tolerance", "names"), [(1e-3, ("friction",)), (1e-4, ()), (0.0, ())])
def test_small_share_is_negligible_unless_the_effect_steers(tolerance, names):
    assert Advice(USES, (), tolerance).droppable == names


@pytest.mark.parametrize("bad", [-0.1, 1.5, float("nan"), "0.1"])
def test_tolerance_out_of_range_is_refused(gentle, bad):
    with pytest.raises(InputError, match=r"tolerance must lie in \[0, 1\]"):
        needed_effects(gentle, bad)


def test_contact_is_kept_where_parts_may_pass_through_each_other_between_recordings():
    """No recording saw them within each other; that they never touched tells nothing."""
    mesh = beside(pair(), pair(), [0.5, 0.0, 0.0])
    for outer_faces in (False, True):
        listed = [effects.SphereContact(outer_faces=outer_faces), effects.Friction()]
        found = used(listed, mesh=mesh)
        assert [found[name].idle for name in ("sphere_contact", "friction")] == [outer_faces] * 2
        assert all(
            ("may pass through each other" in use.kept) != use.idle for use in found.values()
        )


SHAKER = (
    *(effects.BondDamping, effects.Gravity, lambda: effects.PrescribedMotion("left", (1.0, 0, 0))),
    lambda: effects.Fixed("right"),
)


def test_support_that_drives_is_not_said_to_hold_without_work(hung):
    """One body is pushed at 1 m/s, the other held: work is done by one support alone."""
    lines = {
        line.split()[1]: line
        for line in str(needed_effects(ran(*(m() for m in SHAKER)))).splitlines()
    }
    assert "1 of 2 bodies driven, " in lines["prescribed_motion"]
    assert lines["prescribed_motion"].endswith("; a support is part of the question")
    assert "1 of 2 bodies held, " in lines["fixed"]
    for line in (lines["fixed"], str(needed_effects(hung))):
        assert "a support is part of the question, and holds without doing work" in line


@pytest.mark.parametrize(
    ("make", "work", "told"),
    [
        (effects.Fixed, 0.0, "held, and holds without doing work"),
        (effects.Fixed, -1.0, "held"),  # of bodies that were placed in motion
        (lambda group: effects.PrescribedMotion(group, (1.0, 0, 0)), 1.0, "driven"),
        (lambda group: effects.PrescribedMotion(group, (0, 0, 0)), 1e-17, "held, and holds"),
        (lambda group: effects.Roller(group, (1.0, 0, 0)), 1e-17, "held, and holds"),
    ],
)
def test_supports_hold_without_work_where_their_work_is_round_off(make, work, told):
    """Of 1 J that a load gave, 100 steps may round off 2e-14 J."""
    (use,) = used([make("left")], works=np.array([work, np.nan]), load_work=1.0).values()
    words = use.what.split()[1] + use.kept.replace("a support is part of the question", "")
    assert words.startswith(told) and ("without" in words) == ("holds" in told)


@pytest.mark.parametrize("listed", [(), (effects.Gravity,)])
@pytest.mark.parametrize("away", [0.0, 100.0])
def test_round_off_in_bonds_is_no_damping(listed, away):
    """A bar at rest, or in free fall, wherever it lies: its bonds shake by last digits only."""
    mesh = bar(0.5, 0.1, (5, 1, 1))
    mesh = checked_mesh(mesh.points + away, mesh.tetrahedra, {})
    scene = Scene(mesh, CONCRETE, (effects.BondDamping(), *(make() for make in listed)))
    advice = needed_effects(simulate(scene, method=Uniform(STEP), until=1e-4, samples=1), 0.0)
    use = advice.uses[0]
    assert use.energy_J > 0.0
    assert str(use) == f"never acted beyond round-off (0 bonds damped, {use.energy_J:.3g} J)"
    assert advice.droppable == ("bond_damping",) and advice.inactive == ()


def test_a_vibration_of_a_nanometre_is_damped_and_one_below_the_last_digits_is_not():
    """Energy of a bond that is opened by u: A k u^2 / 2. Own dashpots are kept all the same."""
    model = Model(pair(), CONCRETE, [])
    spring = 1.5 * model.bonds["area"][0] * model.bond_stiffness[0][0]
    (seen,) = used([effects.BondDamping()], heat=spring * 1e-9**2).values()
    assert seen.is_active and not seen.rounding
    for make, dropped in ((effects.BondDamping, True), (Own, False)):
        (hidden,) = used([make()], heat=spring * 1e-18**2, bond_dashpot=1e-30).values()
        assert hidden.rounding and not hidden.is_active and not hidden.idle
        assert hidden.negligible(0.0) == dropped


def test_what_is_no_result_is_refused():
    with pytest.raises(InputError, match="result must be a Result of simulate or its report"):
        needed_effects("blast")
