"""Outer faces without contact spheres: told before a run, found in it, and nothing else is."""

import sys
import warnings

import numpy as np
import pytest
from taichi_dem.diagnostics.outer_faces import LEAST_OVERLAP, OuterFaces

from taichi_dem import CONCRETE, Scene, Uniform, checked_mesh, effects, simulate
from taichi_dem.diagnostics.missing_effects import MissingEffects
from taichi_dem.mesh.shapes import bar, pair, single
from taichi_dem.scene import outer_faces_warnings
from taichi_dem.simulation import Simulation
from taichi_dem.stability.step_report import step_report

EDGE = 0.05


def beside(mesh, other, shift):
    """Two meshes in one, the second moved by a shift [m]."""
    points = np.vstack([mesh.points, other.points + shift])
    bodies = np.vstack([mesh.tetrahedra, other.tetrahedra + mesh.point_count])
    groups = {f"first {name}": faces for name, faces in mesh.groups.items()}
    groups.update({f"second {name}": f + mesh.point_count for name, f in other.groups.items()})
    for name in set(mesh.groups) & set(other.groups):
        groups[name] = np.vstack([groups[f"first {name}"], groups[f"second {name}"]])
    return checked_mesh(points, bodies, groups)


TWO = beside(single(EDGE), single(EDGE), [1.0, 0.0, 0.0])


class Looked:
    """Bodies of a mesh that are put anywhere, and looked at; no step is compiled."""

    def __init__(self, mesh, **contact):
        listed = [effects.SphereContact(3, **contact)]
        self.simulation = Simulation(Scene(mesh, CONCRETE, listed), Uniform())
        self.model, self.state = self.simulation.model, self.simulation.state
        self.tables = self.simulation.tables
        self.outer = OuterFaces(self.model, self.state, self.simulation.outer_overlaps)

    def pairs(self, position, orientation=None):
        """Pairs that are found with the bodies at a position [m], (n, 3)."""
        still = np.tile([1.0, 0.0, 0.0, 0.0], (self.model.body_count, 1))
        self.state.set_motion(position, still if orientation is None else orientation)
        return int(self.outer.overlaps().sum())


@pytest.fixture(scope="module")
def two():
    """Two single bodies, each a part of its own."""
    return Looked(TWO)


@pytest.mark.parametrize(
    ("mesh", "listed", "told"),
    [
        (TWO, [effects.SphereContact()], True),
        (TWO, [effects.SphereContact(outer_faces=True)], False),
        (TWO, [effects.BondDamping(), effects.GasPressure("sides")], True),
        (TWO, [effects.BondDamping()], False),
        (pair(EDGE), [effects.SphereContact()], False),
        (bar(0.2, 0.1, (2, 1, 1)), [effects.SphereContact()], False),
    ],
)
def test_parts_that_may_pass_through_each_other_are_told_before_a_run(mesh, listed, told):
    scene = Scene(mesh, CONCRETE, listed)
    sentences = outer_faces_warnings(scene)
    assert len(sentences) == told
    assert all("SphereContact(outer_faces=True)" in sentence for sentence in sentences)
    spheres = any(effect.role == "contact" for effect in listed)
    assert all(("no contact is listed" in sentence) != spheres for sentence in sentences)
    assert str(step_report(scene)).count("warning: the mesh has 2 parts") == told


def test_simulate_warns_before_anything_is_compiled(monkeypatch):
    class Reached(Exception):
        pass

    def reached(*arguments):
        raise Reached

    monkeypatch.setattr(sys.modules["taichi_dem.simulate"], "Simulation", reached)
    scene = Scene(TWO, CONCRETE, [effects.SphereContact()])
    with pytest.warns(UserWarning, match="2 parts that no bond joins"), pytest.raises(Reached):
        simulate(scene, method=Uniform(), until=1e-8)


#: How far the second body is from where it covers the first [m]: (shift, whether they overlap).
SHIFTS = {
    "apart": ([2.0 * EDGE, 0.0, 0.0], 0),
    "flying past": ([0.0, 1.001 * EDGE, 0.0], 0),
    "through each other": ([0.1 * EDGE, 0.0, 0.0], 1),
    "on the same place": ([0.0, 0.0, 0.0], 1),
}


@pytest.mark.parametrize("name", SHIFTS)
def test_overlap_of_parts_is_found_and_nearness_is_not(two, name):
    shift, expected = SHIFTS[name]
    first = two.model.centre[0]
    assert two.pairs(np.array([first, first + shift])) == expected


@pytest.mark.parametrize("share, found", [(0.0, 0), (0.5 * LEAST_OVERLAP, 0), (1e-2, 1)])
def test_face_to_face_counts_from_the_least_overlap_on(share, found):
    """Mirror images base against base: spheres opposite each other overlap by the same length.

    The share is of the largest spheres, those of the middle, of radius r: they touch at 2 r.
    """
    mesh = single(EDGE)
    mirrored = checked_mesh(mesh.points * [-1.0, 1.0, 1.0], mesh.tetrahedra, {})
    looked = Looked(beside(mesh, mirrored, [1.0, 0.0, 0.0]))
    radius = looked.model.spheres.radius.max()
    position = looked.model.centre - np.outer([0.0, 1.0], [1.0 + share * 2.0 * radius, 0.0, 0.0])
    assert looked.pairs(position) == found


