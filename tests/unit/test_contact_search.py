"""The contact search against all pairs compared with all.

Pairs that stay near keep their memory through every search.
"""

from functools import cache

import numpy as np
import pytest
import taichi as ti

from taichi_dem import CONCRETE, Scene, Uniform, effects
from taichi_dem.contact.contacts import FARTHEST, STEPS
from taichi_dem.kit.allocation import FieldTree, assign, values
from taichi_dem.mesh.shapes import bar
from tests.again import Again

DT = 1e-9


@ti.data_oriented
class Marked(effects.SphereContact):
    """A contact law that declares a column of each kind."""

    def declare_columns(self, store):
        """Declare a vector of a pair, and a number of a sphere pair."""
        super().declare_columns(store)
        self.vector = store.column("arrow", ti.f64, 3)
        self.of_spheres = store.sphere_column("sphere_mark", ti.i32)


@pytest.fixture(scope="module")
def bars():
    """A bar to be thrown about, of bodies that touch with spheres or whole, each made once."""

    @cache
    def loose(law):
        return Again(Scene(bar(0.6, 0.2, (6, 2, 2)), CONCRETE, [law()]), Uniform(DT))

    return loose


@pytest.fixture
def again(bars):
    """One of bodies that touch with spheres."""
    return bars(Marked)


def scattered(again, skin, spread, seed=2):
    """Its simulation, bodies thrown about by `spread` [m], half of its faces broken."""
    simulation, random = again.simulation, np.random.default_rng(seed)
    model, state = simulation.model, simulation.state
    again.restart(DT)
    turn = random.standard_normal((model.body_count, 4))
    turn /= np.linalg.norm(turn, axis=1, keepdims=True)
    place = model.centre + spread * random.standard_normal((model.body_count, 3))
    state.set_motion(place, turn)
    broken = random.random(model.bond_count) < 0.5
    assign(state.broken_tick, np.where(broken, 0, -1))
    exposed = np.full(4 * model.body_count, -1, dtype=np.int64)
    exposed[simulation.values(simulation.tables.bond_slots)[broken].ravel()] = 0
    assign(state.exposed_tick, exposed)
    # What has been broken from the start injects nothing.
    state.injected_tick[None] = 0
    assign(simulation.contacts.skin, skin)
    again.search_anew()
    return simulation


def near_slots(store):
    """Slots of the near pairs in the order in which they are visited."""
    return values(store.near_slot, slice(int(values(store.near_count))))


def listed(simulation):
    """Sphere pairs in the lists of the search."""
    store = simulation.contacts.store
    spheres = values(store.sphere)
    first, last = values(store.first), values(store.last)
    parts = [spheres[first[p] : last[p]] for p in near_slots(store)]
    return [tuple(pair) for pair in np.concatenate(parts).tolist()]


def expected(simulation, skin):
    """Every pair of exposed spheres of two unbonded bodies with a gap below the skin [m]."""
    model, motion = simulation.model, simulation.state.motion()
    size, top = model.spheres.per_face, simulation.model.topology
    sphere = simulation.values(simulation.tables.sphere)
    body = np.arange(len(sphere)) // (4 * size)
    turned = np.einsum("nij,nj->ni", motion["rotation"][body], sphere[:, :3])
    place = turned + motion["position"][body]
    shown = np.flatnonzero(simulation.values(simulation.state.exposed_tick).repeat(size) >= 0)
    intact = simulation.values(simulation.state.broken_tick) < 0
    bonded = np.zeros((model.body_count,) * 2, dtype=bool)
    bonded[tuple(np.sort([top.master[intact], top.slave[intact]], axis=0))] = True
    pairs = set()
    for a in shown:
        later = shown[body[shown] > body[a]]
        later = later[~bonded[body[a], body[later]]]
        gap = np.linalg.norm(place[later] - place[a], axis=1) - sphere[later, 3] - sphere[a, 3]
        pairs |= {(int(a), int(b)) for b in later[gap < skin]}
    return pairs


def slot_of_pair(store):
    """Slots of the near pairs by their two bodies."""
    slots = near_slots(store)
    bodies = values(store.body, slots).tolist()
    return {tuple(pair): int(p) for pair, p in zip(bodies, slots)}


def test_waiting_impulses_survive_a_search(again):
    """They keep their bits, also when the pair has moved out of reach; a new pair has none."""
    simulation = scattered(again, 2e-4, 0.01)
    store = simulation.contacts.store
    before, impulses = slot_of_pair(store), np.zeros((store.slots, 2, 6))
    for p in before.values():
        impulses[p] = np.random.default_rng(p).standard_normal((2, 6))
    assign(store.impulse, impulses.reshape(-1, 6))
    assign(store.waiting, impulses.any(axis=2))
    motion = simulation.state.motion()
    motion["position"][::3] = np.roll(motion["position"][::3], 1, axis=0)
    simulation.state.set_motion(motion["position"], motion["orientation"])
    simulation.broad_phase.search()
    after, found = slot_of_pair(store), values(store.impulse).reshape(-1, 2, 6)
    assert set(before) < set(after)
    for pair, p in after.items():
        wanted = impulses[p] if pair in before else np.zeros((2, 6))
        assert np.array_equal(found[p], wanted)
        assert before.get(pair, p) == p


