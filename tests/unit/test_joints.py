"""Faces may lie on each other without a bond, and then touch: joints of blocks, cracks in one.

Named groups of bodies: from files and predicates, kept by all that makes a mesh of a mesh.
"""

import numpy as np
import pytest

from _meshes import mirrored_copies
from taichi_dem import CONCRETE, InputError, Scene, Simulation, Uniform, effects, read_mesh
from taichi_dem.mesh.files import write_mesh
from taichi_dem.mesh.mesh import Mesh, checked_mesh, with_cut
from taichi_dem.mesh.shapes import bar, in_space_order, placed_together, single
from taichi_dem.mesh.topology import topology_of
from taichi_dem.scene import outer_faces_warnings

EDGE = 0.05
CUBE = bar(EDGE, EDGE, (1, 1, 1))
BLOCKS = {"left": (CUBE, (0.0, 0.0, 0.0)), "right": (CUBE, (EDGE, 0.0, 0.0))}
ORE = ("ore", lambda x: x[:, 0] > 0.5)
LOW = ("low", lambda x: x[:, 1] < 0.15)


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


def test_a_mesh_made_directly_read_and_ordered_keeps_them(tmp_path):
    _, points, bodies = cracked()
    with pytest.raises(InputError, match="coincide with another"):
        Mesh(points, bodies, {})
    made = Mesh(points, bodies, {}, keep_coincident=True)
    assert in_space_order(made).keep_coincident
    write_mesh(tmp_path / "crack.msh", made)
    with pytest.raises(InputError, match=r"crack.msh: .* keep_coincident=True"):
        read_mesh(tmp_path / "crack.msh")
    found = read_mesh(tmp_path / "crack.msh", keep_coincident=True)
    assert np.array_equal(found.tetrahedra, made.tetrahedra)
    joined = read_mesh(tmp_path / "crack.msh", weld_tolerance=1e-9)
    assert topology_of(joined).bond_count == topology_of(made).bond_count + 2


def test_a_body_inside_another_is_refused_though_points_are_kept_apart():
    parts = {"a": (single(), (0, 0, 0)), "b": (single(), (0, 0, 0))}
    with pytest.raises(InputError, match="0 and 1 lie on the same side"):
        placed_together(parts, True)


@pytest.mark.parametrize("contact", [None, False, True])
def test_joints_that_nothing_lets_meet_are_warned_of(contact):
    _, points, bodies = cracked()
    mesh = checked_mesh(points, bodies, {}, keep_coincident=True)
    listed = [] if contact is None else [effects.SphereContact(outer_faces=contact)]
    assert bool(outer_faces_warnings(Scene(mesh, CONCRETE, listed))) == (not contact)


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


def grouped():
    """A bar with two groups of bodies that have some in common."""
    return bar(1.0, 0.3, (4, 2, 2)).body_group(*ORE).body_group(*LOW)


def assert_by_place(mesh, names=(ORE, LOW)):
    """Groups hold exactly the bodies that their predicates choose."""
    centres = mesh.points[mesh.tetrahedra].mean(axis=1)
    for name, chosen in names:
        assert np.array_equal(mesh.body_groups[name], np.flatnonzero(chosen(centres)))


def written_and_read(mesh, folder):
    write_mesh(folder / "mesh.msh", mesh)
    return read_mesh(folder / "mesh.msh")


KEPT = {
    "reordered": lambda mesh, _: in_space_order(mesh),
    "cut": lambda mesh, _: with_cut(mesh, "cut", (0.5, 0.0, 0.0), (1.0, 0.0, 0.0)),
    "bonded": lambda mesh, _: with_cut(mesh, "c", (0.5, 0, 0), (1, 0, 0)).bonded_by({"c": 0.5}),
    "mirrored": lambda mesh, _: mirrored_copies(mesh, 3),
    "written": written_and_read,
}


@pytest.mark.parametrize("made", KEPT)
def test_groups_are_kept(made, tmp_path):
    mesh = KEPT[made](grouped(), tmp_path)
    assert_by_place(mesh)


def test_parts_that_are_placed_together_are_groups():
    mesh = grouped()
    both = placed_together({"a": (mesh, (0, 0, 0)), "b": (mesh, (3, 0, 0))})
    count = mesh.body_count
    assert np.array_equal(both.body_groups["b"], np.arange(count, 2 * count))
    assert np.array_equal(both.body_groups["b_ore"], count + mesh.body_groups["ore"])
    assert len(both.body_groups["ore"]) == 2 * len(mesh.body_groups["ore"])
