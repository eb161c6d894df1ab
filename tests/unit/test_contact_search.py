"""The contact search against all pairs compared with all."""

from functools import cache

import numpy as np
import pytest
import taichi as ti

from taichi_dem import CONCRETE, Scene, Uniform, effects
from taichi_dem.kit.allocation import assign, values
from taichi_dem.mesh.shapes import bar
from tests.again import Again

DT = 1e-9


@cache
def loose(law):
    """A bar to be thrown about."""
    return Again(Scene(bar(0.6, 0.2, (6, 2, 2)), CONCRETE, [law()]), Uniform(DT))


def scattered(skin, spread, law=effects.SphereContact):
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
    motion, sphere = simulation.state.motion(), simulation.values(simulation.tables.geometry.sphere)
    size = simulation.model.geometry.face_spheres
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


def lossy():
    """A law that takes three quarters of k d^2 / 2 at once and stores the rest."""
    return effects.WaltonBraun(0.5, geometry=effects.SphereGeometry())


@pytest.mark.parametrize("law", [effects.SphereContact, lossy])
def test_a_break_injects_the_energy_of_the_overlaps_that_it_brings_once(law):
    """Faces that break now bring k d^2 / 2 an overlap; a second search at the tick nothing."""
    simulation = scattered(2e-4, 0.02, law)
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


@ti.kernel
def _gaps(contacts: ti.template(), gaps: ti.types.ndarray(dtype=ti.f64, ndim=2)):
    for i, j in gaps:
        if i < j:
            gaps[i, j] = contacts.gap(i, j, i, j)


def overlapping(simulation):
    """Pairs of bodies without a bond that overlap and have a corner on a free face each."""
    corner = simulation.model.mesh.tetrahedra
    shown = simulation.values(simulation.state.exposed_tick).reshape(-1, 4) >= 0
    opposite = ~np.eye(4, dtype=bool)
    on_free = np.unique(corner[:, None].repeat(4, 1)[shown[..., None] & opposite])
    free = np.isin(corner, on_free).any(axis=1)
    gaps = np.ones((len(corner), len(corner)))
    _gaps(simulation.contacts, gaps)
    top, holds = simulation.model.topology, ~simulation.state.broken()
    meets = np.outer(free, free) & (gaps < 0.0)
    meets[tuple(np.sort([top.master[holds], top.slave[holds]], axis=0))] = False
    return set(zip(*np.nonzero(meets)))


@pytest.mark.parametrize("law", [effects.SphereContact, effects.BodyContact])
def test_all_that_touches_is_listed_however_seldom_a_pair_is_looked_at(law):
    """Bodies drift and turn, each its own way, by up to a share of the skin between two searches.

    A search leaves out the pairs that cannot meet yet, by how far their bodies have gone; half the
    skin is what a body may go before the next one.
    """
    skin, far, turn, random = 2e-3, 0.2, 5e-4, np.random.default_rng(0)
    simulation = scattered(skin, 0.03, law)
    contacts, motion = simulation.contacts, simulation.state.motion()
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
        if law is effects.BodyContact:
            store = contacts.store
            near = {tuple(pair) for pair in values(store.body, near_slots(store)).tolist()}
            met.append(overlapping(simulation))
        else:
            near = set(listed(simulation))
            met.append(expected(simulation, 0.0))
        assert met[-1] <= near
        simulation.broad_phase.search(everywhere=False)
    assert len(set().union(*met) - met[0]) > 20


def test_a_pair_in_which_impulses_wait_keeps_its_slot_though_it_moves_apart():
    """And all others leave theirs."""
    simulation, random = scattered(1e-3, 0.02), np.random.default_rng(0)
    store, slots = simulation.contacts.store, near_slots(simulation.contacts.store)
    kept, bodies = slots[::2], values(store.body, slots[::2])
    impulse = np.zeros((store.slots, 2, 6))
    impulse[kept] = random.standard_normal((len(kept), 2, 6))
    assign(store.impulse, impulse.reshape(-1, 6))
    assign(store.waiting, impulse.any(axis=2))
    centre = simulation.model.centre
    simulation.state.set_motion(centre + 1e3 * random.standard_normal(centre.shape), None)
    simulation.broad_phase.search()
    assert sorted(near_slots(store)) == sorted(kept)
    assert np.array_equal(values(store.body, kept), bodies)
    assert np.array_equal(values(store.impulse).reshape(impulse.shape)[kept], impulse[kept])
