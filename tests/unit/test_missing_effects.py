"""A run says where effects that were left out would have acted, and says nothing else.

A run tells energy that no load gave: from 1 % injected by overlaps, from half unexplained.
Residual slip of bonds that hold: measured, reported, warned of.
Estimates before a run judge each connected part by its own stress, motion and weight.
"""

import math
from dataclasses import replace

import numpy as np
import pytest

from taichi_dem import (
    CONCRETE,
    Scene,
    Simulation,
    Uniform,
    checked_mesh,
    effects,
    estimated_effects,
    join,
    shapes,
)
from taichi_dem.kit.allocation import assign, values
from taichi_dem.kit.certificate import NEEDED, NEGLIGIBLE, UNCLEAR
from taichi_dem.mesh.shapes import bar, pair, single
from taichi_dem.report.energy_balance import TERMS, injected_words, open_account, unexplained_share
from taichi_dem.report.missing_effects import unserved
from taichi_dem.report.resolution import MOST_SLIP
from taichi_dem.state.model import Model
from tests.probe import BondProbe
from tests.scenes import beside

EDGE, STEP = 0.05, 1e-7
TWO = beside(single(EDGE), single(EDGE), [1.0, 0.0, 0.0])
LOSSLESS = replace(CONCRETE, normal_damping=0.0, shear_damping=0.0, friction=0.0)
BONDS = (effects.BondDamping(), effects.Softening(), effects.ShearSlip())
BROKEN_ONLY = effects.SphereContact(3, outer_faces=False)
EPS = np.finfo(float).eps
BLOCK = shapes.block(0.1, element=0.1)
HALVES = join(BLOCK, BLOCK.moved(by=(0.101, 0.0, 0.0)), names=["left", "right"])


@pytest.mark.parametrize(
    ("material", "listed", "needs"),
    [
        (CONCRETE, [], {"tension", "shear", "dashpot", "contact", "bodies"}),
        (LOSSLESS, [], {"tension", "shear", "contact", "bodies"}),
        (CONCRETE, [*BONDS, BROKEN_ONLY], {"friction"}),
        (LOSSLESS, [*BONDS, effects.SphereContact()], set()),
        (CONCRETE, [*BONDS, effects.SphereContact(), effects.Friction()], {"creep"}),
        (CONCRETE, [effects.Softening().silent(), *BONDS[::2]], {"tension", "contact", "bodies"}),
    ],
)
def test_an_effect_is_watched_for_only_where_none_serves_the_material(material, listed, needs):
    """And what to list is what a scene takes by default."""
    found, usual = unserved(Model(pair(), material, listed)), Scene(pair(), material, "all").effects
    assert set(found) == needs
    assert {need.effect for need in found.values()} <= {type(effect).__name__ for effect in usual}


def missed(mesh, moved, *listed, broken=False):
    """What a report warns of where bodies stand elsewhere; no step is compiled.

    moved: function of their centres (n, 3) [m].
    """
    simulation = Simulation(Scene(mesh, CONCRETE, listed), Uniform(STEP))
    if broken:
        assign(simulation.state.broken_tick, 0)
    simulation.state.set_motion(moved(simulation.model.centre))
    simulation._open_balance()
    if broken:
        simulation.missing_effects.sample(0.0)
    return simulation.report().needs


WITHIN = "pairs of bodies are within each other"
SHARED = "bodies 0 and 1 share"
RELEASED = "bodies overlap where a bond has been released"


@pytest.mark.parametrize("listed", [(), (BROKEN_ONLY,)])
@pytest.mark.parametrize(
    ("shift", "met"), [([2.0 * EDGE, 0, 0], 0), ([0, 1.001 * EDGE, 0], 0), ([0.1 * EDGE, 0, 0], 1)]
)
def test_bodies_within_each_other_are_found_and_nearness_is_not(listed, shift, met):
    said = missed(TWO, lambda centre: np.array([centre[0], centre[0] + shift]), *listed)
    assert len([what for what in said if WITHIN in what or SHARED in what]) == met


