"""Estimates before a run judge each connected part by its own stress, motion and weight."""

from dataclasses import replace

import numpy as np
import pytest

from taichi_dem import CONCRETE, Scene, effects, estimated_effects, join, shapes
from taichi_dem.kit.certificate import NEEDED, NEGLIGIBLE, UNCLEAR
from taichi_dem.mesh.shapes import bar
from taichi_dem.state.model import Model

BLOCK = shapes.block(0.1, element=0.1)
TWO = join(BLOCK, BLOCK.moved(by=(0.101, 0.0, 0.0)), names=["left", "right"])


def groups(mesh=TWO, **motion):
    found = estimated_effects(Scene(mesh, CONCRETE, "auto", **motion), 1e-3)
    return {one.effect: one.group for one in found}, {one.effect: one.verdict for one in found}


def test_a_blow_has_the_stress_of_its_wave():
    """Two equal blocks that meet at v: the wave in each carries v / 2."""
    speed = 2.0
    found, verdicts = groups(velocity={"left": (speed, 0.0, 0.0)})
    model = Model(TWO, CONCRETE, ())
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
