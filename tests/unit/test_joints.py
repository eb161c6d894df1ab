"""Faces may lie on each other without a bond, and then touch: joints of blocks, cracks in one.

Named groups of bodies: from files and predicates, kept by all that makes a mesh of a mesh.
"""

import numpy as np
import pytest

from taichi_dem import CONCRETE, InputError, Scene, Simulation, Uniform, effects
from taichi_dem.mesh.mesh import checked_mesh
from taichi_dem.mesh.shapes import bar, placed_together
from taichi_dem.mesh.topology import topology_of

EDGE = 0.05
CUBE = bar(EDGE, EDGE, (1, 1, 1))
BLOCKS = {"left": (CUBE, (0.0, 0.0, 0.0)), "right": (CUBE, (EDGE, 0.0, 0.0))}


def cracked():
    """A bar of two by two boxes, a crack across its lower half: points, bodies and their welding.

    The bodies right of the middle take new points for those below the tip.
    """
    whole = bar(2 * EDGE, 2 * EDGE, (2, 2, 1))
    on_crack = np.isclose(whole.points[:, 0], EDGE) & (whole.points[:, 1] < EDGE - 1e-6)
    old = np.flatnonzero(on_crack)
    points = np.vstack([whole.points, whole.points[old]])
    new = np.arange(len(whole.points))
    new[old] = len(whole.points) + np.arange(len(old))
    bodies = whole.tetrahedra.copy()
    right = whole.points[bodies].mean(axis=1)[:, 0] > EDGE
    bodies[right] = new[bodies[right]]
    return whole, points, bodies


def test_blocks_that_touch_are_refused_unless_kept_apart():
    with pytest.raises(InputError, match=r"weld_tolerance=.* or keep_coincident=True"):
        placed_together(BLOCKS)
    made = placed_together(BLOCKS, keep_coincident=True)
    assert made.point_count == 16
    assert topology_of(made).bond_count == 2 * topology_of(CUBE).bond_count


def test_a_crack_has_two_free_faces_for_each_bond_it_cuts():
    whole, points, bodies = cracked()
    made = checked_mesh(points, bodies, {}, keep_coincident=True)
    before, after = topology_of(whole), topology_of(made)
    cut = before.bond_count - after.bond_count
    assert cut == 2 and after.outer_count == before.outer_count + 2 * cut


def touching_blocks(speed):
    """Simulation of two blocks that touch, the left one moving along x."""
    mesh = placed_together(BLOCKS, keep_coincident=True)
    listed = [effects.BondDamping(), effects.SphereContact(outer_faces=True)]
    velocity = np.zeros((12, 3))
    velocity[:6, 0] = speed
    return Simulation(Scene(mesh, CONCRETE, listed, velocity=velocity), Uniform(2e-9))


def test_blocks_at_rest_stay_and_blocks_that_part_go_free():
    """Spheres touch at a gap of zero: what rounding overlaps pushes less than 1e-12 m/s."""
    resting = touching_blocks(0.0)
    resting.advance_to(500)
    assert np.abs(resting.values(resting.state.velocity)).max() < 1e-12
    parting = touching_blocks(-0.5)
    parting.advance_to(500)
    velocity = parting.values(parting.state.velocity)
    assert np.abs(velocity[6:]).max() < 1e-12
    assert np.abs(velocity[:6, 0] + 0.5).max() < 1e-12


def test_a_block_pushes_the_one_it_touches():
    """Half of the momentum has gone over when both are as fast; none is lost."""
    simulation = touching_blocks(0.5)
    simulation.advance_to(5000)
    velocity, mass = simulation.values(simulation.state.velocity), simulation.model.body_mass
    momentum = mass[:, None] * velocity
    assert momentum[6:, 0].sum() > 0.4 * 0.5 * mass[:6].sum()
    assert momentum[:, 0].sum() == pytest.approx(0.5 * mass[:6].sum(), rel=1e-12)
    assert simulation.report().missing_effects == ()
