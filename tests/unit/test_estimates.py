"""Estimates before a run count the motion at the start: stress density c v, and parts that meet."""

import numpy as np
import pytest

from taichi_dem import CONCRETE, Scene, estimated_effects, join, shapes
from taichi_dem.diagnostics.estimates import NEEDED, NEGLIGIBLE
from taichi_dem.engine.model import Model

BLOCK = shapes.block(0.1, element=0.1)
TWO = join(BLOCK, BLOCK.moved(by=(0.101, 0.0, 0.0)), names=["left", "right"])


def groups(mesh=TWO, **motion):
    found = estimated_effects(Scene(mesh, CONCRETE, "auto", **motion), 1e-3)
    return {one.effect: one.group for one in found}, {one.effect: one.verdict for one in found}


@pytest.mark.parametrize("speed", [0.01, 2.0])
def test_a_blow_has_the_stress_of_its_wave(speed):
    """Two equal blocks that meet at v: the wave in each carries v / 2."""
    found, verdicts = groups(velocity={"left": (speed, 0.0, 0.0)})
    model = Model(TWO, CONCRETE, ())
    wave = np.sqrt(CONCRETE.normal_stiffness * 2.0 * model.body_radius.mean() / CONCRETE.density)
    stress = CONCRETE.density * wave * 0.5 * speed
    assert found["softening"] == pytest.approx(stress / CONCRETE.tensile_strength, 1e-9)
    assert verdicts["contact"] == NEEDED


def test_the_same_motion_of_all_needs_nothing():
    for motion in ({"velocity": (3.0, 0.0, 0.0)}, {}):
        _, verdicts = groups(**motion)
        assert all(verdicts[name] == NEGLIGIBLE for name in ("softening", "slip", "contact"))


def test_a_solid_that_turns_has_the_stress_of_its_rim():
    rate = 100.0
    found, _ = groups(BLOCK, spin=(0.0, 0.0, rate))
    centre = BLOCK.points[BLOCK.tetrahedra].mean(axis=1) - 0.05
    rim = rate * np.sqrt((centre[:, :2] ** 2).sum(axis=1).max())
    stress = CONCRETE.density * rim**2
    assert found["softening"] == pytest.approx(stress / CONCRETE.tensile_strength, 1e-6)
