"""Maps of a driven damper, and the theory of a block that collects and collides."""

import csv
import math

import numpy as np
import pytest

from ca_damper import (
    Automaton,
    InputError,
    Oscillator,
    RigidMass,
    Spheres,
    collect_and_collide,
    damper_map,
    frequency_response,
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


@pytest.mark.parametrize("ratio", [0.2, 1.0, 2.4, 3.1])
def test_theory_is_the_motion_of_a_block(ratio):
    made = collect_and_collide(1.0, ratio)
    wanted = block(ratio)
    found = float(made.energy), float(made.loss), float(made.mass)
    assert found == pytest.approx(wanted, abs=1e-4)
    assert made.phase - np.sin(made.phase) == pytest.approx(ratio, rel=1e-12)


def test_theory_jumps_to_four_where_the_amplitude_is_the_gap_by_pi():
    made = collect_and_collide([0.999, 1.0, 1.001], np.pi)
    assert np.isnan(made.energy[0]) and np.isnan(made.mass[0])
    assert made.energy[1] == pytest.approx(4.0) and 3.99 < made.energy[2] < 4.0


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


def test_a_rigid_mass_is_mass_and_no_loss_on_all_axes(tmp_path):
    made = damper_map(
        RigidMass(), amplitudes=[1e-3, 2e-3], particles=[5, 10, 20], **{**FEW, "frequencies": 7.0}
    )
    assert made.loss.shape == (1, 3, 2, 1, 1)
    assert made.mass_share == pytest.approx(1.0, rel=1e-6)
    assert made.loss == pytest.approx(0.0, abs=1e-6)
    assert made.loss_factor(0.1) == pytest.approx(0.0, abs=1e-6)
    assert np.isnan(made.gaps).all()


def test_clearances_make_the_box(tmp_path):
    for filling in (Spheres(), Automaton()):
        made = damper_map(
            filling, amplitudes=1e-3, particles=[10, 30], clearances=[12e-3, 24e-3], **FEW
        )
        assert made.gaps == pytest.approx(np.array([[12e-3] * 2, [24e-3] * 2]))
        assert made.loss.shape == (2, 2, 1, 1, 1)
        made.write_csv(tmp_path / "map.csv")
        with open(tmp_path / "map.csv", newline="") as handle:
            rows = list(csv.DictReader(handle))
        assert [float(row["clearance_m"]) for row in rows] == pytest.approx(made.gaps.ravel())
        assert float(rows[3]["loss"]) == made.loss[1, 1, 0, 0, 0]


REFUSED = [
    (Spheres(), {"amplitudes": 0.0}, "amplitudes must"),
    (Spheres(), {"particles": 0}, "particles must"),
    (RigidMass(), {"clearances": 1e-2}, "clearances must be None"),
    (Automaton(), {"clearances": 1e-2}, "whole cells of 0.006 m, got 0.01"),
    (Spheres(), {"clearances": -1.0}, "clearances must"),
]


@pytest.mark.parametrize(("filling", "changes", "words"), REFUSED)
def test_maps_that_mean_nothing_are_refused(filling, changes, words):
    with pytest.raises(InputError, match=words):
        damper_map(filling, **{"amplitudes": 1e-3, "particles": 10, **FEW, **changes})


def test_theory_refuses_what_is_no_length():
    with pytest.raises(InputError, match="gap must be positive"):
        collect_and_collide(1.0, -1.0)


def test_a_structure_of_300_hz_chooses_its_own_step():
    stiff = Oscillator(mass=0.1, stiffness=0.1 * (2 * np.pi * 300.0) ** 2, damping=2.0)
    made = frequency_response(
        *(RigidMass(),),
        particles=10,
        ratios=[0.9, 1.0],
        seeds=1,
        oscillator=stiff,
        transient_cycles=0,
        measured_cycles=2,
        start="rigid",
    )
    assert (made.steps_per_cycle >= 40).all()
    wanted = stiff.rms(made.ratios * 300.0, 2e-3)
    assert made.rms[0, :, 0] == pytest.approx(wanted, rel=1e-6)
