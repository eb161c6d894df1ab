"""Maps of a driven damper, and the theory of a block that collects and collides."""

import math

import numpy as np
import pytest

from ca_damper import (
    RigidMass,
    Spheres,
    collect_and_collide,
    damper_map,
)

FEW = {"frequencies": 6.0, "transient_cycles": 1, "measured_cycles": 2, "seeds": 1}


def block(ratio, count=200_000):
    """Energy, loss and mass of a block by its motion in small steps; ratio: gap / A, A = w = 1."""
    angle = (np.arange(count) + 0.5) * np.pi / count
    meets = angle - np.sin(angle) > ratio
    speed = np.where(meets, np.cos(angle), 1.0)
    phase = angle[meets][0] if meets.any() else np.pi
    energy = 2 * 0.5 * (1.0 - math.cos(phase)) ** 2
    return energy, 2 * (speed * np.sin(angle)).mean(), 2 * (speed * np.cos(angle)).mean()


@pytest.mark.parametrize("ratio", [0.2, 1.0, 3.1])
def test_theory_is_the_motion_of_a_block(ratio):
    made = collect_and_collide(1.0, ratio)
    wanted = block(ratio)
    found = float(made.energy), float(made.loss), float(made.mass)
    assert found == pytest.approx(wanted, abs=1e-4)
    assert made.phase - np.sin(made.phase) == pytest.approx(ratio, rel=1e-12)


def test_spheres_without_gravity_jump_where_theory_does():
    """40 grains over a gap of 72 mm: the jump within 10 % of A, the plateau within 15 %."""
    gap = 72e-3
    made = damper_map(
        *(Spheres(gravity=0.0),),
        amplitudes=[0.9 * gap / np.pi, 1.1 * gap / np.pi, 1.3 * gap / np.pi],
        **{**FEW, "transient_cycles": 20, "measured_cycles": 20},
        particles=40,
    )
    energy, theory = made.energy[0, 0, :, 0, 0], made.theory.energy[0, 0]
    assert made.gaps[0, 0] == pytest.approx(gap) and energy[0] < 1.0
    assert energy[1:] == pytest.approx(theory[1:], rel=0.15)


def test_a_rigid_mass_is_mass_and_no_loss_on_all_axes():
    made = damper_map(
        RigidMass(), amplitudes=[1e-3, 2e-3], particles=[5, 10, 20], **{**FEW, "frequencies": 7.0}
    )
    assert made.loss.shape == (1, 3, 2, 1, 1)
    assert made.mass_share == pytest.approx(1.0, rel=1e-6)
    assert made.loss == pytest.approx(0.0, abs=1e-6)
    assert np.isnan(made.gaps).all()
