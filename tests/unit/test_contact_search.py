"""The contact search against all pairs compared with all.

Pairs that stay near keep their memory through every search.
"""

from functools import cache
from itertools import product

import numpy as np
import pytest
import taichi as ti

from taichi_dem import CONCRETE, Scene, Uniform, effects
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


@cache
def loose(law):
    """A bar to be thrown about, of bodies that touch with spheres or whole."""
    return Again(Scene(bar(0.6, 0.2, (6, 2, 2)), CONCRETE, [law()]), Uniform(DT))


def scattered(skin, spread, law=Marked):
    """The bar, bodies thrown about by `spread` [m], half of its faces broken."""
    again, random = loose(law), np.random.default_rng(2)
    simulation = again.simulation
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


def spheres_now(simulation):
    """Of every sphere: its body, place and radius [m], and since which tick its face is free."""
    motion, sphere = simulation.state.motion(), simulation.values(simulation.tables.sphere)
    size = simulation.model.spheres.per_face
    body = np.arange(len(sphere)) // (4 * size)
    turned = np.einsum("nij,nj->ni", motion["rotation"][body], sphere[:, :3])
    place = turned + motion["position"][body]
    since = simulation.values(simulation.state.exposed_tick).repeat(size)
    return body, place, sphere[:, 3], since


def expected(simulation, skin):
    """Every pair of exposed spheres of two unbonded bodies with a gap below the skin [m]."""
    body, place, radius, since = spheres_now(simulation)
    top, shown = simulation.model.topology, np.flatnonzero(since >= 0)
    intact = ~simulation.state.broken()
    bonded = np.zeros((simulation.model.body_count,) * 2, dtype=bool)
    bonded[tuple(np.sort([top.master[intact], top.slave[intact]], axis=0))] = True
    pairs = set()
    for a in shown:
        later = shown[body[shown] > body[a]]
        later = later[~bonded[body[a], body[later]]]
        gap = np.linalg.norm(place[later] - place[a], axis=1) - radius[later] - radius[a]
        pairs |= {(int(a), int(b)) for b in later[gap < skin]}
    return pairs


def slot_of_pair(store):
    """Slots of the near pairs by their two bodies."""
    slots = near_slots(store)
    bodies = values(store.body, slots).tolist()
    return {tuple(pair): int(p) for pair, p in zip(bodies, slots)}


@pytest.mark.parametrize("spread", [0.01, 0.03, 0.1, 0.3])
def test_a_search_of_all_lists_the_spheres_nearer_than_the_skin_and_no_others(spread):
    simulation = scattered(2e-3, spread)
    assert sorted(listed(simulation)) == sorted(expected(simulation, 2e-3))


def overlap_energy(simulation, born_after):
    """Elastic energy [J] of the overlaps of listed spheres of which one is younger than a tick."""
    _, place, radius, since = spheres_now(simulation)
    a, b = np.array(listed(simulation)).T
    overlap = radius[a] + radius[b] - np.linalg.norm(place[b] - place[a], axis=1)
    overlap[np.maximum(since[a], since[b]) <= born_after] = 0.0
    return 0.5 * CONCRETE.contact_stiffness * (np.maximum(overlap, 0.0) ** 2).sum()


def test_a_break_injects_the_energy_of_the_overlaps_that_it_brings_once():
    """Faces that break now bring k d^2 / 2 an overlap; a second search at the tick nothing."""
    simulation = scattered(2e-4, 0.02)
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


@pytest.mark.parametrize("law", [Marked, effects.BodyContact])
def test_all_that_touches_is_listed_however_seldom_a_pair_is_looked_at(law):
    """Bodies drift and turn, each its own way, by up to a share of the skin between two searches.

    A search leaves out the pairs that cannot meet yet, by how far their bodies have gone; half the
    skin is what a body may go before the next one.
    """
    skin, far, turn, random = 2e-3, 0.2, 5e-4, np.random.default_rng(0)
    simulation = scattered(skin, 0.03, law)
    broad, contacts = simulation.broad_phase, simulation.contacts
    pairs = AllPairs(contacts, simulation.model.body_count) if law is not Marked else None
    motion = simulation.state.motion()
    way = random.standard_normal(motion["position"].shape)
    way *= far * skin * random.random((len(way), 1)) / np.linalg.norm(way, axis=1, keepdims=True)
    spin = turn * random.standard_normal(motion["orientation"].shape)
    extent = simulation.values(simulation.tables.extent)
    met, before = [], motion["orientation"]
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
        met.append(touching)
    assert len(set().union(*met) - met[0]) > 20


