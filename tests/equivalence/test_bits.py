"""Same bits: whatever the driver, the threads, the search, or the way a uniform run is said."""

import json
import os
import subprocess
import sys
from hashlib import sha256

import numpy as np
import pytest

from taichi_dem import (
    ImplicitDashpots,
    Multirate,
    Scene,
    Simulation,
    Uniform,
    effects,
    runtime,
)
from taichi_dem.kit.allocation import assign
from taichi_dem.mesh.shapes import placed_together
from taichi_dem.step.drivers import PARALLEL_FROM, driver_name
from tests.again import Again
from tests.scenes import ROOT, bar_scene, brisk_scene
from tests.structures import POST, filled

ENVIRONMENT = {**os.environ, "PYTHONPATH": ROOT}
#: Breaks about 60 bonds and brings some pairs into contact.
STEPS = 2700
HELD = Multirate(dt0=1e-8, distance=2e-7)
#: What a run says about the bodies and bonds, not about candidate lists.
MOTION = (
    "position velocity orientation angular_momentum level last_tick broken_tick bond_drag "
    "bond_heat load_work load_impulse softening_unit shear_slip_slip"
).split()


def fields_of(simulation):
    """All changing fields as arrays."""
    return {name: simulation.values(field) for name, field in simulation.state.fields().items()}


def state_after(driver="resident", **contact):
    """All changing fields of the brisk block as arrays after STEPS, account, searches and pairs."""
    simulation = Simulation(brisk_scene(**contact), HELD, driver)
    simulation.advance_to(STEPS)
    found = fields_of(simulation), simulation.energy_balance.account(), simulation.searches
    pairs = simulation.report().pair_evaluations
    # Its engine goes on to the next.
    simulation.close()
    return *found, pairs


def differing(first, second, names=None):
    """Names of the fields whose bits differ."""
    return [name for name in names or first if not np.array_equal(first[name], second[name])]


@pytest.fixture(scope="module")
def held():
    """The reference: held neighbours, resident driver."""
    return state_after()


@pytest.fixture(scope="module")
def parallel():
    """The same by the parallel driver, with two threads."""
    return state_after("parallel")


def test_reference_run_breaks_bonds_touches_and_uses_levels(held):
    """Without fracture, contact and several levels the comparisons below would prove nothing."""
    fields, _, _, pairs = held
    assert (fields["broken_tick"] >= 0).sum() > 30
    assert pairs > 1000
    assert len(np.unique(fields["level"])) >= 3


def test_parallel_driver_gives_the_bits_of_the_resident_one(held, parallel):
    assert differing(held[0], parallel[0]) == []
    assert held[1] == parallel[1]


def test_skin_changes_no_bit(held):
    """A thin skin searches many times more often, while impulses wait in the slots.

    What does not touch adds exact zeros, and what waits is carried over, heat included: its sums
    are of other order.
    """
    fields, account, searches, _ = state_after(skin=2.5e-4)
    assert searches > held[2] + 20
    assert differing(held[0], fields, MOTION) == []
    for name in ("friction", "sphere_dashpot"):
        assert account[name] > 0.0
        assert account[name] == pytest.approx(held[1][name], rel=1e-12)


def test_one_level_for_all_is_the_uniform_run():
    """With a distance that no body covers in dt0 every body stays at level 0."""
    found = []
    for method in (Multirate(2e-8, 1.0), Uniform(dt0=2e-8)):
        simulation = Simulation(bar_scene(), method)
        simulation.advance_to(2000)
        found.append(fields_of(simulation))
    assert (found[0]["broken_tick"] >= 0).any()
    assert differing(*found) == []


_ONE_THREAD = """
import json
from taichi_dem import runtime
from tests.equivalence.test_bits import hashes, state_after
runtime.start(threads=1)
print(json.dumps(hashes(state_after("parallel")[0])))
"""


def hashes(fields):
    """A short sign of the bits of every field."""
    return {name: sha256(a.tobytes()).hexdigest() for name, a in fields.items()}


def test_threads_change_no_bit(parallel):
    """One in a process of its own, two in this one: of the 966 bodies both have a share.

    Taichi spreads loops of more than 512 items.
    """
    done = subprocess.run(
        [sys.executable, "-c", _ONE_THREAD],
        capture_output=True,
        text=True,
        check=True,
        cwd=ROOT,
        env=ENVIRONMENT,
    )
    assert json.loads(done.stdout.splitlines()[-1]) == hashes(parallel[0])


#: Step of solved dashpots [s]. 150 of them break about 250 bonds, and 80 pairs touch.
STEP, SOLVED = 4e-7, 150
SKIN = 8e-4


@pytest.fixture(scope="module")
def block():
    """The brisk block with solved dashpots, resident."""
    return Again(brisk_scene(), ImplicitDashpots(STEP))


@pytest.fixture(scope="module")
def solved(block):
    """Fields of the run that the others are compared with."""
    block.restart(STEP)
    block.run(SOLVED)
    account = block.simulation.energy_balance.account()
    assert account["friction"] > 1.0 and account["sphere_dashpot"] > 1.0
    return fields_of(block.simulation)


def test_skin_changes_no_bit_of_solved_dashpots(block):
    """Other spheres are candidates, and searches come at other times: what touches is the same.

    So are its order and the impulses that the sweeps begin with. What may touch within the step
    is counted in, so that no skin may be thinner than that: 4e-7 s at 1000 m/s, spins included.
    """
    contacts, found = block.simulation.contacts, []
    for skin in (SKIN, 6e-4, 4e-3):
        block.restart(STEP)
        assign(contacts.skin, skin)
        block.search_anew()
        before = block.simulation.searches
        block.run(3 * SOLVED)
        found.append((fields_of(block.simulation), block.simulation.searches - before))
    assign(contacts.skin, SKIN)
    assert len({searches for _, searches in found}) == 3
    for fields, _ in found[1:]:
        assert differing(found[0][0], fields, MOTION) == []


def test_whole_searches_give_the_same_bits(block, solved):
    """Looking at all bodies after each break as well, not just at those that broke or moved."""
    block.restart(STEP)
    block.run(SOLVED, block.simulation.broad_phase.search)
    assert differing(solved, fields_of(block.simulation), MOTION) == []


def of_bodies(driver="resident", skin=0.0075):
    """The same block by contact of bodies with sticking friction: its changing fields."""
    scene = brisk_scene()
    mesh = placed_together({"block": (scene.mesh, (0.0, 0.0, 0.0))} | POST)
    gas = effects.GasPressure("block_hole", 3 * 575e6, 4e-5)
    own = effects.BondDamping(), effects.Softening(), effects.BodyContact(skin=skin), gas
    made = Scene(mesh, scene.material, filled("bodies", *own, group="post_base"))
    simulation = Simulation(made, ImplicitDashpots(STEP), driver)
    simulation.advance_to(200)
    assert (simulation.contacts.store.near_table()[2] > 0.0).sum() > 10
    return fields_of(simulation)


def test_bodies_that_touch_have_the_same_bits_whatever_the_driver_and_the_skin():
    first = of_bodies()
    assert differing(first, of_bodies("parallel")) == []
    of_motion = [name for name in MOTION if name in first]
    assert differing(first, of_bodies(skin=0.05), of_motion) == []


def test_auto_goes_by_size_and_threads():
    """Without a second thread the parallel driver has nothing to offer."""
    assert runtime.settings().threads == 2
    found = [driver_name("auto", size) for size in (PARALLEL_FROM - 1, PARALLEL_FROM)]
    assert found == ["resident", "parallel"]