def overlap_energy(simulation, born_after):
    """Elastic energy [J] of the overlaps of listed spheres of which one is younger than a tick."""
    model, motion = simulation.model, simulation.state.motion()
    size, sphere = model.spheres.per_face, simulation.values(simulation.tables.sphere)
    exposed, energy = simulation.values(simulation.state.exposed_tick), 0.0
    for pair in listed(simulation):
        body = [one // (4 * size) for one in pair]
        place = [
            motion["position"][i] + motion["rotation"][i] @ sphere[one, :3]
            for i, one in zip(body, pair)
        ]
        gap = np.linalg.norm(place[1] - place[0]) - sphere[list(pair), 3].sum()
        if max(exposed[one // size] for one in pair) > born_after:
            energy += 0.5 * CONCRETE.contact_stiffness * max(0.0, -gap) ** 2
    return energy


def test_a_break_injects_the_energy_of_the_overlaps_that_it_brings_once(again):
    """Faces that break now bring k d^2 / 2 an overlap; a second search at the tick nothing."""
    simulation = scattered(again, 2e-4, 0.02)
    state, store = simulation.state, simulation.contacts.store
    assert not values(store.heat, near_slots(store)).any()
    exposed = simulation.values(state.exposed_tick)
    free = np.flatnonzero(exposed < 0)
    exposed[free[: len(free) // 2]] = 7
    assign(state.exposed_tick, exposed)
    state.tick[None] = 7
    simulation.broad_phase.search()
    wanted = overlap_energy(simulation, 0)
    assert 0.0 < wanted < 0.9 * overlap_energy(simulation, -1)
    for _ in range(2):
        injected = values(store.heat, near_slots(store))[:, 2].sum()
        assert injected == pytest.approx(wanted, rel=1e-9)
        simulation.broad_phase.search()


@ti.data_oriented
class AllPairs:
    """Overlaps of all pairs of bodies, by the law of their contact."""

    def __init__(self, contacts, count):
        self.contacts = contacts
        with FieldTree():
            self.reach = ti.field(ti.f64, shape=(count, count))

    @ti.kernel
    def find(self):
        """Overlap of body i with body j > i [m], negative without one."""
        for i, j in self.reach:
            if i < j:
                self.reach[i, j] = self.contacts.nearest(i, j, i, j).reach


def overlapping(simulation, pairs):
    """Pairs of bodies without a bond that overlap and have a corner on a free face each."""
    corner = simulation.model.mesh.tetrahedra
    shown = simulation.values(simulation.state.exposed_tick).reshape(-1, 4) >= 0
    opposite = ~np.eye(4, dtype=bool)
    on_free = np.unique(corner[:, None].repeat(4, 1)[shown[..., None] & opposite])
    free = np.isin(corner, on_free).any(axis=1)
    pairs.find()
    top, holds = simulation.model.topology, ~simulation.state.broken()
    meets = np.triu(np.outer(free, free)) & (values(pairs.reach) > 0.0)
    bonded = np.sort([top.master[holds], top.slave[holds]], axis=0)
    meets[tuple(bonded)] = False
    return set(zip(*np.nonzero(meets)))


@pytest.mark.parametrize(
    ("law", "seed"), [(Marked, 0), (Marked, 1), (effects.BodyContact, 0), (effects.BodyContact, 1)]
)
def test_all_that_touches_is_listed_however_seldom_a_pair_is_looked_at(bars, law, seed):
    """Bodies drift and turn, each its own way, by up to a share of the skin between two searches.

    A search leaves out the pairs that cannot meet yet, by how far their bodies have gone; half the
    skin is what a body may go before the next one. A search of all lists all spheres nearer than
    the skin, and no others.
    """
    skin, far, turn, random = 2e-3, 0.2, 5e-4, np.random.default_rng(seed)
    simulation = scattered(bars(law), skin, 0.03, seed)
    broad, contacts = simulation.broad_phase, simulation.contacts
    pairs = None
    if contacts.law.meets_bodies:
        pairs = AllPairs(contacts, simulation.model.body_count)
    else:
        assert sorted(listed(simulation)) == sorted(expected(simulation, skin))
    motion = simulation.state.motion()
    way = random.standard_normal(motion["position"].shape)
    way *= far * skin * random.random((len(way), 1)) / np.linalg.norm(way, axis=1, keepdims=True)
    spin = turn * random.standard_normal(motion["orientation"].shape)
    extent = simulation.values(simulation.tables.extent)
    found, before = [], motion["orientation"]
    for step in range(1, 61):
        turned = motion["orientation"] + step * spin
        turned /= np.linalg.norm(turned, axis=1, keepdims=True)
        simulation.state.set_motion(motion["position"] + step * way, turned)
        angle = 2.0 * np.linalg.norm(turned - before, axis=1)
        before = turned
        path = simulation.values(contacts.path) + np.linalg.norm(way, axis=1) + extent * angle
        assign(contacts.path, np.where(simulation.values(contacts.free) == 1, path, 0.0))
        if pairs:
            touching, near = overlapping(simulation, pairs), slot_of_pair(contacts.store)
        else:
            touching, near = expected(simulation, 0.0), listed(simulation)
        assert touching <= set(near)
        broad.search(everywhere=False)
        found.append(len(touching))
    assert max(found) > min(found) + 20


def test_a_fast_body_has_a_skin_for_some_steps(again):
    """Each goes STEPS largest steps at its speed, spin included, between half a skin and a cap."""
    skin, random = 2e-3, np.random.default_rng(3)
    simulation = scattered(again, skin, 0.03)
    contacts, count = simulation.contacts, simulation.model.body_count
    motion, extent = simulation.state.motion(), simulation.values(simulation.tables.extent)
    fast = 10.0 ** random.uniform(4, 6.5, (2, count, 1)) * random.standard_normal((2, count, 3))
    simulation.state.set_motion(motion["position"], motion["orientation"], *fast)
    simulation.broad_phase.search()
    velocity, spin = np.linalg.norm(fast, axis=2)
    way = STEPS * simulation.schedule.dt0 * (velocity + spin * extent)
    wanted = np.maximum(0.5 * skin, np.minimum(way, FARTHEST * extent))
    exposed = simulation.values(contacts.free) == 1
    found = simulation.values(contacts.body_skin)
    assert found[exposed] == pytest.approx(wanted[exposed], rel=1e-12)
    for low, high in [(0.0, 0.6 * skin), (0.6 * skin, 0.24 * extent), (0.24 * extent, np.inf)]:
        assert ((found >= low) & (found < high) & exposed).sum() > 10


def spheres_of(store):
    """Places of the sphere pairs of the near pairs, by spheres."""
    first, last = values(store.first), values(store.last)
    places = [k for p in near_slots(store) for k in range(first[p], last[p])]
    return {tuple(pair): k for pair, k in zip(values(store.sphere, places).tolist(), places)}


def marked(simulation):
    """Give all columns of what is near numbers that tell the pair; they by pair, by spheres."""
    store, law = simulation.contacts.store, simulation.tables.contact
    pairs, spheres = slot_of_pair(store), spheres_of(store)
    vector, of_spheres = values(law.vector), values(law.of_spheres)
    for (i, j), p in pairs.items():
        vector[p] = [i, j, 1.0]
    for (a, b), k in spheres.items():
        of_spheres[k] = 10000 * a + b
    assign(law.vector, vector)
    assign(law.of_spheres, of_spheres)
    return pairs, spheres


@ti.kernel
def _pack(store: ti.template()):
    for _ in range(1):
        store.pack_spheres()


@pytest.mark.parametrize(("share", "way"), [(0.05, 1.0), (1.0, 1.0), (0.1, 0.1)])
@pytest.mark.parametrize("packed", [False, True])
def test_what_stays_near_keeps_its_slot_and_its_columns(again, share, way, packed):
    """Whether few bodies are listed anew or all, by large ways or small, and lists are packed.

    New pairs begin with zeros, also those that left. No two near pairs share a slot. Sphere pairs
    are matched by their spheres, wherever these lie after a search.
    """
    simulation, stayed, moved = scattered(again, 1e-3, 0.02), 0, 0
    store, law, left = simulation.contacts.store, simulation.tables.contact, set()
    for seed in range(6):
        before = marked(simulation)
        if packed:
            _pack(store)
            assert store.sphere_end[None] == len(before[1])
        random, motion = np.random.default_rng(seed), simulation.state.motion()
        thrown = random.random(len(motion["position"])) < share
        place = motion["position"] + 0.01 * way * random.standard_normal((len(thrown), 3))
        place = np.where(thrown[:, None], place, motion["position"])
        simulation.state.set_motion(place, motion["orientation"])
        simulation.broad_phase.search()
        pairs, spheres = slot_of_pair(store), spheres_of(store)
        assert len({*pairs.values()}) == len(pairs)
        vector, of_spheres = values(law.vector), values(law.of_spheres)
        for pair, p in pairs.items():
            assert before[0].get(pair, p) == p
            assert vector[p].tolist() == ([*pair, 1.0] if pair in before[0] else [0.0] * 3)
        for (a, b), k in spheres.items():
            assert of_spheres[k] == (10000 * a + b if (a, b) in before[1] else 0)
        left |= {*before[0]} - {*pairs}
        stayed += len({*before[0]} & {*pairs})
        moved += sum(before[1].get(one, k) != k for one, k in spheres.items())
    assert stayed > 100 and left and moved
