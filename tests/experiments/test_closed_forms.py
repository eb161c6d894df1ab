"""Exact solutions, by what they must satisfy and by solutions of other kinds."""

import math

import numpy as np
import pytest

from _closed_forms import bond_shear, bond_tension
from taichi_dem import CONCRETE
from taichi_dem.mesh.shapes import bar, pair, single
from taichi_dem.mesh.topology import body_properties
from tests.closed_forms import LinearBonds, damped_opening, velocity_after_impact

X = np.array([1.0, 0.0, 0.0])


@pytest.mark.parametrize("damping", [7.0, 1.0])
def test_damped_opening_obeys_its_equation(damping):
    """Beyond and below critical damping, 4.9."""
    mass, stiffness = 2.0, 3.0
    time, step = np.linspace(0.0, 4.0, 5), 1e-4

    def u(at):
        return damped_opening(mass, stiffness, damping, 0.5, -0.3, at)

    slope = (u(time + step) - u(time - step)) / (2.0 * step)
    bend = (u(time + step) - 2.0 * u(time) + u(time - step)) / step**2
    assert u(0.0) == pytest.approx(0.5, rel=1e-15)
    assert slope[0] == pytest.approx(-0.3, rel=1e-6)
    # Differences over a step of 1e-4 miss by its square, and round by 1e-16 / 1e-8.
    assert mass * bend + damping * slope + stiffness * u(time) == pytest.approx(0.0, abs=1e-6)


def test_impact_through_the_centres_makes_one_velocity():
    arms = 0.01 * X, -0.02 * X
    after = velocity_after_impact((single(), single()), CONCRETE, arms, X, 4.0 * X)
    assert after == pytest.approx(2.0 * X, rel=1e-12)


def test_rigid_motion_strains_no_bond():
    mesh = bar(0.2, 0.1, (2, 1, 1))
    bonds, (_, centre, _) = LinearBonds(mesh, CONCRETE), body_properties(mesh, 1.0)
    turn, shift = np.array([1e-3, -2e-3, 3e-3]), np.array([1.0, 2.0, 3.0])
    moved = np.hstack([shift + np.cross(turn, centre), np.tile(turn, (len(centre), 1))]).ravel()
    for matrix in (bonds.stiffness, bonds.damping):
        assert matrix == pytest.approx(matrix.T, abs=1e-6 * matrix.max())
        # Rounding of sums of terms as large as the matrix.
        assert matrix @ moved == pytest.approx(0.0, abs=1e-13 * matrix.max())


def test_pair_that_hangs_on_its_bond():
    bonds = LinearBonds(pair(), CONCRETE)
    moved = bonds.static_displacement((9.81, 0.0, 0.0), np.array([True, False]))
    area, mass = math.sqrt(3.0) / 4.0 * 0.05**2, bonds.mass[6, 6]
    sag = mass * 9.81 / (area * CONCRETE.normal_stiffness)
    assert moved[0] == pytest.approx(0.0, abs=0.0)
    assert moved[1] == pytest.approx(sag * X, rel=1e-9, abs=1e-9 * sag)


def test_state_matrix_is_that_of_the_damped_opening():
    bonds, area = LinearBonds(pair(), CONCRETE), math.sqrt(3.0) / 4.0 * 0.05**2
    values = np.linalg.eigvals(bonds.state_matrix())
    laws = area * CONCRETE.normal_stiffness, area * CONCRETE.normal_damping
    mass = 0.5 * bonds.mass[0, 0]
    slow = damped_opening(mass, *laws, 1.0, 0.0, 1e-3) / damped_opening(mass, *laws, 1.0, 0.0, 0.0)
    wanted = math.log(slow) / 1e-3
    # The opening's slow root; the fast one adds its part at the start, 1e-4 of the whole.
    assert abs(values.real / wanted - 1.0).min() < 1e-3


def test_a_pulled_bond_softens_unloads_to_the_origin_and_is_gone_once_failed():
    """Strength at the onset, half of it half-way, a secant back, full stiffness when pressed."""
    onset, failure = CONCRETE.onset_opening, CONCRETE.failure_opening
    middle, strength = 0.5 * (onset + failure), CONCRETE.tensile_strength
    way = np.array([0.5 * onset, onset, middle, 0.5 * middle, -onset, middle, failure, -onset])
    expected = np.array([0.5, 1.0, 0.5, 0.25, -1.0, 0.5, 0.0, 0.0]) * strength
    assert bond_tension(CONCRETE, way) == pytest.approx(expected, abs=1e-9 * strength)
    fine = np.linspace(0.0, failure, 100_001)
    energy = bond_tension(CONCRETE, fine).sum() * fine[1]
    assert energy == pytest.approx(CONCRETE.fracture_energy, rel=1e-4)


def test_a_sheared_bond_slips_at_coulombs_bound_and_goes_back_elastically():
    bound = CONCRETE.cohesion + 5e6 * CONCRETE.friction
    reach = bound / CONCRETE.shear_stiffness
    way = reach * np.array([0.5, 1.0, 3.0, 2.5, 1.0, 0.0, 2.0])
    expected = bound * np.array([0.5, 1.0, 1.0, 0.5, -1.0, -1.0, 1.0])
    assert bond_shear(CONCRETE, way, 5e6) == pytest.approx(expected, rel=1e-12)
