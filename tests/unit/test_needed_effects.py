"""What a run says of its effects: which acted, which it could do without, which it missed."""

import json
from types import SimpleNamespace

import numpy as np
import pytest

from taichi_dem import (
    CONCRETE,
    InputError,
    Scene,
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
from taichi_dem.physics.sphere_pair import CONTACT, RUBBED

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


def column(values):
    """A field of these values, to be read."""
    return SimpleNamespace(to_numpy=lambda: np.asarray(values))


def used(listed, bits=0, marked=0, heat=0.0, mesh=None, works=None, **account):
    """What is said of effects whose account holds these terms [J]; every effect by its name.

    bits: of ``State.active_effects``, of the first body. marked: bonds softened and slipped.
    heat: in each bond [J]. works: of the supports, by body [J].
    """
    model = Model(mesh or pair(), CONCRETE, listed)
    active = np.zeros(model.body_count, dtype=np.int64)
    active[0] = bits
    state = SimpleNamespace(active_effects=column(active), position=column(model.centre))
    tables = np.zeros((model.body_count, 6)), np.full((model.bond_count, 5), heat), None
    balance = SimpleNamespace(state=state, start_energy=0.0)
    balance.support_works = lambda index: works
    balance.load_works = lambda index: np.zeros(model.body_count)
    marks = np.zeros((model.bond_count, 2), dtype=bool)
    marks[: min(1, marked)] = True
    readings = SimpleNamespace(active_bonds=lambda: marks)
    filled = {**dict.fromkeys(TERMS, 0.0), **account}
    return {u.effect: u for u in effect_activity(model, balance, readings, tables, filled, 100)}


class OwnContact(effects.SphereContact):
    """A law of a user's own."""


class OwnFriction(effects.Friction):
    """A law of a user's own."""


@pytest.mark.parametrize("contact", [effects.SphereContact, OwnContact])
@pytest.mark.parametrize(
    "friction", [effects.Friction, effects.StickingFriction, OwnFriction], ids=lambda f: f.__name__
)
@pytest.mark.parametrize(
    ("bits", "touched", "rubbed"),
    [(0, 0, 0), (CONTACT, 1, 0), (CONTACT | RUBBED, 1, 1)],
)
def test_contact_and_friction_are_idle_only_where_the_step_noted_neither(
    contact, friction, bits, touched, rubbed
):
    """Whether by the package's law or one's own, with heat or without: the step sees every push."""
    found = used([contact(), friction()], bits)
    assert [found[name].events for name in (contact.name, friction.name)] == [touched, rubbed]
    assert [found[name].idle for name in (contact.name, friction.name)] == [
        *(not touched, not rubbed)
    ]


@pytest.mark.parametrize("place", range(3))
def test_every_load_and_support_has_a_bit_of_its_own(place):
    """Loads first, in the order of the list, then supports."""
    listed = [effects.Gravity(), effects.GasPressure("left"), effects.Fixed("right")]
    found = used(listed, 1 << place, works=np.zeros(2))
    assert [use.events for use in found.values()] == [int(k == place) for k in range(3)]


STEERING = (effects.Softening, effects.ShearSlip, effects.SphereContact, effects.Friction)


@pytest.mark.parametrize("make", STEERING)
def test_what_steers_is_never_negligible(make):
    """It acted, and took a thousandth of a thousandth of the work put in."""
    listed = [make()] if make is not effects.Friction else [effects.SphereContact(), make()]
    bits = CONTACT | RUBBED
    use = used(listed, bits, marked=1, load_work=1.0, slip=1e-9, softening=1e-9)[make.name]
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

    Kicks in the middle of a step of dt give v = g t at its end; with the mean velocity of each
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
    result = ran(runs_away, effects.ShearSlip(), effects.BondDamping())
    missed = needed_effects(result).missing
    assert {finding.effect for finding in missed} == {"Softening"}
    (finding,) = missed
    middle = mesh.points[result.model.topology.vertices[0]].mean(axis=0)
    assert finding.where == 0
    assert finding.place_m == pytest.approx(tuple(middle), rel=1e-15)
    assert finding.count == 1
    # Opened at 50 m/s, the bond is past its strength within ticks: the body turns a little.
    onset = CONCRETE.onset_opening / 50.0
    assert STEP < finding.first_s <= 1.5 * onset + STEP
    written = json.loads(json.dumps(result.report.as_dict()))
    assert written["missed"][0]["count"] == 1
    assert written["needs"] == [str(finding)]
    assert str(finding) in str(needed_effects(result))


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
    assert "a run without it is the same but for rounding" in str(advice)
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
