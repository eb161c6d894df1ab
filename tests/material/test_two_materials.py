"""Runs of two materials: same bits for equal ones, waves, fracture, contact, closed accounts."""

from dataclasses import replace

import numpy as np
import pytest

from taichi_dem import (
    CONCRETE,
    ImplicitDashpots,
    Scene,
    Simulation,
    Uniform,
    effects,
    in_space_order,
)
from taichi_dem.materials.body_materials import BodyMaterials, joined
from taichi_dem.mesh.shapes import bar, pair
from tests.boundaries.test_quiet_boundary import QUIET, rollers
from tests.material.blocks import NU, ORE, E, rock
from tests.scenes import paper_effects

IMPLICIT = ImplicitDashpots(4e-7)
BAR = bar(0.1, 0.05, (3, 2, 2))
#: Those of the paper; the gas does not come yet.
LAWS = [*paper_effects(outer_faces=True)[:-1], effects.GasPressure("left", start=1.0)]


def thrown(materials, twin=False):
    """A bar that tears itself apart, with all laws of the paper.

    Velocities of 40 m/s and more, outward and across. twin: whether its group "ore" has a second
    material of equal constants, which a scene would merge with the first.
    """
    mesh = BAR.body_group("ore", lambda x: x[:, 0] + 0.5 * x[:, 1] > 0.06)
    scene = Scene(mesh, CONCRETE, LAWS, materials=materials)
    if twin:
        of_body = np.zeros(mesh.body_count, dtype=np.int32)
        of_body[mesh.body_groups["ore"]] = 1
        laid = BodyMaterials(mesh, (CONCRETE, replace(CONCRETE)), of_body)
        object.__setattr__(scene, "body_materials", laid)
    return moved(scene, IMPLICIT, 150)


def moved(scene, method, steps, share=1.0):
    """A run that begins with a share of these velocities."""
    simulation = Simulation(scene, method)
    away = simulation.model.centre - np.array([0.05, 0.025, 0.025])
    velocity = away * np.array([800.0, -200.0, 400.0]) + away[:, [1, 2, 0]] * 300.0
    simulation.state.set_motion(simulation.model.centre, velocity=share * velocity)
    simulation.advance_to(steps)
    return simulation


def test_a_second_material_of_equal_constants_changes_no_bit():
    """Not merged with the first, so that every law reads another row of its numbers."""
    first, second = (outcome(thrown({}, twin)) for twin in (False, True))
    assert (first[1]["broken_tick"] >= 0).sum() > 3
    assert first[0] == second[0]
    assert all(np.array_equal(first[1][name], second[1][name]) for name in first[1])


def outcome(simulation):
    """Account of the energy, and motion and fracture as arrays."""
    broken = {"broken_tick": simulation.values(simulation.state.broken_tick)}
    return simulation.energy_balance.account(), {**simulation.state.motion(), **broken}


def test_the_account_closes_where_two_materials_break():
    """Energy as well as in a scene of one material, momentum to rounding."""
    open_shares = []
    for given in ({}, {"ore": ORE}):
        simulation = thrown(given)
        report = simulation.report()
        assert report.broken_faces > 3
        assert report.linear_momentum_error < 1e-12
        assert report.angular_momentum_error < 1e-12
        residual = abs(report.energy_balance["residual"])
        open_shares.append(residual / simulation.energy_balance.start_energy)
        simulation.close()
    assert open_shares[1] < 2.0 * open_shares[0] + 1e-3


