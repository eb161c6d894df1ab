"""effects="auto" finds what is needed once, late, in one place, and nothing where it is not."""

from functools import cache

import numpy as np
import pytest

from taichi_dem import Scene, checked_mesh
from taichi_dem.state.timeline import NEVER
from tests.activation.late_scenes import (
    SCENES,
    STEP,
    Late,
    late_scene,
    loads,
    rod,
    scene_of,
    simulation,
    strengths,
)

#: Role of an effect by its name.
NAMES = {
    "tension": "softening",
    "shear": "shear_slip",
    "dashpot": "bond_damping",
    "contact": "body_contact",
    "friction": "sticking_friction",
}
#: What must have the same bits.
BITS = (
    "position velocity orientation angular_momentum broken_tick bond_drag bond_heat contact_heat "
    "load_work load_impulse softening_unit shear_slip_slip"
).split()


class Run:
    """What is left of a run of a scene or its twin, whose engine goes on to others.

    before: what acted before the effect may. since: of each bond and part of its law; evaluated: of
    each bond.
    """

    def __init__(self, name, word, needed=True, **options):
        self.late = late_scene(name) if needed else late_scene(name).without()
        self.scene = scene_of(late_scene(name), word, needed, **options)
        made = simulation(self.late, self.scene)
        made.advance_to(int(self.late.late / STEP))
        self.before = acting(made)
        made.advance_to(round(self.late.until / STEP))
        self.fields = {key: made.values(field) for key, field in made.state.fields().items()}
        self.acting, self.report = acting(made), made.report(brief=True)
        self.moved = self.fields["position"] - made.model.centre
        self.start_energy, self.evaluations = made.energy_balance.start_energy, made.evaluations()
        if word == "auto":
            activity = made.state.activity
            self.since, self.evaluated = map(made.values, (activity.since, activity.evaluated))

    @property
    def way(self):
        """Largest displacement [m]."""
        return np.abs(self.moved).max()


def acting(simulation):
    """Events of the effects that act, by name; friction by what it took.

    Two faces that are pressed on each other slide by roundings, and rub so much.
    """
    report = simulation.report(brief=True)
    pressed = report.energy_balance["sphere_dashpot"] + report.energy_balance["kinetic"]
    found = {}
    for use in report.effect_activity:
        rounding = use.effect == NAMES["friction"] and use.energy_J <= 1e-9 * pressed
        if use.is_active and not rounding:
            found[use.effect] = use.events
    return found


@cache
def run(name, word="auto", needed=True, **options):
    """A run, made once."""
    return Run(name, word, needed, **options)


#: Largest difference that sleep may make, as a share of the largest displacement.
MOST = 1e-3
EPSILON = np.finfo(float).eps
LIMITS = [name for name in SCENES if late_scene(name).is_limit]


def check_bits(auto, every):
    """On demand and without sleep all is as with all effects."""
    assert [key for key in BITS if not np.array_equal(auto.fields[key], every.fields[key])] == []
    assert auto.acting == every.acting
    assert auto.report.energy_balance == every.report.energy_balance


@pytest.mark.parametrize("name", SCENES)
def test_without_sleep_all_bits_are_those_of_all_effects(name):
    check_bits(run(name, sleep=0.0), run(name, "all"))


@pytest.mark.parametrize("name", SCENES)
def test_the_effect_acts_late_and_is_found(name):
    auto, role = run(name, sleep=0.0), late_scene(name).role
    assert NAMES[role] in auto.acting
    assert NAMES[role] not in auto.before


@pytest.mark.parametrize("name", LIMITS)
def test_one_bond_alone_reaches_the_limit(name):
    """It is evaluated from then on, and no other."""
    auto, law = run(name, sleep=0.0), int(late_scene(name).role == "shear")
    since, evaluated = auto.since, auto.evaluated
    assert auto.acting[NAMES[late_scene(name).role]] == 1
    assert (since != NEVER).sum(axis=0).tolist() == [1 - law, law]
    assert (evaluated[(since == NEVER).all(axis=1)] == 0).all()
    assert 0 < evaluated.sum() < auto.evaluations


@pytest.mark.parametrize("name", SCENES)
def test_sleep_leaves_the_motion_and_what_acts_as_they_are(name):
    auto, every = run(name), run(name, "all")
    apart = np.abs(auto.fields["position"] - every.fields["position"]).max()
    assert apart <= MOST * every.way
    assert set(auto.acting) == set(every.acting)
    role = NAMES[late_scene(name).role]
    assert auto.acting[role] == every.acting[role]
    assert np.array_equal(auto.fields["broken_tick"], every.fields["broken_tick"])


@pytest.mark.parametrize("name", SCENES)
def test_where_it_is_not_needed_it_never_acts(name):
    twin, role = run(name, needed=False), late_scene(name).role
    assert NAMES[role] not in twin.acting
    if late_scene(name).is_limit:
        assert (twin.since[:, int(role == "shear")] == NEVER).all()
    if role == "contact":
        assert NAMES["friction"] not in twin.acting


@pytest.mark.parametrize("name", SCENES)
def test_sleep_changes_momentum_and_residual_by_no_more_than_it_says(name):
    """Momentum by a rounding of every substep; the residual by what the certificate tells.

    And by the change of the motion, in which all terms of the account are of second order.
    The change is a share of the displacements against each other, which strain the bonds.
    """
    auto, awake = run(name), run(name, sleep=0.0)
    assert auto.report.linear_momentum_error <= auto.report.substeps * EPSILON
    account = auto.report.energy_balance
    given = abs(account["load_work"]) + abs(account["support_work"])
    given += auto.start_energy
    apart = np.abs(auto.fields["position"] - awake.fields["position"]).max()
    apart /= np.abs(awake.moved - awake.moved.mean(axis=0)).max()
    share = auto.report.certificate.energy + 2.0 * apart + auto.report.substeps * EPSILON
    found = account["residual"] - awake.report.energy_balance["residual"]
    assert abs(found) <= share * given


@pytest.mark.parametrize("name", SCENES)
def test_less_is_left_out_than_was_allowed(name):
    certificate = run(name).report.certificate
    assert certificate.impulse <= certificate.sleep == 1e-6
    assert certificate.energy <= certificate.sleep
    assert certificate.holds


def test_far_from_the_origin_bodies_at_rest_sleep():
    """The rounding of coordinates of 10 km opens no bond by more than is expected of it."""
    mesh = rod(np.random.default_rng(3), 20)
    far = checked_mesh(mesh.points + np.array([1e4, -1e4, 1e4]), mesh.tetrahedra, {})
    late = Late("tension", far, loads(), 0.0)
    made = simulation(late, Scene(far, strengths(), "auto", loads=late.loads))
    made.advance_to(2)
    assert (made.values(made.schedule.sleeping.awake) == 0).sum() == 120
