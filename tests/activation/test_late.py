"""effects="auto" finds what is needed once, late, in one place, and nothing where it is not."""

import numpy as np
import pytest

from taichi_dem.timeline import NEVER
from tests.activation.late_runs import BITS, NAMES, run
from tests.activation.late_scenes import SCENES, late_scene

#: Largest difference that sleep may make, as a share of the largest displacement.
MOST = 1e-3
EPSILON = np.finfo(float).eps
LIMITS = [name for name in SCENES if late_scene(name).is_limit]


def test_there_are_forty_scenes():
    assert len(SCENES) >= 40
    assert {late_scene(name).role for name in SCENES} == set(NAMES)


@pytest.mark.parametrize("name", SCENES)
def test_without_sleep_all_bits_are_those_of_all_effects(name):
    auto, every = run(name, sleep=0.0), run(name, "all")
    assert [key for key in BITS if not np.array_equal(auto.fields[key], every.fields[key])] == []
    assert auto.acting == every.acting
    assert auto.report.energy_balance == every.report.energy_balance


@pytest.mark.parametrize("name", SCENES)
def test_the_effect_acts_late_and_is_found(name):
    auto, role = run(name, sleep=0.0), late_scene(name).role
    assert NAMES[role] in auto.acting
    assert auto.before is None or NAMES[role] not in auto.before


@pytest.mark.parametrize("name", LIMITS)
def test_one_bond_alone_reaches_the_limit(name):
    """It is evaluated from then on, and no other."""
    auto, law = run(name, sleep=0.0), int(late_scene(name).role == "shear")
    since = auto.simulation.state.activity.since.to_numpy()
    evaluated = auto.simulation.state.activity.evaluated.to_numpy()
    assert auto.acting[NAMES[late_scene(name).role]] == 1
    assert (since != NEVER).sum(axis=0).tolist() == [1 - law, law]
    assert (evaluated[since == NEVER] == 0).all()
    assert 0 < evaluated[:, law].sum() < auto.simulation.evaluations()


@pytest.mark.parametrize("name", SCENES)
def test_sleep_leaves_the_motion_and_what_acts_as_they_are(name):
    auto, every = run(name), run(name, "all")
    apart = np.abs(auto.fields["position"] - every.fields["position"]).max()
    assert apart <= MOST * every.way
    assert set(auto.acting) == set(every.acting)
    role = NAMES[late_scene(name).role]
    assert auto.acting[role] == every.acting[role]
    assert np.array_equal(auto.fields["broken_tick"], every.fields["broken_tick"])


@pytest.mark.parametrize("options", [{"sleep": 0.0}, {}], ids=["awake", "sleep"])
@pytest.mark.parametrize("name", SCENES)
def test_where_it_is_not_needed_it_never_acts(name, options):
    twin, role = run(name, needed=False, **options), late_scene(name).role
    assert NAMES[role] not in twin.acting
    activity = twin.simulation.state.activity
    since, evaluated = activity.since.to_numpy(), activity.evaluated.to_numpy()
    if late_scene(name).is_limit:
        law = int(role == "shear")
        assert (since[:, law] == NEVER).all() and not evaluated[:, law].any()
    if role == "contact":
        assert "friction" not in twin.acting


@pytest.mark.parametrize("name", SCENES)
def test_sleep_keeps_momentum_exactly(name):
    """To a rounding of every substep."""
    report = run(name).report
    assert report.linear_momentum_error <= report.substeps * EPSILON


@pytest.mark.parametrize("name", SCENES)
def test_sleep_changes_the_residual_by_no_more_than_it_says(name):
    """And by the change of the motion, in which all terms of the account are of second order.

    The change is a share of the displacements against each other, which strain the bonds.
    """
    auto, awake = run(name), run(name, sleep=0.0)
    account = auto.report.energy_balance
    given = abs(account["load_work"]) + abs(account["support_work"])
    given += auto.simulation.energy_balance.start_energy
    moved = awake.fields["position"] - awake.simulation.model.centre
    apart = np.abs(auto.fields["position"] - awake.fields["position"]).max()
    apart /= np.abs(moved - moved.mean(axis=0)).max()
    share = auto.report.certificate.energy + 2.0 * apart + auto.report.substeps * EPSILON
    found = account["residual"] - awake.report.energy_balance["residual"]
    assert abs(found) <= share * given


@pytest.mark.parametrize("name", SCENES)
def test_less_is_left_out_than_was_allowed(name):
    certificate = run(name).report.certificate
    assert certificate.impulse <= certificate.sleep == 1e-6
    assert certificate.energy <= certificate.sleep
    assert certificate.holds


@pytest.mark.parametrize("name", SCENES)
def test_the_audit_finds_nothing_where_nothing_is_missed(name):
    for options in ({}, {"sleep": 0.0}):
        audit = run(name, **options).simulation.step.audit
        assert audit.misses.to_numpy().tolist() == [0, 0, 0]