def test_numbers_of_bodies_change_results_by_the_turn_alone():
    """Bodies in another order: where master and slave change sides, so do their materials.

    Sweeps visit bonds in another order too, so they go on until velocities agree to 1e-12. A bond
    is seen from its master, so who that is changes forces by a share of the order of the turn: at
    40 mm/s, bodies of 25 mm and 5e-6 s at most 1e-5.
    """
    method = ImplicitDashpots(4e-7, tolerance=1e-12, sweeps=(2, 500))
    mesh = BAR.body_group("ore", lambda x: x[:, 0] + x[:, 1] > 0.08)
    other = in_space_order(mesh)
    order = [
        int(np.flatnonzero((other.tetrahedra == corners).all(axis=1))[0])
        for corners in mesh.tetrahedra
    ]
    assert order != sorted(order)
    given = {"ore": rock(young=3 * E, density=5000.0)}
    scenes = (Scene(each, rock(), LAWS, materials=given) for each in (mesh, other))
    first, second = (outcome(moved(one, method, 12, 1e-3))[1]["velocity"] for one in scenes)
    assert second[order] == pytest.approx(first, abs=1e-5 * np.abs(first).max())


def stretched(mesh, material, materials, speed):
    """A run of two bodies of the paper's laws that move apart, or meet, and shear."""
    velocity = np.array([[-speed, 0.1, 0.0], [speed, 0.0, 0.3]])
    simulation = Simulation(
        Scene(mesh, material, LAWS, materials=materials, velocity=velocity), IMPLICIT
    )
    simulation.advance_to(120)
    return simulation


@pytest.mark.parametrize("speed", [20.0, -2.0])
def test_two_bodies_of_two_materials_move_as_if_both_had_what_joins_them(speed):
    """Bond and contact, with equal masses: the same bits. Apart the bond breaks; else it holds."""
    other = replace(ORE, density=CONCRETE.density)
    mesh = pair(0.05).body_group("right", lambda x: x[:, 0] > 0.0)
    mixed = stretched(mesh, CONCRETE, {"right": other}, speed)
    found, broken = mixed.state.motion(), mixed.state.broken_tick[0] >= 0
    account = mixed.energy_balance.account()
    mixed.close()
    alone = stretched(mesh, joined(CONCRETE, other), {}, speed)
    assert broken == (speed > 0.0)
    for name, values in alone.state.motion().items():
        assert np.array_equal(found[name], values), name
    assert alone.energy_balance.account() == account


@pytest.mark.parametrize(("heavier", "stiffer"), [(4.0, 1.0), (2.0, 0.5)])
def test_a_wave_is_reflected_and_transmitted_by_the_impedances(heavier, stiffer):
    """Velocities of 2 Z1 / (Z1 + Z2) and (Z1 - Z2) / (Z1 + Z2) of the pulse, Z = sqrt(rho M).

    Half of the pulse runs right, and after 0.3 m its reflection is 0.15 m before the seam. A chain
    of boxes h slows a wave k by (k h)^2 / 24, which takes less than 1 % off the peak of a pulse
    exp(-(x / w)^2) of w = 2.5 h or more within 0.15 m: 2 % of the pulse are allowed. Nothing has
    come to the quiet ends.
    """
    base = rock(damping_ratio=0.0)
    other = rock(damping_ratio=0.0, density=heavier * base.density, young=stiffer * E)
    mesh = bar(1.0, 0.01, (100, 1, 1)).body_group("half", lambda x: x[:, 0] > 0.5)
    held = [*rollers(), *QUIET]
    simulation = Simulation(Scene(mesh, base, held, materials={"half": other}), Uniform(1e-7))
    x = simulation.model.centre[:, 0]
    velocity = np.exp(-(((x - 0.35) / 0.05) ** 2))[:, None] * np.array([1.0, 0.0, 0.0])
    simulation.state.set_motion(simulation.model.centre, velocity=velocity)
    confined = E * (1.0 - NU) / ((1.0 + NU) * (1.0 - 2.0 * NU))
    simulation.advance_to(round(0.3 / np.sqrt(confined / base.density) / 1e-7))
    found = simulation.state.motion()["velocity"][:, 0]
    impedance = np.sqrt(heavier * stiffer)
    assert found[x > 0.51].max() == pytest.approx(1.0 / (1.0 + impedance), abs=0.01)
    behind = found[(x > 0.25) & (x < 0.45)]
    back = behind[np.abs(behind).argmax()]
    assert back == pytest.approx(0.5 * (1.0 - impedance) / (1.0 + impedance), abs=0.01)