def spheres_of(store):
    """Places of the sphere pairs of the near pairs, by spheres."""
    first, last = values(store.first), values(store.last)
    places = [k for p in near_slots(store) for k in range(first[p], last[p])]
    return {tuple(pair): k for pair, k in zip(values(store.sphere, places).tolist(), places)}


def marked(simulation):
    """Give all that is near numbers that tell the pair, and every other pair waiting impulses.

    Pairs by bodies, sphere pairs by spheres.
    """
    store, law = simulation.contacts.store, simulation.tables.contact
    pairs, spheres = slot_of_pair(store), spheres_of(store)
    vector, of_spheres = values(law.vector), values(law.of_spheres)
    impulses = np.zeros((store.slots, 2, 6))
    for (i, j), p in pairs.items():
        vector[p] = [i, j, 1.0]
        impulses[p] = (p % 2) * pair_impulse(i, j)
    for (a, b), k in spheres.items():
        of_spheres[k] = 10000 * a + b
    assign(law.vector, vector)
    assign(law.of_spheres, of_spheres)
    assign(store.impulse, impulses.reshape(-1, 6))
    assign(store.waiting, impulses.any(axis=2))
    return pairs, spheres


def pair_impulse(i, j):
    """Impulses that wait in the slot of a pair, (2, 6)."""
    return np.random.default_rng((i, j)).standard_normal((2, 6))


@ti.kernel
def _pack(store: ti.template()):
    for _ in range(1):
        store.pack_spheres()


def thrown(simulation, random, share, way):
    """Throw a share of the bodies by a way [m], and search."""
    place = simulation.state.motion()["position"]
    far = way * random.standard_normal(place.shape)
    place = place + np.where(random.random((len(place), 1)) < share, far, 0.0)
    simulation.state.set_motion(place, simulation.state.motion()["orientation"])
    simulation.broad_phase.search()


def test_what_stays_near_or_waits_keeps_its_slot_and_all_that_it_remembers():
    """Whether few bodies are listed anew or all, by large ways or small, and lists are packed.

    New pairs begin with zeros, also those that left. No two near pairs share a slot. Sphere pairs
    are matched by their spheres, wherever these lie after a search.
    """
    simulation, stayed, moved = scattered(1e-3, 0.02), 0, 0
    store, law, left = simulation.contacts.store, simulation.tables.contact, set()
    random = np.random.default_rng(0)
    for share, way, packed in product((0.05, 1.0, 0.1), (0.01, 0.001), (False, True)):
        before = marked(simulation)
        if packed:
            _pack(store)
            assert store.sphere_end[None] == len(before[1])
        thrown(simulation, random, share, way)
        pairs, spheres = slot_of_pair(store), spheres_of(store)
        assert len({*pairs.values()}) == len(pairs)
        assert {pair for pair, p in before[0].items() if p % 2} <= {*pairs}
        vector, of_spheres = values(law.vector), values(law.of_spheres)
        impulses = values(store.impulse).reshape(-1, 2, 6)
        for pair, p in pairs.items():
            known = pair in before[0]
            assert before[0].get(pair, p) == p
            assert vector[p].tolist() == ([*pair, 1.0] if known else [0.0] * 3)
            assert np.array_equal(impulses[p], known * (p % 2) * pair_impulse(*pair))
        for (a, b), k in spheres.items():
            assert of_spheres[k] == (10000 * a + b if (a, b) in before[1] else 0)
        left |= {*before[0]} - {*pairs}
        stayed += len({*before[0]} & {*pairs})
        moved += sum(before[1].get(one, k) != k for one, k in spheres.items())
    assert stayed > 100 and left and moved
