"""A run says where effects that were left out would have acted, and says nothing else."""

from dataclasses import replace

import numpy as np
import pytest

from taichi_dem import CONCRETE, Scene, Simulation, Uniform, checked_mesh, effects
from taichi_dem.kit.allocation import assign, values
from taichi_dem.mesh.shapes import bar, pair, single
from taichi_dem.report.missing_effects import unserved
from taichi_dem.state.model import Model
from tests.probe import BondProbe
from tests.scenes import beside

EDGE, STEP = 0.05, 1e-7
TWO = beside(single(EDGE), single(EDGE), [1.0, 0.0, 0.0])
LOSSLESS = replace(CONCRETE, normal_damping=0.0, shear_damping=0.0, friction=0.0)
BONDS = (effects.BondDamping(), effects.Softening(), effects.ShearSlip())
BROKEN_ONLY = effects.SphereContact(3, outer_faces=False)


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
