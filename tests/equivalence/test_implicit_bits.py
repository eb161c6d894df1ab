"""Solved dashpots give the same bits: whatever the driver, the threads, the search, the skin."""

import hashlib
import json
import os
import subprocess
import sys

import numpy as np
import pytest

from taichi_dem import CONCRETE, ImplicitDashpots, Scene, Simulation, effects
from taichi_dem.contact_search import pair_store
from taichi_dem.mesh.colouring import edge_colours
from taichi_dem.mesh.shapes import bar
from tests.again import Again
from tests.equivalence.test_bits import ENVIRONMENT, MOTION, differing
from tests.scenes import ROOT, brisk_scene

#: Breaks about 250 bonds and brings about 80 pairs into contact.
STEP, STEPS = 4e-7, 150
SKIN = 8e-4


def fields_of(state):
    """All changing fields as arrays."""
    return {name: field.to_numpy() for name, field in state.fields().items()}


@pytest.fixture(scope="module")
def block():
    """The brisk block, resident, compiled once."""
    return Again(brisk_scene(), ImplicitDashpots(STEP))


@pytest.fixture(scope="module")
def reference(block):
    """Fields and account of the run that the others are compared with, and its searches."""
    searches = []
    block.restart(STEP)
    block.run(STEPS, lambda: searches.append(1))
    return fields_of(block.state), block.simulation.energy_balance.account(), len(searches)


def test_reference_run_breaks_bonds_touches_and_rubs(reference):
    """Without fracture and contact the comparisons below would prove nothing."""
    fields, account, searches = reference
    assert (fields["broken_tick"] >= 0).sum() > 100 and searches > 50
    assert account["friction"] > 1.0 and account["sphere_dashpot"] > 1.0


def test_a_second_run_gives_the_same_bits(block, reference):
    block.restart(STEP)
    block.run(STEPS)
    assert differing(reference[0], fields_of(block.state)) == []


def test_skin_changes_no_bit(block):
    """Other spheres are candidates, and searches come at other times: what touches is the same.

    So are its order and the impulses that the sweeps begin with. What may touch within the step
    is counted in, so that no skin may be thinner than that: 4e-7 s at 1000 m/s, spins included.
    """
    contacts, found = block.simulation.contacts, []
    for skin in (SKIN, 6e-4, 4e-3):
        block.restart(STEP)
        contacts.skin.fill(skin)
        block.search_anew()
        before = block.simulation.searches
        block.run(3 * STEPS)
        found.append((fields_of(block.state), block.simulation.searches - before))
    contacts.skin.fill(SKIN)
    assert len({searches for _, searches in found}) == 3
    for fields, _ in found[1:]:
        assert differing(found[0][0], fields, MOTION) == []


def test_whole_searches_give_the_same_bits(block, reference):
    """Looking at all bodies after each break as well, not just at those that broke or moved."""
    block.restart(STEP)
    block.run(STEPS, block.simulation.broad_phase.search)
    assert differing(reference[0], fields_of(block.state), MOTION) == []


@pytest.mark.slow
def test_packing_what_pairs_list_changes_no_bit(block, reference, monkeypatch, compiled_anew):
    """At every search, impulses that the sweeps begin with included; the others left gaps."""
    monkeypatch.setattr(pair_store, "SLACK", -(1 << 30))
    packed = Simulation(brisk_scene(), ImplicitDashpots(STEP))
    packed.advance_to(STEPS)
    assert differing(reference[0], fields_of(packed.state)) == []
    ends = [one.contacts.store.sphere_end[None] for one in (packed, block.simulation)]
    assert packed.contacts.store.sphere_count[None] <= ends[0] < ends[1]


@pytest.mark.slow
def test_parallel_driver_and_a_search_without_cells_give_the_same_bits(reference):
    """Both in one run, to compile once: no order in either may show."""
    simulation = Simulation(brisk_scene(), ImplicitDashpots(STEP), "parallel", brute_force=True)
    simulation.advance_to(STEPS)
    assert differing(reference[0], fields_of(simulation.state), MOTION) == []
    assert simulation.energy_balance.account() == reference[1]


def shaken():
    """A damped bar whose every colour of bonds has more than the 512 that Taichi spreads."""
    listed = [effects.BondDamping(), effects.GasPressure("left", peak=1e8, rise=1e-5)]
    scene = Scene(bar(0.8, 0.6, (8, 6, 6)), CONCRETE, listed)
    simulation = Simulation(scene, ImplicitDashpots(STEP), "parallel")
    count = simulation.model.body_count
    velocity = np.random.default_rng(4).standard_normal((count, 3))
    turn = np.tile([1.0, 0.0, 0.0, 0.0], (count, 1))
    simulation.state.set_motion(simulation.model.centre, turn, velocity)
    simulation.advance_to(20)
    return simulation


def hashes(simulation):
    """A short sign of the bits of every field."""
    fields = fields_of(simulation.state)
    return {name: hashlib.sha256(a.tobytes()).hexdigest() for name, a in fields.items()}


_ONE_THREAD = """
import json
from taichi_dem import runtime
from tests.equivalence.test_implicit_bits import hashes, shaken
runtime.start(threads=1)
print(json.dumps(hashes(shaken())))
"""


@pytest.mark.slow
def test_threads_change_no_bit():
    """One thread in a process of its own, two in this one; sweeps and all loops are spread."""
    simulation = shaken()
    top = simulation.model.topology
    links = np.stack([top.master, top.slave], axis=1)
    assert np.bincount(edge_colours(links, simulation.model.body_count))[:4].min() > 512
    done = subprocess.run(
        [sys.executable, "-c", _ONE_THREAD],
        capture_output=True,
        text=True,
        check=True,
        cwd=ROOT,
        env={**os.environ, **ENVIRONMENT},
    )
    assert json.loads(done.stdout.splitlines()[-1]) == hashes(simulation)
