"""What a run says of effects that were left out: where they would have acted, and nothing else."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from taichi_dem import CONCRETE, Multirate, Scene, Simulation, Uniform, checked_mesh, effects, join
from taichi_dem.diagnostics.missing_effects import (
    LEAST_OVERLAP,
    MissingEffects,
    bond_rounding,
    unserved,
)
from taichi_dem.diagnostics.shared_volume import SharedVolume
from taichi_dem.engine.model import Model
from taichi_dem.mesh.contact_spheres import spheres_of_faces
from taichi_dem.mesh.shapes import bar, pair, single
from tests.probe import BondProbe
from tests.scenes import apart, beside, quaternions
from tests.unit.test_shared_volume import common_volume

EDGE, STEP = 0.05, 1e-7
TWO = beside(single(EDGE), single(EDGE), [1.0, 0.0, 0.0])
LOSSLESS = replace(CONCRETE, normal_damping=0.0, shear_damping=0.0, friction=0.0)
BONDS = (effects.BondDamping(), effects.Softening(), effects.ShearSlip())


class Watched:
    """Bodies of a mesh that are put anywhere, and looked at; no step is compiled."""

    def __init__(self, mesh, *listed, material=CONCRETE):
        self.simulation = Simulation(Scene(mesh, material, listed), Uniform(STEP))
        self.model, self.state = self.simulation.model, self.simulation.state
        self.simulation._open_balance()
        self.watch = self.simulation.missing_effects

    def look(self, position, orientation=None, time_s=1e-6):
        """Findings by need, of bodies at a position [m], (n, 3), as at the end of a run."""
        self.state.set_motion(position, orientation)
        self.simulation.shared_volume.sample(time_s, finished=True)
        self.watch._see_bodies(self.watch.needed, self.watch.volume, time_s)
        self.watch.sample(time_s)
        return {name: found for name, found in self.watch.needed.items() if found.count}

    def findings(self):
        """What a report would say."""
        return self.watch.findings()


@pytest.mark.parametrize(
    ("material", "listed", "needs"),
    [
        (CONCRETE, [], {"tension", "shear", "dashpot", "contact", "bodies"}),
        (LOSSLESS, [], {"tension", "shear", "contact", "bodies"}),
        (replace(LOSSLESS, shear_damping=1.0), BONDS[1:], {"dashpot", "contact", "bodies"}),
        (CONCRETE, BONDS, {"contact", "bodies"}),
        (CONCRETE, [*BONDS, effects.SphereContact()], {"friction"}),
        (CONCRETE, [*BONDS, effects.SphereContact(outer_faces=False)], {"friction", "bare"}),
        (LOSSLESS, [*BONDS, effects.SphereContact()], set()),
        (CONCRETE, [*BONDS, effects.SphereContact(), effects.Friction()], {"creep"}),
        (CONCRETE, [*BONDS, effects.SphereContact(), effects.StickingFriction()], set()),
        (CONCRETE, [effects.Softening().silent(), *BONDS[::2]], {"tension", "contact", "bodies"}),
    ],
)
def test_an_effect_is_watched_for_only_where_none_serves_the_material(material, listed, needs):
    assert set(unserved(Model(pair(), material, listed))) == needs


#: How far the second body is from where it covers the first [m], and whether their spheres touch.
SHIFTS = {
    "apart": ([2.0 * EDGE, 0.0, 0.0], 0),
    "flying past": ([0.0, 1.001 * EDGE, 0.0], 0),
    "through each other": ([0.1 * EDGE, 0.0, 0.0], 1),
    "on the same place": ([0.0, 0.0, 0.0], 1),
}


@pytest.mark.parametrize("name", SHIFTS)
@pytest.mark.parametrize("listed", [(), (effects.SphereContact(3, outer_faces=False),)])
def test_bodies_within_each_other_are_found_and_nearness_is_not(name, listed):
    shift, expected = SHIFTS[name]
    looked = Watched(TWO, *listed)
    first = looked.model.centre[0]
    found = looked.look(np.array([first, first + shift]))
    assert {need: one.count for need, one in found.items()} == (
        {"bare" if listed else "bodies": 1} if expected else {}
    )


@pytest.mark.parametrize("share, found", [(0.0, 0), (0.5 * LEAST_OVERLAP, 0), (1e-2, 1)])
def test_face_to_face_counts_from_the_least_overlap_on(share, found):
    """Mirror images base against base: spheres opposite each other overlap by the same length.

    The share is of the largest spheres, those of the middle, of radius r: they touch at 2 r.
    """
    mesh = single(EDGE)
    mirrored = checked_mesh(mesh.points * [-1.0, 1.0, 1.0], mesh.tetrahedra, {})
    contact = effects.SphereContact(3, outer_faces=False)
    looked = Watched(beside(mesh, mirrored, [1.0, 0.0, 0.0]), contact)
    radius = looked.model.spheres.radius.max()
    position = looked.model.centre - np.outer([0.0, 1.0], [1.0 + share * 2.0 * radius, 0.0, 0.0])
    assert len(looked.look(position)) == found


def touching_by_hand(model, divisions, position, rotation, bare):
    """Pairs of bodies whose spheres overlap, one by one; bare: where one is on an outer face."""
    spheres = spheres_of_faces(model.mesh, model.centre, divisions)
    outer = np.repeat(model.topology.body_bond < 0, spheres.per_face, axis=1)
    places, radii = [], spheres.radius.reshape(model.body_count, -1)
    for i in range(model.body_count):
        places.append(position[i] + spheres.centre[i].reshape(-1, 3) @ rotation[i].T)
    count = 0
    for i in range(model.body_count):
        for j in range(i):
            away = np.linalg.norm(places[i][:, None] - places[j][None], axis=-1)
            hit = away < (1.0 - LEAST_OVERLAP) * (radii[i][:, None] + radii[j][None])
            if bare:
                hit &= np.logical_or.outer(outer[i], outer[j])
            count += hit.any()
    return count


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("bare", [False, True])
def test_pairs_are_those_of_a_search_over_all_spheres(seed, bare):
    """A heap of the pieces of two bars, all bonds broken, with contact of broken faces or none.

    Spheres lie in their bodies, so that pairs of which some touch are within each other.
    """
    random = np.random.default_rng(seed)
    short = bar(0.2, 0.1, (2, 1, 1))
    contact = [effects.SphereContact(3, outer_faces=False)] * bare
    looked = Watched(beside(short, short, [1.0, 0.0, 0.0]), *contact)
    looked.state.broken_tick.fill(0)
    position = 0.12 * random.random((looked.model.body_count, 3))
    turn, rotation = quaternions(random, looked.model.body_count)
    expected = touching_by_hand(looked.model, 3 if bare else 5, position, rotation, bare)
    found = looked.look(position, turn)["bare" if bare else "bodies"]
    assert found.count == expected > 0


@pytest.mark.parametrize("listed", [(), (effects.SphereContact(3, outer_faces=False),)])
def test_a_solid_in_one_piece_overlaps_nothing(listed):
    """Pressed together by a tenth: faces that bonds hold together carry no spheres."""
    looked = Watched(bar(0.4, 0.1, (4, 1, 1)), *listed)
    assert not {"bodies", "bare"} & set(looked.look(0.9 * looked.model.centre))


def test_crushed_neighbours_overlap_where_their_bond_was_released():
    without = Watched(pair(EDGE))
    without.state.broken_tick.fill(0)
    assert {"bodies", "contact"} <= set(without.look(0.98 * without.model.centre))


def test_finding_names_remedy_place_and_time_and_survives_a_checkpoint():
    looked = Watched(TWO, effects.SphereContact(3, outer_faces=False))
    assert looked.look(looked.model.centre, time_s=0.0) == {}
    first = looked.model.centre[0]
    looked.look(np.array([first, first + 1e-3]), time_s=2e-6)
    looked.look(np.array([first, first + 0.03]), time_s=3e-6)
    (found,) = looked.findings()
    assert str(found).startswith("SphereContact(outer_faces=True) is left out, but pairs of bodies")
    assert "within each other at outer faces without spheres: 1, first body 0 at " in str(found)
    assert str(found).endswith("t = 2e-06 s")
    assert found.place_m == pytest.approx(tuple(looked.model.centre[0]))
    made = looked.simulation
    volume = SharedVolume(made.model, made.state)
    again = MissingEffects(made.model, made.state, made.readings, volume, made.schedule)
    assert again.findings(volume) == ()
    again.resume(looked.watch.saved())
    assert again.findings(volume) == (found,) and again.leap == looked.watch.leap


@pytest.mark.parametrize(
    ("mesh", "listed", "way", "told"),
    [
        (TWO, (), 1.5, True),
        (TWO, (), 0.9, False),
        (TWO, (effects.SphereContact(3, outer_faces=False),), 1.5, True),
        (TWO, (effects.SphereContact(3),), 1.5, False),
        (pair(EDGE), (), 1.5, False),
    ],
)
def test_a_leap_in_which_bodies_may_have_passed_each_other_is_told(mesh, listed, way, told):
    """More than a radius between two looks, where nothing keeps loose pieces apart."""
    looked = Watched(mesh, *listed)
    shift = [0.0, way * looked.model.body_radius[0], 0.0]
    moved = np.outer([0.0, 1.0], shift) if mesh is TWO else shift
    looked.state.set_motion(looked.model.centre + moved)
    looked.watch.sample(1e-6)
    sentences = looked.watch.unseen()
    assert len(sentences) == told
    assert all(f"moved up to {way:.2g} times their radius" in words for words in sentences)


def passed(probe):
    return [tick >= 0 for tick in probe.state.passed.to_numpy()[0]]


@pytest.mark.parametrize(
    ("pull", "slide", "expected"),
    [
        # Shares of the strength, and of the cohesion; friction lowers the limit in tension.
        (0.999, 0.0, [False, False]),
        (1.001, 0.0, [True, False]),
        (0.0, 0.999, [False, False]),
        (0.0, 1.001, [False, True]),
        (-1.0, 1.57, [False, False]),
        (-1.0, 1.59, [False, True]),
        (0.5, 0.72, [False, True]),
        (0.5, 0.70, [False, False]),
    ],
)
def test_limits_are_those_of_the_laws(pull, slide, expected):
    """Tension and slip are noted where Softening and ShearSlip would have acted, unit by unit.

    Strength and cohesion of concrete are one number; the limit in shear is c - 0.58 of the pull.
    """
    strength = CONCRETE.tensile_strength
    tractions = strength * np.array([pull, slide, 0.0])
    probe = BondProbe(pair(EDGE), [])
    opening = tractions / probe.model.bond_stiffness[0][[0, 1, 1]]
    probe.open(opening)
    assert passed(probe) == expected
    acting = BondProbe(pair(EDGE), [effects.Softening(), effects.ShearSlip()])
    acting.open(opening)
    assert list(acting.simulation.readings.active_bonds()[0]) == expected
    assert passed(acting) == [False, False]


@pytest.mark.parametrize("method", [Uniform(STEP), Multirate(STEP)], ids=lambda m: m.name)
def test_a_limit_passed_between_two_samples_is_seen(method):
    """A bond is pulled past its strength and pushed back; at both samples it holds little.

    The pull lasts half a period of 1e-5 s; in between it opens by v / (pi f), five times its onset.
    """
    way = 5.0 * CONCRETE.onset_opening
    move = effects.PrescribedMotion("right", (np.pi * 1e5 * way, 0.0, 0.0), 1e5)
    simulation = Simulation(Scene(pair(EDGE), CONCRETE, [effects.Fixed("left"), move]), method)
    simulation.advance_to(100)
    simulation.sample()
    found = {one.effect: one for one in simulation.report().missing_effects}
    assert found["Softening"].count == 1 and 0.0 < found["Softening"].first_s < 5e-6
    assert simulation.missing_effects.strain[0] < 1e-2


def test_damping_is_missed_only_where_bonds_strain_beyond_rounding():
    """At rest, wherever the solid lies; and hung up by one end."""
    away = bar(0.5, 0.1, (5, 1, 1))
    away = checked_mesh(away.points + 100.0, away.tetrahedra, away.groups)
    for listed, missed in (
        ((), ()),
        ((effects.Fixed("left"), effects.Gravity()), ("BondDamping",)),
    ):
        simulation = Simulation(Scene(away, CONCRETE, listed), Uniform(STEP))
        simulation.advance_to(1000)
        simulation.sample()
        assert tuple(m.effect for m in simulation.report().missing_effects) == missed


def test_bodies_that_moved_by_little_are_compared_at_the_end():
    """By a fiftieth of their size: not between samples, but before the report."""
    looked = Watched(pair(EDGE))
    looked.state.broken_tick.fill(0)
    looked.state.set_motion(0.98 * looked.model.centre)
    looked.watch.sample(1e-6)
    assert not looked.watch.needed["bodies"].count
    needed = {one.what: one for one in looked.simulation.report().missing_effects}
    assert needed["pairs of bodies are within each other"].count == 1


def test_nothing_is_missed_in_bodies_that_fly_apart():
    looked = Watched(apart(3, EDGE))
    assert looked.look(2.0 * looked.model.centre) == {}
    assert looked.findings() == ()


def test_rounding_of_a_bond_is_that_of_its_own_coordinates():
    """Bodies that have flown 10 km make no other bond rounder."""
    model = Model(join(pair(), pair().moved(by=(1.0, 0.0, 0.0))), CONCRETE, ())
    near, far = (model.centre + flown * (model.centre > 0.5) for flown in (0.0, 1e4))
    first, second = (
        bond_rounding(model, SimpleNamespace(position=SimpleNamespace(to_numpy=place.copy)), 1)
        for place in (near, far)
    )
    assert first[0] == second[0] and first[1] < 1e-6 * second[1]


@pytest.mark.parametrize("seed", range(4))
def test_released_bonds_are_named_where_their_bodies_share_volume_and_nowhere_else(seed):
    """Two bodies in drawn poses, against the exact intersection of both; one may have turned."""
    random, counts = np.random.default_rng(seed), [0, 0]
    looked = Watched(pair(EDGE))
    looked.state.broken_tick.fill(0)
    for _ in range(60):
        position = looked.model.centre + 0.4 * EDGE * random.standard_normal((2, 3))
        turn, rotation = quaternions(random, 2)
        arms = looked.watch.volume.arms
        first, second = position[:, None] + np.einsum("nij,ncj->nci", rotation, arms)
        looked.watch.needed = unserved(looked.model)
        found = looked.look(position, turn, time_s=random.random())
        meet = common_volume(first, second) > 0.0
        assert ("contact" in found) == meet
        counts[meet] += 1
    assert min(counts) > 10


def test_a_body_that_has_turned_its_back_on_its_neighbour_does_not_overlap_it():
    """By half a turn about z, so that its free corner points at the other, 4.9 mm away.

    Along its turned normal the mean opening of the released bond is 2 h / 4 + 4.9 mm, negative.
    """
    looked = Watched(pair(EDGE))
    looked.state.broken_tick.fill(0)
    height = EDGE * np.sqrt(2.0 / 3.0)
    back = np.array([[0.0, 0.0, 0.0, 1.0], [1.0, 0.0, 0.0, 0.0]])
    for gap, expected in ((4.9e-3, 0), (-4.9e-3, 1)):
        position = looked.model.centre + np.outer([0.0, 1.0], [0.5 * height + gap, 0.0, 0.0])
        found = looked.look(position, back, time_s=gap)
        assert found.get("contact", looked.watch.needed["contact"]).count == expected, gap
