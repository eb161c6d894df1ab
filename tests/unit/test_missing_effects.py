"""A run says where effects that were left out would have acted, and says nothing else.

A run tells energy that no load gave: from 1 % injected by overlaps, from half unexplained.
Residual slip of bonds that hold: measured, reported, warned of.
Estimates before a run judge each connected part by its own stress, motion and weight.
"""

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
    join,
    shapes,
)
from taichi_dem.kit.allocation import values
from taichi_dem.kit.certificate import NEEDED
from taichi_dem.mesh.shapes import bar, pair
from taichi_dem.state.model import Model
from tests.probe import BondProbe

EDGE, STEP = 0.05, 1e-7
BLOCK = shapes.block(0.1, element=0.1)
HALVES = join(BLOCK, BLOCK.moved(by=(0.101, 0.0, 0.0)), names=["left", "right"])


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