def quaternions(random, count):
    """Random orientations and their matrices."""
    turn = random.standard_normal((count, 4))
    turn /= np.linalg.norm(turn, axis=1, keepdims=True)
    w, x, y, z = turn.T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return turn, np.moveaxis(np.array(rows), -1, 0)


def overlaps_by_hand(looked, position, rotation, exposed):
    """All pairs of bodies with all their spheres, one by one; exposed: (n, 4), faces with some."""
    model, points = looked.model, looked.model.mesh.tetrahedra
    spheres = model.spheres
    sphere = np.concatenate([spheres.centre, spheres.radius[..., None]], axis=-1)
    bonded = (model.topology.body_bond >= 0) & ~exposed
    count = 0
    for i in range(model.body_count):
        for j in range(i + 1, model.body_count):
            seen = {True: False, False: False}
            for f, g in np.argwhere(~np.logical_or.outer(bonded[i], bonded[j])):
                here = position[i] + sphere[i, f, :, :3] @ rotation[i].T
                there = position[j] + sphere[j, g, :, :3] @ rotation[j].T
                away = np.linalg.norm(here[:, None] - there[None], axis=-1)
                reach = sphere[i, f, :, 3][:, None] + sphere[j, g, :, 3][None]
                close = bool((away < (1.0 - LEAST_OVERLAP) * reach).any())
                seen[bool(exposed[i, f] and exposed[j, g])] |= close
            strangers = not set(points[i]) & set(points[j])
            count += strangers and seen[False] and not seen[True]
    return count


@pytest.mark.parametrize("seed", range(3))
def test_pairs_are_those_of_a_search_by_hand(seed):
    """A heap of the pieces of two bars, all bonds broken: half of the faces carry spheres."""
    random = np.random.default_rng(seed)
    short = bar(0.2, 0.1, (2, 1, 1))
    looked = Looked(beside(short, short, [1.0, 0.0, 0.0]))
    model, state = looked.model, looked.state
    state.broken_tick.fill(0)
    exposed = model.topology.body_bond >= 0
    state.exposed_tick.from_numpy(np.where(exposed, 0, -1).astype(np.int64).ravel())
    position = 0.12 * random.random((model.body_count, 3))
    turn, rotation = quaternions(random, model.body_count)
    expected = overlaps_by_hand(looked, position, rotation, exposed)
    assert looked.pairs(position, turn) == expected > 0


def test_a_solid_in_one_piece_overlaps_nothing():
    """Pressed together by a tenth: bodies that share bonds, edges or corners are no strangers."""
    looked = Looked(bar(0.4, 0.1, (4, 1, 1)))
    assert looked.pairs(0.9 * looked.model.centre) == 0


def test_crushed_neighbours_are_left_to_the_spheres_of_their_broken_faces():
    looked = Looked(pair(EDGE))
    looked.state.broken_tick.fill(0)
    assert looked.pairs(0.3 * looked.model.centre) == 0


def test_finding_names_the_remedy_and_survives_a_checkpoint():
    """Body 1 is loose (fragments of equal size: the first counts as the main one)."""
    looked = Looked(TWO)

    def watching():
        outer = looked.simulation.outer_overlaps
        return MissingEffects(looked.model, looked.state, looked.simulation.readings, None, outer)

    watch = watching()
    watch.sample(0.0)
    assert not [found for found in watch.findings() if "outer" in str(found)]
    first = looked.model.centre[0]
    looked.state.set_motion(np.array([first, first + 1e-3]), np.tile([1.0, 0, 0, 0], (2, 1)))
    watch.sample(2e-6)
    (found,) = watch.findings()[-1:]
    assert str(found).startswith("SphereContact(outer_faces=True) is left out, but pairs of bodies")
    assert "up to 1 at a time, first at t = 2e-06 s (body 1 at " in str(found)
    assert "seen at 1 of 2 recordings" in str(found)
    again = watching()
    again.resume(watch.saved())
    assert again.findings() == watch.findings()


@pytest.mark.parametrize(
    ("mesh", "listed"),
    [
        (TWO, [effects.SphereContact(outer_faces=True)]),
        (pair(EDGE), []),
        (bar(0.2, 0.1, (2, 1, 1)), []),
    ],
)
def test_nothing_is_looked_for_where_outer_faces_carry_spheres_or_the_solid_is_one(mesh, listed):
    made = Simulation(Scene(mesh, CONCRETE, listed), Uniform())
    watch = MissingEffects(made.model, made.state, made.readings, None, made.outer_overlaps)
    assert watch.outer_faces is None


def test_two_blocks_that_meet_in_a_run_are_reported():
    """They close 0.1 mm at 1000 m/s in 1e-7 s, and are 1.9 mm within each other 1.9e-6 s later."""
    gap = 1e-4
    mirrored = checked_mesh(single(EDGE).points * [-1.0, 1.0, 1.0], single(EDGE).tetrahedra, {})
    mesh = beside(single(EDGE), mirrored, [gap, 0.0, 0.0])
    scene = Scene(mesh, CONCRETE, [effects.SphereContact(3)])
    simulation = Simulation(scene, Uniform(1e-7))
    still = np.tile([1.0, 0.0, 0.0, 0.0], (2, 1))
    simulation.state.set_motion(simulation.model.centre, still, [[0.0] * 3, [-1000.0, 0.0, 0.0]])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        simulation.advance_to(20)
        simulation.sample()
    (need,) = simulation.report().needs
    assert "SphereContact(outer_faces=True) is left out" in need and "seen at 1 of 2" in need
