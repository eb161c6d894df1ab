"""Pairs that stay near keep their memory through every search; room of others serves again."""

import numpy as np
import pytest
import taichi as ti

from taichi_dem import CONCRETE, Scene, Uniform
from taichi_dem.kit.allocation import assign, values
from taichi_dem.mesh.shapes import bar
from tests.again import Again
from tests.unit.test_contact_search import Marked, near_slots, slot_of_pair

#: Scale of the motion by which bodies come near and part [m]; the skin is a twentieth of it.
SPREAD = 0.02


@ti.data_oriented
class Thrown:
    """A bar of loose bodies that are put somewhere else again and again."""

    def __init__(self):
        scene = Scene(bar(0.6, 0.2, (6, 2, 2)), CONCRETE, [Marked(outer_faces=True)])
        self.again = Again(scene, Uniform(1e-9))
        self.simulation, self.state = self.again.simulation, self.again.state
        self.store, self.law = self.simulation.contacts.store, self.simulation.tables.contact
        self.fields = self.law.vector, self.law.of_spheres
        self.first_place = self.simulation.model.centre
        assign(self.simulation.contacts.skin, SPREAD / 20)

    def start(self):
        """Break all bonds, let all faces carry spheres, and search anew."""
        self.again.restart(1e-9)
        assign(self.state.broken_tick, 0)
        assign(self.state.exposed_tick, 0)
        self.state.injected_tick[None] = 0
        self.again.search_anew()

    def throw(self, seed, share=1.0, spread=SPREAD):
        """Move a share of the bodies to random places near where they began, and search."""
        random, motion = np.random.default_rng(seed), self.state.motion()
        count = len(self.first_place)
        moved = random.permutation(count) < share * count
        way = spread * random.standard_normal(self.first_place.shape)
        place = np.where(moved[:, None], self.first_place + way, motion["position"])
        self.state.set_motion(place, motion["orientation"])
        self.simulation.broad_phase.search()

    def spheres(self):
        """Places of the sphere pairs of the near pairs, by spheres."""
        first, last = values(self.store.first), values(self.store.last)
        places = [k for p in near_slots(self.store) for k in range(first[p], last[p])]
        return {
            tuple(pair): k for pair, k in zip(values(self.store.sphere, places).tolist(), places)
        }

    @ti.kernel
    def pack(self):
        """Pack the sphere pairs."""
        for _ in range(1):
            self.store.pack_spheres()

    def mark(self):
        """Give all columns of what is near numbers that tell the pair; they by pair, by spheres."""
        pairs, spheres = slot_of_pair(self.store), self.spheres()
        vector, of_spheres = self.columns()
        for (i, j), p in pairs.items():
            vector[p] = [i, j, 1.0]
        for (a, b), k in spheres.items():
            of_spheres[k] = 10000 * a + b
        for field, array in zip(self.fields, (vector, of_spheres)):
            assign(field, array)
        return pairs, spheres

    def columns(self):
        """The columns as arrays."""
        return [values(field) for field in self.fields]


@pytest.fixture(scope="module")
def thrown():
    """One for all tests, compiled once."""
    return Thrown()


@pytest.mark.parametrize("share", [0.05, 1.0])
def test_pairs_keep_their_slots_and_columns(thrown, share):
    """Whether few bodies are listed anew or all: new pairs begin with zeros, also those that left.

    No two near pairs share a slot, whatever has been freed.
    """
    thrown.start()
    stayed, came, left = 0, 0, set()
    for seed in range(12):
        before, _ = thrown.mark()
        thrown.throw(seed, share)
        after = slot_of_pair(thrown.store)
        assert len(set(after.values())) == len(after)
        left |= set(before) - set(after)
        vector, _ = thrown.columns()
        for pair, p in after.items():
            assert before.get(pair, p) == p
            assert vector[p].tolist() == ([*pair, 1.0] if pair in before else [0.0] * 3)
        stayed += len(set(before) & set(after))
        came += len(left & (set(after) - set(before)))
    assert stayed > 100 and came > 5


@pytest.mark.parametrize("packed", [False, True])
def test_sphere_pairs_that_stay_keep_their_columns(thrown, packed):
    """Matched by their spheres, wherever these lie after a search, packed or not."""
    thrown.start()
    stayed, came, moved = 0, 0, 0
    for seed in range(8):
        _, before = thrown.mark()
        if packed:
            thrown.pack()
            assert thrown.store.sphere_end[None] == len(before)
        thrown.throw(seed, 0.1, 0.1 * SPREAD)
        after, of_spheres = thrown.spheres(), thrown.columns()[1]
        for (a, b), k in after.items():
            wanted = 10000 * a + b if (a, b) in before else 0
            assert of_spheres[k] == wanted
        stayed += len(set(before) & set(after))
        came += len(set(after) - set(before))
        moved += sum(before.get(spheres, k) != k for spheres, k in after.items())
    assert stayed > 1000 and came > 100 and moved > 100


def test_slots_that_are_freed_serve_again(thrown):
    """Each near pair has a slot and no other pair has; the most at a time are all that are used."""
    thrown.start()
    most = 0
    for seed in range(20):
        thrown.throw(seed)
        near = int(thrown.store.near_count[None])
        most = max(most, near)
        assert thrown.store.used_end[None] - thrown.store.free_count[None] == near
    assert most <= thrown.store.used_end[None] <= 2 * most
