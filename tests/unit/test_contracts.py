"""Contracts of effects and methods: what is missing is refused by its name before anything runs."""

from dataclasses import make_dataclass

import numpy as np
import pytest
import taichi as ti

from taichi_dem import (
    CONCRETE,
    ImplicitDashpots,
    InputError,
    Multirate,
    Scene,
    Simulation,
    Uniform,
    effects,
    needed_effects,
    simulate,
    step_report,
)
from taichi_dem.effects.base import ABSENT, Effect
from taichi_dem.effects.roles import CONTRACTS, members_of
from taichi_dem.mesh.shapes import bar, pair, single
from taichi_dem.methods import Method

MEMBERS = [(role, name) for role, contract in CONTRACTS.items() for name in members_of(contract)]
METHOD_MEMBERS = members_of(Method)


def own_effect(role, names):
    """An effect of a role that has these members only."""
    return type("Own", (Effect,), {"role": role, **dict.fromkeys(names, lambda self: None)})()


@pytest.mark.parametrize(("role", "name"), MEMBERS)
def test_an_effect_without_a_member_of_its_role_is_refused_by_the_name_of_it(role, name):
    others = [member for member in members_of(CONTRACTS[role]) if member != name]
    with pytest.raises(InputError, match=rf"effect Own must have a member {name}, as its role"):
        Scene(pair(), CONCRETE, [own_effect(role, others)])


@pytest.mark.parametrize("role", ["", "magic", None])
def test_an_effect_of_no_known_role_is_refused(role):
    with pytest.raises(InputError, match="role of effect Own must be one of tension, shear"):
        Scene(pair(), CONCRETE, [own_effect(role, [])])


def test_all_effects_and_null_objects_of_the_package_keep_their_contracts():
    shipped = [getattr(effects, name) for name in effects.__all__]
    for kind in (*shipped, *filter(None, ABSENT.values())):
        assert all(hasattr(kind, name) for name in members_of(CONTRACTS[kind.role])), kind


@pytest.mark.parametrize("name", METHOD_MEMBERS)
def test_a_method_without_a_member_is_refused_by_the_name_of_it(name):
    members = {member: getattr(Uniform(), member) for member in METHOD_MEMBERS if member != name}
    method = make_dataclass("Own", [], namespace=members)()
    with pytest.raises(InputError, match=rf"method Own must have a member {name}; methods have"):
        Simulation(Scene(pair(), CONCRETE, [effects.SphereContact()]), method)


@pytest.mark.parametrize("kind", [Uniform, Multirate, ImplicitDashpots])
def test_methods_of_the_package_keep_the_contract(kind):
    assert all(hasattr(kind(), name) for name in METHOD_MEMBERS)


@ti.data_oriented
class AirDrag(Effect):
    """Force against the velocity: -rate m v."""

    role = "load"
    name = "air_drag"

    def __init__(self, rate):
        self.rate = rate

    def numbers(self, material):
        """Damping rate [1/s]."""
        return (self.rate,)

    @ti.func
    def acts_on(self, i):
        """Every body."""
        return 1

    @ti.func
    def wrench(self, i, motion):
        """Against the velocity of the centre; none about it."""
        return -self.law[0] * self.tables.mass[i] * motion.velocity, 0.0 * motion.spin


@pytest.mark.parametrize("method", [Uniform(1e-4), ImplicitDashpots(1e-4)], ids=lambda m: m.name)
def test_air_drag_is_a_load_of_one_class(method):
    """v_n = v_0 (1 + rate dt / 2) (1 - rate dt)^n to round-off, half a step before the positions.

    The force is taken at the beginning of a step, and a run begins half a step back.
    """
    rate, steps, speed = 30.0, 50, np.array([2.0, -1.0, 0.5])
    simulation = Simulation(Scene(single(), CONCRETE, [AirDrag(rate)]), method)
    simulation.state.set_motion(simulation.model.centre, [[1.0, 0.0, 0.0, 0.0]], [speed])
    simulation.advance_to(steps)
    velocity = simulation.state.motion()["velocity"][0]
    expected = speed * (1.0 + 0.5 * rate * 1e-4) * (1.0 - rate * 1e-4) ** steps
    np.testing.assert_allclose(velocity, expected, rtol=4 * steps * np.finfo(float).eps)
    account = simulation.energy_balance.account()
    assert abs(account["residual"]) < 1e-12 * simulation.energy_balance.start_energy


def renamed(effect):
    """The same law under another name, a class of the user's own."""
    return type("Own", (type(effect),), {"name": "own"})(*vars(effect).get("arguments", ()))


class LooseSoil(effects.BondDamping):
    """A law with a name of its own."""

    name = "loose_soil"


class OwnSlip(effects.ShearSlip):
    """A law with the name of the one that it is derived from."""


@ti.data_oriented
class SideWind(AirDrag):
    """A load whose class says nothing of a name."""

    name = ""


def test_effects_by_any_name_or_none_stay_in_reports_and_advice():
    listed = [LooseSoil(), OwnSlip(), SideWind(30.0)]
    assert [effect.name for effect in listed] == ["loose_soil", "shear_slip", "side_wind"]
    scene = Scene(pair(), CONCRETE, listed)
    result = simulate(scene, method=Uniform(1e-8), until=1e-7, progress=None)
    assert set(result.report.effects) == {"loose_soil", "shear_slip", "side_wind"}
    uses = {use.effect: use for use in result.report.effect_activity}
    assert set(uses) == set(result.report.effects)
    # The advice knows too little of what a law of one's own does.
    assert all(uses[name].kept for name in uses)
    assert not any(name in str(needed_effects(result).droppable) for name in uses)


def test_heat_of_a_dashpot_without_a_name_is_in_the_account():
    """What a class says of its name changes no number."""

    class NoName(effects.BondDamping):
        name = ""

    found = []
    for kind in (effects.BondDamping, NoName):
        simulation = Simulation(Scene(pair(), CONCRETE, [kind()]), Uniform(1e-7))
        turn, speed = [[1.0, 0.0, 0.0, 0.0]], [[0.1, 0.0, 0.0], [-0.1, 0.0, 0.0]]
        simulation.state.set_motion(simulation.model.centre, turn, speed)
        simulation.advance_to(20)
        found.append(simulation.energy_balance.account())
    assert found[0] == found[1] and found[0]["bond_dashpot"] > 0.0


def test_laws_by_other_names_lose_no_criterion_of_the_step_report():
    listed = [effects.BondDamping(), effects.SphereContact(), effects.Friction()]
    mesh = bar(0.2, 0.1, (2, 1, 1))
    known = step_report(Scene(mesh, CONCRETE, listed))
    own = step_report(Scene(mesh, CONCRETE, [renamed(effect) for effect in listed]))
    assert list(own.limits) == list(known.limits) and len(own.limits) == 5
    assert all(np.array_equal(own.limits[name], known.limits[name]) for name in known.limits)
