"""Runs of scenes of two materials: same bits for equal ones, waves, fracture, contact, accounts."""

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
    with_body_group,
)
from taichi_dem.body_materials import BodyMaterials, joined
from taichi_dem.mesh.mesh import volumes
from taichi_dem.mesh.shapes import bar, pair, single
from tests.equivalence.test_digests import CONTROLLED
from tests.material.blocks import NU, E, rock
from tests.scenes import beside, paper_effects

#: A firm, heavy ore with weak bonds.
ORE = replace(
    CONCRETE,
    density=4000.0,
    normal_stiffness=900e9,
    shear_stiffness=150e9,
    normal_damping=10e6,
    tensile_strength=4e6,
    cohesion=5e6,
    friction=0.3,
    fracture_energy=60.0,
    contact_stiffness=4e9,
    contact_damping=1e6,
)
IMPLICIT = ImplicitDashpots(4e-7)
METHODS = [
    pytest.param(IMPLICIT, 150, id="implicit"),
    pytest.param(CONTROLLED, 375, id="controlled", marks=pytest.mark.slow),
    pytest.param(Uniform(2e-8, dashpot="limited"), 1500, id="uniform", marks=pytest.mark.slow),
]


def thrown(method, steps, materials=None, mesh=None, word=None, twin=False):
    """A bar that tears itself apart, with all laws of the paper, listed or by a word.

    Velocities of 40 m/s and more, outward and across. twin: whether its group "ore" has a second
    material of equal constants, which a scene would merge with the first.
    """
    mesh = mesh or bar(0.1, 0.05, (3, 2, 2))
    mesh = with_body_group(mesh, "ore", lambda x: x[:, 0] + 0.5 * x[:, 1] > 0.06)
    laws = word or paper_effects(outer_faces=True)[:-1]
    scene = Scene(mesh, CONCRETE, laws, materials=materials or {})
    if twin:
        of_body = np.zeros(mesh.body_count, dtype=np.int32)
        of_body[mesh.body_groups["ore"]] = 1
        laid = BodyMaterials(mesh, (CONCRETE, replace(CONCRETE)), of_body)
        object.__setattr__(scene, "body_materials", laid)
    return moved(scene, method, steps)


def moved(scene, method, steps, share=1.0):
    """A run that begins with a share of these velocities."""
    simulation = Simulation(scene, method)
    away = simulation.model.centre - np.array([0.05, 0.025, 0.025])
    velocity = away * np.array([800.0, -200.0, 400.0]) + away[:, [1, 2, 0]] * 300.0
    simulation.state.set_motion(simulation.model.centre, velocity=share * velocity)
    simulation.advance_to(steps)
    return simulation


def assert_same_bits(first, second):
    count = first.model.bond_count
    broken = [one.state.broken_tick.to_numpy()[:count] for one in (first, second)]
    assert (broken[0] >= 0).sum() > 3
    assert np.array_equal(*broken)
    found, motion = first.state.motion(), second.state.motion()
    assert all(np.array_equal(found[name], motion[name]) for name in found)
    assert first.energy_balance.account() == second.energy_balance.account()


@pytest.mark.parametrize(("method", "steps"), METHODS)
@pytest.mark.parametrize("word", [None, pytest.param("auto", marks=pytest.mark.slow)])
def test_a_second_material_of_equal_constants_changes_no_bit(method, steps, word):
    """Not merged with the first, so that every law reads another row of its numbers."""
    assert_same_bits(*(thrown(method, steps, word=word, twin=twin) for twin in (False, True)))


@pytest.mark.parametrize(("method", "steps"), METHODS)
def test_the_account_closes_where_two_materials_break(method, steps):
    """Energy as well as in a scene of one material, momentum to rounding."""
    open_shares = []
    for given in ({}, {"ore": ORE}):
        simulation = thrown(method, steps, given)
        report = simulation.report()
        assert report.broken_faces > 3
        assert report.linear_momentum_error < 1e-12
        assert report.angular_momentum_error < 1e-12
        residual = abs(report.energy_balance["residual"])
        open_shares.append(residual / simulation.energy_balance.start_energy)
    assert open_shares[1] < 2.0 * open_shares[0] + 1e-3


