"""Notches and joints: groups of inner faces without bonds, or bonded in part."""

from dataclasses import replace

import numpy as np
import pytest

from cases.meshes import with_moved_nodes
from taichi_dem import CONCRETE, Scene, Simulation, Uniform, effects, in_space_order
from taichi_dem.mesh.mesh import with_cut, with_inner_group
from taichi_dem.mesh.shapes import bar, pair, placed_together
from taichi_dem.mesh.tetrahedra import area_vectors
from taichi_dem.mesh.topology import parts_of, topology_of
from tests.structures import POST, filled

PAIR = with_inner_group(
    placed_together({"pair": (pair(), (0.0, 0.0, 0.0))} | POST), "middle", lambda x: x[:, 0] < 1.0
)
AREA = float(np.linalg.norm(area_vectors(PAIR.points, PAIR.groups["middle"])[0]))
BLOCK = with_cut(
    bar(0.2, 0.1, (4, 2, 2)), "notch", (0.1, 0, 0), (1, 0, 0), lambda x: x[:, 1] < 0.05
)


def test_a_cut_divides_the_bodies_on_both_sides_of_a_plane():
    """Flat where boxes meet, two faces a box; rough elsewhere, with no bond left across."""
    assert len(BLOCK.groups["notch"]) == 2 * 2 and BLOCK.inner_groups == ("notch",)
    for mesh in (with_moved_nodes(bar(1, 0.5, (6, 3, 3)), 0.02, 1), bar(1, 0.5, (7, 3, 3))):
        made = Scene(with_cut(mesh, "cut", (0.5, 0, 0), (1, 0, 0)), CONCRETE, unbonded=["cut"]).mesh
        part = parts_of(made)
        centre = made.points[made.tetrahedra].mean(axis=1)[:, 0]
        assert part.max() == 1
        assert np.array_equal(part == part[centre.argmax()], centre > 0.5)


def test_unbonded_faces_are_free_on_both_sides():
    mesh = in_space_order(BLOCK)
    before = topology_of(mesh)
    after = topology_of(Scene(mesh, CONCRETE, unbonded=["notch"]).mesh)
    assert after.bond_count == before.bond_count - 4
    assert after.outer_count == before.outer_count + 8 and after.is_open.sum() == 8
    # A scene decides on its own: another one of the same mesh has all bonds.
    assert topology_of(Scene(mesh, CONCRETE).mesh).bond_count == before.bond_count


#: Contact spheres without dashpots.
BOUNCY = replace(CONCRETE, contact_damping=0.0)


def run_pair(listed, steps, speed, dt, **options):
    """Two bodies that move apart at a speed [m/s]."""
    simulation = Simulation(Scene(PAIR, BOUNCY, listed, **options), Uniform(dt))
    velocity = speed * np.outer([-0.5, 0.5, 0.0], [1.0, 0.0, 0.0])
    simulation.state.set_motion(simulation.model.centre, velocity=velocity)
    simulation.advance_to(steps)
    return simulation, simulation.energy_balance.account()


def test_what_is_not_bonded_is_not_held_but_pushed_apart_by_a_pressure():
    """Each body gets p A t beside its velocity; together nothing."""
    push = filled("supports", effects.Pressure("middle", 1e5), group="post_base")
    simulation, account = run_pair(push, 100, 1.0, 2e-7, unbonded=["middle"])
    gained = 1e5 * AREA * 2e-5 / simulation.model.body_mass[0]
    velocity = simulation.motion()["velocity"][:2, 0]
    assert velocity == pytest.approx([-0.5 - gained, 0.5 + gained], rel=1e-9)
    assert account["bond_strain"] == 0.0 and simulation.model.bond_count == 0


def test_unbonded_faces_carry_contact_spheres_where_outer_faces_have_none():
    """Bodies that meet at 1 m/s on six springs part at 1 m/s; their energies are a leapfrog's.

    k = 6 x 1.5 GN/m and m / 2 = 18 g: half a period takes 4.4 us, and w dt is 0.014.
    """
    contact = effects.SphereContact(outer_faces=False)
    simulation, account = run_pair(filled("paper", contact), 600, -1.0, 2e-8, unbonded=["middle"])
    assert simulation.motion()["velocity"][:2, 0] == pytest.approx([-0.5, 0.5], rel=1e-3)
    assert abs(account["residual"]) < 1e-3 * simulation.energy_balance.start_energy
    assert simulation.energy_balance.momentum_errors()[0] < 1e-12


def test_a_weaker_bond_has_a_share_of_strength_and_energy():
    """Pulled apart slowly: G_f times the bonded area, and a stiffness of a share.

    In the last evaluation before it fails the opening is short of u_f by less than a step's 2e-8 m
    of 3e-5 m: the energy by (2e-8 / 3e-5)^2.
    """
    share = 0.5
    drive = effects.PrescribedMotion("left", (-0.1, 0.0, 0.0)), effects.Fixed("right")
    laws = filled("supports", effects.Softening(), *drive, group="post_base")
    simulation, account = run_pair(laws, 200, 0.1, 2e-7, weaker={"middle": share})
    opening = 0.1 * 200 * 2e-7
    stiffness = share * AREA * CONCRETE.normal_stiffness
    assert account["bond_strain"] == pytest.approx(0.5 * stiffness * opening**2, rel=1e-6)
    simulation.advance_to(1600)
    account = simulation.energy_balance.account()
    spent = account["softening"] + account["release"]
    assert spent == pytest.approx(share * AREA * CONCRETE.fracture_energy, rel=1e-5)
    assert account["support_work"] == pytest.approx(spent, rel=0.01)