def test_a_solid_in_one_piece_overlaps_nothing_and_a_broken_one_does():
    """Pressed together by a tenth: bodies that a bond holds together are no two pieces."""
    whole = missed(bar(0.4, 0.1, (4, 1, 1)), lambda centre: 0.9 * centre)
    assert not [what for what in whole if WITHIN in what or RELEASED in what]
    for share in (0.9, 0.999):
        parted = missed(pair(EDGE), lambda centre, share=share: share * centre, broken=True)
        assert len([what for what in parted if WITHIN in what]) == (share == 0.9)
        assert len([what for what in parted if RELEASED in what]) == 1


def passed(probe):
    return [tick >= 0 for tick in values(probe.state.passed)[0]]


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
def test_limits_are_those_of_the_laws(pull, slide, expected):
    """Tension and slip are noted where Softening and ShearSlip would have acted, unit by unit.

    Strength and cohesion of concrete are one number; the limit in shear is c - 0.58 of the pull.
    """
    tractions = CONCRETE.tensile_strength * np.array([pull, slide, 0.0])
    probe = BondProbe(pair(EDGE), [])
    opening = tractions / probe.model.bond_stiffness[0][[0, 1, 1]]
    probe.open(opening)
    assert passed(probe) == expected
    acting = BondProbe(pair(EDGE), [effects.Softening(), effects.ShearSlip()])
    acting.open(opening)
    assert list(acting.simulation.readings.active_bonds()[0]) == expected


def pulled(mesh, speed, frequency=0.0):
    """A run of 1e-5 s of a solid whose left end is held while the right one moves [m/s, Hz]."""
    move = effects.PrescribedMotion("right", (speed, 0.0, 0.0), frequency)
    scene = Scene(mesh, CONCRETE, [effects.Fixed("left"), move])
    simulation = Simulation(scene, Uniform(STEP))
    simulation.advance_to(100)
    simulation.sample()
    return simulation


def test_a_limit_passed_between_two_samples_is_seen():
    """A bond is pulled past its strength and pushed back; at both samples it holds little.

    The pull lasts half a period of 1e-5 s; in between it opens by v / (pi f), five times its onset.
    """
    simulation = pulled(pair(EDGE), np.pi * 1e5 * 5.0 * CONCRETE.onset_opening, 1e5)
    found = {one.effect: one for one in simulation.report().missing_effects}["Softening"]
    assert found.count == 1 and 0.0 < found.first_s < 5e-6
    middle = pair(EDGE).points[simulation.model.topology.vertices[0]].mean(axis=0)
    assert found.place_m == pytest.approx(tuple(middle), rel=1e-15)
    assert simulation.missing_effects.strain[0] < 1e-2


@pytest.mark.parametrize(("speed", "missing"), [(0.0, ()), (0.1, ("BondDamping",))])
def test_damping_is_missed_only_where_bonds_strain_beyond_rounding(speed, missing):
    """At rest, wherever the solid lies; and pulled at one end."""
    away = bar(0.5, 0.1, (5, 1, 1))
    away = checked_mesh(away.points + 100.0, away.tetrahedra, away.groups)
    found = pulled(away, speed).report().missing_effects
    assert tuple(m.effect for m in found) == missing


@pytest.mark.parametrize(
    "terms",
    [
        {"load_work": 150.0, "support_work": -50.0, "friction": 100.0},
        # Bodies that had 200 J at the start and have half of it.
        {"friction": 100.0, "kinetic": 100.0},
        {"load_work": 120.0, "kinetic": 180.0, "residual": 20.0},
    ],
)
def test_the_share_is_of_work_and_of_the_energy_at_the_start(terms):
    def told(injected):
        account = {**dict.fromkeys(TERMS, 0.0), "injected": injected, **terms}
        return injected_words({**account, "kinetic": account["kinetic"] + injected})

    assert "2.01 J by overlaps" in told(2.01)
    assert told(1.99) == told(0.0) == ""