def test_numbers_of_bodies_change_results_by_the_turn_alone():
    """Bodies in another order: where master and slave change sides, so do their materials.

    Sweeps visit bonds in another order too, so they go on until velocities agree to 1e-12. A bond
    is seen from its master, so who that is changes forces by a share of the order of the turn: at
    40 mm/s, bodies of 25 mm and 5e-6 s at most 1e-5.
    """
    method = ImplicitDashpots(4e-7, tolerance=1e-12, sweeps=(2, 500))
    mesh = with_body_group(bar(0.1, 0.05, (3, 2, 2)), "ore", lambda x: x[:, 0] + x[:, 1] > 0.08)
    other = in_space_order(mesh)
    order = [
        int(np.flatnonzero((other.tetrahedra == corners).all(axis=1))[0])
        for corners in mesh.tetrahedra
    ]
    assert order != sorted(order)
    given, laws = {"ore": rock(young=3 * E, density=5000.0)}, paper_effects(outer_faces=True)[:-1]
    found = [
        moved(Scene(each, rock(), laws, materials=given), method, 12, 1e-3)
        for each in (mesh, other)
    ]
    first, second = (simulation.state.motion()["velocity"] for simulation in found)
    assert second[order] == pytest.approx(first, abs=1e-5 * np.abs(first).max())


def stretched(mesh, material, materials, speed=2.0, steps=120):
    """Motion and energy of two bodies of the paper's laws that move apart and shear."""
    scene = Scene(mesh, material, paper_effects(outer_faces=True)[:-1], materials=materials)
    simulation = Simulation(scene, IMPLICIT)
    velocity = np.array([[-speed, 0.1, 0.0], [speed, 0.0, 0.3]])
    simulation.state.set_motion(simulation.model.centre, velocity=velocity)
    simulation.advance_to(steps)
    return simulation


@pytest.mark.parametrize("speed", [20.0, -2.0])
def test_two_bodies_of_two_materials_move_as_if_both_had_what_joins_them(speed):
    """Bond and contact, with equal masses: the same bits. Apart the bond breaks; else it holds."""
    other = replace(ORE, density=CONCRETE.density)
    mesh = with_body_group(pair(0.05), "right", lambda x: x[:, 0] > 0.0)
    mixed = stretched(mesh, CONCRETE, {"right": other}, speed)
    found, broken = mixed.state.motion(), mixed.state.broken_tick[0] >= 0
    account = mixed.energy_balance.account()
    alone = stretched(mesh, joined(CONCRETE, other), {}, speed)
    assert broken == (speed > 0.0)
    for name, values in alone.state.motion().items():
        assert np.array_equal(found[name], values), name
    assert alone.energy_balance.account() == account


def test_blocks_of_two_contact_stiffnesses_push_by_springs_in_series():
    """Two mirror images that meet at speed v each: 39 pairs of spheres touch, all by one overlap.

    39 k D^2 / 2 = m v^2 with k = 2 k1 k2 / (k1 + k2) = 1.6e9 N/m (docs/add_a_contact_law.md counts
    the pairs); steps of w dt = 0.38 see D and the springs' work to (w dt)^2 / 4 or better.
    """
    left = single(0.05)
    points = left.points * np.array([-1.0, 1.0, 1.0]) + np.array([1e-6, 0.0, 0.0])
    right = replace(left, points=points, tetrahedra=left.tetrahedra[:, [0, 2, 1, 3]], groups={})
    mesh = with_body_group(beside(left, right, np.zeros(3)), "right", lambda x: x[:, 0] > 0.0)
    soft = replace(CONCRETE, contact_damping=0.0, contact_stiffness=1e9)
    given = {"right": replace(soft, contact_stiffness=4e9)}
    series = replace(soft, contact_stiffness=1.6e9)
    depths = [deepest(mesh, soft, given), deepest(mesh, series, {})]
    mass = CONCRETE.density * volumes(mesh)[0]
    assert depths[0] == depths[1]
    assert depths[0] == pytest.approx(np.sqrt(2.0 * mass / (39.0 * 1.6e9)), rel=0.25 * 0.38**2)


