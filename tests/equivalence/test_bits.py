"""Same bits: whatever the driver, the threads, the search, or the way a uniform run is said."""

import json
import os
import subprocess
import sys

import numpy as np
import pytest

from taichi_dem import Multirate, Simulation, StepControl, Uniform
from taichi_dem.contact_search import contacts
from tests.scenes import ROOT, brisk_scene

ENVIRONMENT = {**os.environ, "PYTHONPATH": ROOT}
#: Breaks about 90 bonds and brings about 50 pairs into contact.
STEPS = 3000
COARSE = {"dt0": 1e-8, "distance": 2e-7}
#: What a run says about the bodies and bonds, not about candidate lists.
MOTION = (
    "position velocity orientation angular_momentum level last_tick broken_tick bond_heat "
    "load_work load_impulse softening_unit shear_slip"
).split()


def state_after(method, driver="resident", steps=STEPS, brute_force=False, **contact):
    """All changing fields as arrays after some steps, and the simulation."""
    simulation = Simulation(brisk_scene(**contact), method, driver, brute_force)
    simulation.advance_to(steps)
    fields = {name: field.to_numpy() for name, field in simulation.state.fields().items()}
    return fields, simulation


def differing(first, second, names=None):
    """Names of the fields whose bits differ."""
    return [name for name in names or first if not np.array_equal(first[name], second[name])]


@pytest.fixture(scope="module")
def held():
    """The reference: held neighbours, resident driver."""
    return state_after(Multirate(**COARSE))


def test_reference_run_breaks_bonds_touches_and_uses_levels(held):
    """Without fracture, contact and several levels the comparisons below would prove nothing."""
    fields, simulation = held
    assert (fields["broken_tick"] >= 0).sum() > 30
    assert simulation.report().pair_evaluations > 1000
    assert len(np.unique(fields["level"])) >= 3


def test_parallel_driver_gives_the_bits_of_the_resident_one(held):
    fields, simulation = held
    parallel, other = state_after(Multirate(**COARSE), driver="parallel")
    assert differing(fields, parallel) == []
    assert simulation.energy_balance.account() == other.energy_balance.account()


def test_a_second_run_gives_the_same_bits(held):
    again, _ = state_after(Multirate(**COARSE))
    assert differing(held[0], again) == []


def test_search_without_cells_gives_the_same_bits(held):
    brute, _ = state_after(Multirate(**COARSE), brute_force=True)
    assert differing(held[0], brute, MOTION) == []


def test_skin_changes_no_bit(held):
    """A thin skin searches many times more often, while impulses wait in the slots.

    What does not touch adds exact zeros, and what waits is carried over.
    """
    thin, simulation = state_after(Multirate(**COARSE), skin=2.5e-4)
    assert simulation.searches > held[1].searches + 20
    assert differing(held[0], thin, MOTION) == []


@pytest.mark.slow
def test_skin_changes_no_bit_where_steps_depend_on_what_is_near(monkeypatch, compiled_anew):
    """A pair is news when it comes near, not when a search lists it: the same limits, and wakes.

    The thin run gives fast bodies no body skin by their speed either.
    """
    control = StepControl(dashpot_floor=1e-8, level_jump=None)
    method = Multirate(4e-8, 1e-6, control=control, dashpot="limited")
    wide, simulation = state_after(method, steps=1500)
    monkeypatch.setattr(contacts, "STEPS", 0.0)
    compiled_anew()
    thin, other = state_after(method, steps=1500, skin=1.2e-3)
    assert other.searches > 2 * simulation.searches
    assert simulation.report().broken_faces > 100
    assert differing(wide, thin, MOTION) == []


@pytest.mark.slow
def test_drifted_neighbours_give_the_same_bits_in_both_drivers():
    method = Multirate(neighbour="drifted", **COARSE)
    resident, _ = state_after(method)
    parallel, _ = state_after(method, driver="parallel")
    assert differing(resident, parallel) == []


@pytest.mark.parametrize("neighbour", ["held", pytest.param("drifted", marks=pytest.mark.slow)])
def test_one_level_for_all_is_the_uniform_run(neighbour):
    """With a distance that no body covers in dt0 every body stays at level 0."""
    one_level, _ = state_after(Multirate(5e-9, 1.0, neighbour), steps=5500)
    uniform, simulation = state_after(Uniform(dt0=5e-9), steps=5500)
    assert simulation.report().broken_faces > 0
    assert differing(one_level, uniform) == []


_THREADS = """
import hashlib, json, sys
from taichi_dem import Multirate, Simulation, runtime
from tests.scenes import brisk_scene
runtime.start(threads=int(sys.argv[1]))
simulation = Simulation(brisk_scene(), Multirate(dt0=1e-8, distance=2e-7), "parallel")
simulation.advance_to(2600)
fields = simulation.state.fields()
print(json.dumps({k: hashlib.sha256(f.to_numpy().tobytes()).hexdigest() for k, f in fields.items()}
    | {"broken": simulation.report().broken_faces}))
"""


def test_threads_change_no_bit(tmp_path):
    """Taichi spreads loops of more than 512 items: the block's 966 bodies and 1688 bonds do."""
    script = tmp_path / "threads.py"
    script.write_text(_THREADS)
    outputs = []
    for threads in ("1", "2"):
        done = subprocess.run(
            [sys.executable, str(script), threads],
            capture_output=True,
            text=True,
            check=True,
            cwd=ROOT,
            env=ENVIRONMENT,
        )
        outputs.append(json.loads(done.stdout))
    assert outputs[0]["broken"] > 0
    assert outputs[0] == outputs[1]