def test_an_open_account_is_said():
    account = {"kinetic": 1.0, "bond_dashpot": -3.0, "residual": 2.1}
    assert unexplained_share(account) == pytest.approx(2.1 / 4.0)
    assert "2.1 J unexplained" in open_account(account, 0.0)[0]
    assert open_account({**account, "residual": 1.9}, 0.0) == ()
    assert open_account({"kinetic": 1e-20, "residual": 1e-19}, 1e-20) == ()
    assert open_account({**account, "residual": math.nan}, 0.0)


def slid(share):
    """Simulation of the pair, sampled with a residual slip of a share of an edge in a unit."""
    simulation = Simulation(Scene(pair(EDGE), CONCRETE, [effects.ShearSlip()]), Uniform(1e-8))
    simulation.start()
    write_slip(simulation, share)
    simulation.sample()
    return simulation


def write_slip(simulation, share):
    """Let the second unit of the bond have slipped by a share of an edge, oblique to the axes."""
    field = simulation.state.fields()["shear_slip_slip"]
    slip = values(field)
    slip[1, :2] = share * EDGE * np.array([0.6, -0.8])
    assign(field, slip)


def test_share_is_that_of_the_shortest_edge():
    """To the rounding of a length over another."""
    report = slid(0.03).report()
    (found,) = report.bond_slip
    assert found.share == pytest.approx(0.03, abs=16 * EPS)
    assert found.where == 0 and found.count == 0


def test_far_slip_is_warned_of_and_an_effect_that_weakens_is_missed():
    report = slid(2.0 * MOST_SLIP).report()
    assert any("bond 0 " in need and "by 10 %" in need for need in report.needs)
    advice = report.advice()
    assert [one.effect for one in advice.missing] == ["SlipWeakening"]
    table = advice.table()
    assert table["effect"].tolist() == ["shear_slip", "SlipWeakening"]
    assert table["advice"].tolist() == ["keep", "list it"] and table["where"][1] == "bond 0"


def test_largest_of_all_recordings_is_kept():
    """Not that of the end: bonds that slipped far are often released later."""
    simulation = slid(0.1)
    write_slip(simulation, 0.02)
    simulation.sample()
    (found,) = simulation.report().bond_slip
    assert found.share == pytest.approx(0.1, abs=16 * EPS) and found.count == 1


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


#: A beam of 8 m that breaks by its own weight, a stub that does not, and what flies away from them.
BEAM, STUB = bar(8.0, 0.25, (16, 1, 1)), bar(0.5, 0.25, (2, 1, 1))
SHOT = bar(0.1, 0.1, (1, 1, 1)).moved(by=(0.0, 100.0, 0.0))
AWAY = {"shot": (0.0, 300.0, 0.0)}


@pytest.mark.parametrize(("held", "verdict"), [(BEAM, NEEDED), (STUB, NEGLIGIBLE)])
def test_weight_is_judged_by_what_it_breaks_also_beside_a_projectile(held, verdict):
    """One end is held; a body of 300 m/s falls by nothing beside its flight."""
    mesh = join(held, SHOT, names=["held", "shot"])
    scene = Scene(mesh, CONCRETE, "auto", loads=[effects.Fixed("held_left")], velocity=AWAY)
    found = {one.effect: one for one in estimated_effects(scene, 0.05)}["gravity"]
    assert found.verdict == verdict


def test_a_part_at_rest_that_falls_needs_weight_beside_a_projectile():
    """Nothing is known of what moves it: it may be hit; where it cannot be, weight is all."""
    mesh = join(STUB, SHOT, names=["free", "shot"])
    at_it = {"shot": (0.0, -300.0, 0.0)}
    for velocity, verdict in ((at_it, UNCLEAR), (AWAY, NEEDED), (None, NEEDED)):
        found = estimated_effects(Scene(mesh, CONCRETE, "auto", velocity=velocity), 0.05)
        assert {one.effect: one.verdict for one in found}["gravity"] == verdict


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
