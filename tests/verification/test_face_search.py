"""The search for spheres near faces, against all compared with all in NumPy."""

import numpy as np
import pytest

from taichi_dem import CONCRETE, Scene, Uniform, effects
from taichi_dem.kit.allocation import assign, values
from taichi_dem.mesh.shapes import bar
from taichi_dem.mesh.tetrahedra import all_faces
from tests.again import Again
from tests.faces import triangle_distance
from tests.unit.test_broad_phase import DT, listed, near_slots, scattered


@pytest.fixture(scope="module")
def again():
    """A bar, to be thrown about."""
    contact = effects.FaceContact(spheres_per_body=4000, pairs_per_body=60)
    return Again(Scene(bar(0.6, 0.2, (6, 2, 2)), CONCRETE, [contact]), Uniform(DT))


def expected(simulation, skin):
    """Every exposed sphere and exposed face of two unbonded bodies nearer than the skin [m]."""
    model, motion = simulation.model, simulation.state.motion()
    size, count = model.spheres.per_face, model.body_count
    sphere = simulation.values(simulation.tables.sphere)[: 4 * size * count]
    owner = np.arange(len(sphere)) // (4 * size)
    place = np.einsum("nij,nj->ni", motion["rotation"][owner], sphere[:, :3])
    place += motion["position"][owner]
    free = simulation.values(simulation.state.exposed_tick)[: 4 * count] >= 0
    corners = model.mesh.points[all_faces(model.mesh.tetrahedra)].reshape(count, 12, 3)
    corners = np.einsum("nij,nkj->nki", motion["rotation"], corners - model.centre[:, None])
    corners = (corners + motion["position"][:, None]).reshape(-1, 3, 3)
    intact = simulation.values(simulation.state.broken_tick)[: model.bond_count] < 0
    top = model.topology
    bonded = {frozenset(pair) for pair in zip(top.master[intact], top.slave[intact])}
    shown = np.flatnonzero(free.repeat(size))
    pairs = set()
    for face in np.flatnonzero(free):
        gap = triangle_distance(place[shown], corners[face]) - sphere[shown, 3]
        for a in shown[gap < skin]:
            if owner[a] != face // 4 and frozenset((owner[a], face // 4)) not in bonded:
                entry = (int(a), -1 - int(face))
                pairs.add(entry if owner[a] < face // 4 else entry[::-1])
    return pairs


def test_the_search_lists_all_spheres_near_faces_and_no_others(again):
    simulation = scattered(again, 3e-3, 0.03)
    found, wanted = listed(simulation), expected(simulation, 3e-3)
    assert len(wanted) > 200
    assert len(found) == len(set(found))
    assert set(found) == wanted


def test_a_break_injects_the_energy_of_the_overlaps_that_it_brings_once(again):
    """Faces that break now bring what they overlap; a second search at the tick nothing."""
    simulation = scattered(again, 2e-4, 0.02)
    state, store = simulation.state, simulation.contacts.store
    simulation.start()
    exposed = simulation.values(state.exposed_tick)
    assign(state.exposed_tick, -1)
    again.search_anew()
    before = simulation.energy_balance.account()
    assert before["sphere_strain"] == 0.0
    assign(state.exposed_tick, np.where(exposed >= 0, 7, -1))
    state.tick[None] = 7
    for _ in range(2):
        simulation.broad_phase.search()
        after = simulation.energy_balance.account()
        injected = after["injected"] - before["injected"]
        assert injected == pytest.approx(after["sphere_strain"], rel=1e-9)
        assert values(store.heat, near_slots(store))[:, 2].sum() > 0.0
