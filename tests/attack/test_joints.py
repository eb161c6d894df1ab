"""Attacks on joints: random solids cut along random faces, whose points coincide."""

import warnings

import numpy as np
import pytest

from taichi_dem import CONCRETE, ImplicitDashpots, Scene, Simulation, effects, read_mesh
from taichi_dem.mesh.files import write_mesh
from taichi_dem.mesh.mesh import checked_mesh
from taichi_dem.mesh.reorder import in_space_order
from taichi_dem.mesh.shapes import bar
from taichi_dem.mesh.topology import topology_of

ATTACKS = "joints and cracks: coincident points that stay apart"

#: Width of the bar that is cut [m].
EDGE = 0.05


def cut_up(seed):
    """A bar cut into random parts: the whole, points and bodies of the parts, part of each body.

    Every part has points of its own, in random order.
    """
    draw = np.random.default_rng(seed)
    whole = bar(2 * EDGE, EDGE, tuple(draw.integers(1, 4, 3)))
    part = draw.integers(0, draw.integers(2, 5), whole.body_count)
    # By halves of the bar at every other seed: few parts of many bodies.
    if seed % 2:
        middle = whole.points[whole.tetrahedra].mean(axis=1)
        along = middle @ draw.normal(size=3)
        part = (along > np.median(along)).astype(int)
    key = whole.tetrahedra + whole.point_count * part[:, None]
    used, bodies = np.unique(key, return_inverse=True)
    order = draw.permutation(len(used))
    points = np.empty((len(used), 3))
    points[order] = whole.points[used % whole.point_count]
    return whole, points, order[bodies.reshape(key.shape)], part


def test_bonds_are_those_within_parts_and_welding_brings_back_the_others(seed, tmp_path):
    whole, points, bodies, part = cut_up(seed)
    made = checked_mesh(points, bodies, {}, keep_coincident=True)
    before, after = topology_of(whole), topology_of(made)
    held = part[before.master] == part[before.slave]
    assert np.array_equal(after.master, before.master[held])
    assert np.array_equal(after.slave, before.slave[held])
    assert after.outer_count == before.outer_count + 2 * (~held).sum()
    assert topology_of(in_space_order(made)).bond_count == held.sum()
    write_mesh(tmp_path / "cut.msh", made)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # bodies that share points alone
        again = read_mesh(tmp_path / "cut.msh", keep_coincident=True)
    assert (
        np.array_equal(again.points, made.points) and again.tetrahedra.tolist() == bodies.tolist()
    )
    welded = checked_mesh(points, bodies, {}, weld_tolerance=1e-8)
    assert topology_of(welded).bond_count == before.bond_count


def moving(seed, speed, steps, step):
    """Simulation of a cut solid whose bodies start at random velocities, and their momentum."""
    _, points, bodies, _ = cut_up(seed)
    mesh = checked_mesh(points, bodies, {}, keep_coincident=True)
    listed = [effects.BondDamping(), effects.SphereContact(outer_faces=True), effects.Friction()]
    simulation = Simulation(Scene(mesh, CONCRETE, listed), ImplicitDashpots(step))
    draw = np.random.default_rng(seed + 1)
    velocity = draw.normal(scale=speed, size=(mesh.body_count, 3))
    simulation.state.set_motion(simulation.model.centre, [1.0, 0.0, 0.0, 0.0], velocity)
    simulation.advance_to(steps)
    return simulation, velocity


@pytest.mark.slow
def test_a_cut_solid_rests_in_itself(seed):
    """Spheres meet at a gap of zero, known to ten roundings of a place of 0.1 m.

    The springs of four bonds and of all spheres on four faces, against a neighbour each and what
    is around it, push no harder than those overlaps times their stiffness.
    """
    steps, step = 50, 2e-7
    simulation, _ = moving(seed, 0.0, steps, step)
    mass = simulation.model.body_mass
    rounding = 10 * np.finfo(float).eps * 0.1
    stiffness = 24 * 24 * CONCRETE.contact_stiffness + 4 * CONCRETE.normal_stiffness * EDGE**2
    velocity = simulation.state.velocity.to_numpy()
    assert np.abs(velocity).max() < stiffness * rounding * steps * step / mass.min()


def test_a_struck_cut_solid_keeps_its_momentum(seed):
    simulation, velocity = moving(seed, 0.5, 200, 2e-7)
    mass = simulation.model.body_mass
    kept = mass @ simulation.state.velocity.to_numpy()
    assert np.abs(kept - mass @ velocity).max() < 1e-12 * (mass @ np.abs(velocity)).max()
    assert simulation.report().pair_evaluations > 0