def deepest(mesh, material, materials, gap=1e-6):
    """Deepest overlap of two bodies that meet head-on at 1 m/s each [m]."""
    laws = paper_effects(outer_faces=True)[:-1]
    simulation = Simulation(Scene(mesh, material, laws, materials=materials), IMPLICIT)
    centre, apart = simulation.model.centre, []
    simulation.state.set_motion(centre, velocity=[[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]])
    for step in range(1, 12):
        simulation.advance_to(step)
        place = simulation.state.motion()["position"][:, 0]
        apart.append(place[1] - place[0])
    return centre[1, 0] - centre[0, 0] - gap - min(apart)


def with_pulse(materials, boxes=100):
    """A bar of plane waves along x, 1 m, with its right half as the group "half"; a pulse."""
    mesh = with_body_group(bar(1.0, 1.0 / boxes, (boxes, 1, 1)), "half", lambda x: x[:, 0] > 0.5)
    sides = {"bottom": (0, 1, 0), "top": (0, 1, 0), "back": (0, 0, 1), "front": (0, 0, 1)}
    held = [effects.Roller(name, normal) for name, normal in sides.items()]
    scene = Scene(mesh, rock(damping_ratio=0.0), held, materials=materials)
    simulation = Simulation(scene, Uniform(1e-7))
    x = simulation.model.centre[:, 0]
    velocity = np.exp(-(((x - 0.35) / 0.05) ** 2))[:, None] * np.array([1.0, 0.0, 0.0])
    simulation.state.set_motion(simulation.model.centre, velocity=velocity)
    return simulation, x


@pytest.mark.parametrize(("heavier", "stiffer"), [(4.0, 1.0), (1.0, 4.0), (2.0, 0.5)])
def test_a_wave_is_reflected_and_transmitted_by_the_impedances(heavier, stiffer):
    """Velocities of 2 Z1 / (Z1 + Z2) and (Z1 - Z2) / (Z1 + Z2) of the pulse, Z = sqrt(rho M).

    Half of the pulse runs right, and after 0.3 m its reflection is 0.15 m before the seam. A chain
    of boxes h slows a wave k by (k h)^2 / 24, which takes less than 1 % off the peak of a pulse
    exp(-(x / w)^2) of w = 2.5 h or more within 0.15 m: 2 % of the pulse are allowed.
    """
    base = rock(damping_ratio=0.0)
    other = rock(damping_ratio=0.0, density=heavier * base.density, young=stiffer * E)
    simulation, x = with_pulse({"half": other})
    confined = E * (1.0 - NU) / ((1.0 + NU) * (1.0 - 2.0 * NU))
    simulation.advance_to(round(0.3 / np.sqrt(confined / base.density) / 1e-7))
    found = simulation.state.motion()["velocity"][:, 0]
    impedance = np.sqrt(heavier * stiffer)
    assert found[x > 0.51].max() == pytest.approx(1.0 / (1.0 + impedance), abs=0.01)
    behind = found[(x > 0.25) & (x < 0.45)]
    back = behind[np.abs(behind).argmax()]
    assert back == pytest.approx(0.5 * (1.0 - impedance) / (1.0 + impedance), abs=0.01)


def test_a_bar_breaks_in_its_weaker_half():
    """Pulled evenly, by speeds in proportion to x: the first bonds to fail are weak ones."""
    mesh = with_body_group(bar(0.4, 0.05, (8, 1, 1)), "weak", lambda x: x[:, 0] < 0.2)
    weak = replace(CONCRETE, tensile_strength=2e6, fracture_energy=20.0)
    laws = paper_effects(outer_faces=True)[:-1]
    simulation = Simulation(Scene(mesh, CONCRETE, laws, materials={"weak": weak}), IMPLICIT)
    centre = simulation.model.centre
    rate = np.array([30.0, 0.0, 0.0])
    simulation.state.set_motion(centre, velocity=(centre - np.array([0.2, 0.0, 0.0])) * rate)
    top, step, broken = simulation.model.topology, 0, np.zeros(1, dtype=bool)
    while not broken.any() and step < 500:
        step += 5
        simulation.advance_to(step)
        broken = simulation.state.broken_tick.to_numpy()[: top.bond_count] >= 0
    is_weak = np.isin([top.master, top.slave], mesh.body_groups["weak"]).any(axis=0)
    assert broken.any()
    assert is_weak[broken].all()
