"""Engines of the damper: compiled once for a structure, for batches of any size and any numbers."""

import hashlib
import os
import threading
from dataclasses import dataclass

import numpy as np
import pytest
from taichi.lang import impl

from ca_damper import Automaton, Batch, Empty, InputError, RigidMass, SceneTable, Spheres, runtime
from ca_damper.engine.damper_engine import _POOL
from ca_damper.fixed_mass import FixedMass
from taichi_dem.kit import allocation
from tests.ca_oscillator.kicks import Kicks
from tests.own_engines import set_aside
from tests.paper import paper
from tests.slow import slow_but


@pytest.fixture(autouse=True)
def fresh_engines():
    """No engine of another test is left."""
    runtime.clear()


def some_automaton(draw):
    """An automaton of the usual structure with numbers at random."""
    columns, rows = (int(draw.integers(4, 14)) for _ in range(2))
    e, wall, threshold, gravity = draw.uniform([0.3, 0.3, 1, 8], [0.9, 0.9, 6, 11])
    mass, width, v_max = draw.uniform([1e-4, 4e-3, 4.0], [4e-4, 8e-3, 6.0])
    numbers = {"static_threshold": threshold, "particle_mass": mass, "v_max": v_max}
    box = {"columns": columns, "rows": rows, "width": width, "gravity": gravity}
    return Automaton(restitution=e, wall_restitution=wall, **numbers, **box)


def some_named(draw):
    """An automaton whose user names the cells of the start."""
    cells = draw.permutation(40)[: draw.integers(1, 9)]
    return Automaton(start=tuple((int(c) % 10, int(c) // 10) for c in cells))


def some_spheres(draw):
    """Spheres of the usual structure with numbers at random."""
    e, wall, friction, wall_friction = draw.uniform([0.5, 0.5, 0.1, 0.1], [0.9, 0.9, 0.8, 0.8])
    diameter, mass, gravity, poisson = draw.uniform([5e-3, 2e-4, 9, 0.2], [7e-3, 4e-4, 11, 0.4])
    width, height = draw.uniform([30e-3, 40e-3], [60e-3, 90e-3])
    young, wall_young, speed = draw.uniform([1e7, 1e7, 0.3], [5e7, 5e7, 1.0])
    return Spheres(
        *("tsuji", e, wall, friction, wall_friction, speed, young, wall_young, poisson, poisson),
        *(diameter, mass, width, height, gravity),
    )


def some_mass(draw):
    """A rigid mass."""
    return RigidMass(*draw.uniform([1e-4, 5.0], [1e-3, 12.0]))


def some_kicks(draw):
    """The filling of the tests."""
    return Kicks(*draw.uniform([0.0, 0.0], [2e-5, 0.01]), traced=int(draw.integers(1, 100)))


FILLINGS = (some_automaton, some_named, some_spheres, some_mass, some_kicks, lambda draw: Empty())


def some_batch(make, seed, mount="spring"):
    """A started batch with all numbers at random."""
    draw = np.random.default_rng(seed)
    filling, scenes = make(draw), int(draw.integers(1, 6))
    most = min(filling.capacity, 40)
    particles = draw.integers(0, most + 1, scenes)
    if getattr(filling, "start", None) is not None:
        particles = np.full(scenes, len(filling.start))
    frequency, amplitude = draw.uniform(5, 7, scenes), draw.uniform(1e-4, 2e-3, scenes)
    structure = draw.uniform([0.05, 100.0, 0.05], [0.2, 200.0, 0.1])
    dt = filling.default_dt * draw.uniform(0.7, 1.0, scenes)
    seeds = draw.integers(0, 1000, scenes)
    table = SceneTable(particles, seeds, dt, frequency, amplitude, *structure)
    tolerances = {"rtol": 10.0 ** draw.uniform(-10, -7), "atol": 10.0 ** draw.uniform(-13, -11)}
    cycles = int(draw.integers(1, 4))
    batch = Batch(filling, table, mount=mount, measured_cycles=cycles, **tolerances)
    batch.start("rigid")
    return batch


def lived(batch):
    """Digest of a short life of a batch: all that it gives."""
    cycles = batch.run(0, 1)
    batch.drive(6.2)
    batch.advance(100)
    return digest(cycles.record, *batch.sample().values(), *snapshots(batch))


def snapshots(batch):
    """What the fillings of all scenes show."""
    return [part for s in range(batch.count) for part in batch.snapshot(s).values()]


def digest(*arrays):
    """Of all bits."""
    whole = b"".join(np.ascontiguousarray(array).tobytes() for array in arrays)
    return hashlib.sha256(whole).hexdigest()


@pytest.mark.parametrize("mount", slow_but(["spring", "base"], "spring"))
@pytest.mark.parametrize("make", FILLINGS)
def test_a_second_batch_compiles_nothing_and_has_its_bits_as_alone(make, mount, compilations):
    first = some_batch(make, 0, mount)
    lived(first)
    first.report()
    assert "advance" in compilations
    compilations.clear()
    found = []
    for seed in (1, 2, 3):
        batch = some_batch(make, seed, mount)
        found.append(lived(batch))
        assert batch.report().compile_seconds == 0.0
    assert compilations == []
    assert _POOL.count == 1
    runtime.clear()
    assert found[2] == lived(some_batch(make, 3, mount))


@pytest.mark.parametrize("make", [some_automaton, some_spheres])
def test_batches_that_live_at_once_on_one_engine_have_their_bits_as_alone(make):
    """Two batches in turns of 37 steps, the second made when the first is under way."""
    alone = []
    for seed in (1, 2):
        batch = some_batch(make, seed)
        batch.advance(10 * 37)
        alone.append(digest(*batch.sample().values(), *snapshots(batch)))
    one = some_batch(make, 1)
    one.advance(5 * 37)
    other = some_batch(make, 2)
    for turn in range(10):
        other.advance(37)
        if turn % 2:
            one.advance(37)
    assert one.loan.engine is other.loan.engine
    together = [digest(*batch.sample().values(), *snapshots(batch)) for batch in (one, other)]
    assert together == alone


def test_a_callback_may_use_another_batch_of_the_engine():
    straight = lived(some_batch(some_mass, 1))
    other, batch = some_batch(some_mass, 2), some_batch(some_mass, 1)
    batch.launches.pace = 1.0
    cycles = batch.run(0, 1, lambda progress: other.advance(1))
    batch.drive(6.2)
    batch.advance(100)
    assert digest(cycles.record, *batch.sample().values(), *snapshots(batch)) == straight
    assert other.sample()["time_s"].min() > 0.0


def test_a_larger_batch_gets_a_larger_engine_and_a_smaller_one_the_smallest_that_fits():
    small = some_batch(some_mass, 1)
    large = Batch(RigidMass(), SceneTable(1, range(100), 1e-4))
    assert large.loan.engine is not small.loan.engine
    assert large.loan.engine.capacity[0] == 128
    assert some_batch(some_mass, 2).loan.engine is small.loan.engine
    assert lived(small) == lived(some_batch(some_mass, 1))


@pytest.mark.parametrize(
    "change",
    [
        {"accounting": "landing"},
        {"static_contact": False},
        {"accumulator": "reset"},
        {"pair_rule": "one_sided"},
        {"priority": "pairs_first"},
        {"traversal": "scan"},
        {"start": ((1, 1),)},
        {"accounting": "landing", "ledger": True},
    ],
)
def test_other_rules_are_another_structure(change):
    assert paper(**change).structure.key != paper().structure.key


@pytest.mark.parametrize(
    "change",
    [
        {"damping": "printed"},
        {"search": "all_pairs"},
        {"rotation": True},
        {"friction": 0.0, "wall_friction": 0.0},
        {"start": ((0.03, 0.03),)},
    ],
)
def test_other_effects_are_another_structure(change):
    assert Spheres(**change).structure.key != Spheres().structure.key


def resident_bytes():
    """Memory that this process has on the machine."""
    with open("/proc/self/statm") as numbers:
        return int(numbers.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")


@pytest.mark.skipif(not os.path.exists("/proc/self/statm"), reason="asks the system of Linux")
def test_clear_gives_the_memory_back_and_batches_are_refused_in_a_sentence():
    before = resident_bytes()
    batch = Batch(Automaton(), SceneTable(1, range(4000), 1e-4))
    batch.start()
    taken = resident_bytes() - before
    assert taken > 50e6
    runtime.clear()
    assert resident_bytes() - before < 0.2 * taken
    assert _POOL.count == 0
    for use in uses(batch):
        with pytest.raises(InputError, match=r"given back by runtime\.clear") as refused:
            use()
        assert "\n" not in str(refused.value)
    lived(some_batch(some_automaton, 1))


def uses(batch):
    """Everything that one can ask a batch to do."""
    return (
        *(batch.start, lambda: batch.change(dt=1e-4), lambda: batch.drive(6.0)),
        *(lambda: batch.run(1, 1), lambda: batch.advance(1), batch.sample),
        *(lambda: batch.snapshot(0), batch.attempts, batch.report, lambda: batch.device),
        lambda: batch.checkpointed(None, None, {}).__enter__(),
    )


def test_a_batch_on_another_thread_is_refused_in_a_sentence():
    batch, said = some_batch(some_mass, 1), []

    def work():
        for use in (*uses(batch), lambda: some_batch(some_mass, 2)):
            with pytest.raises(InputError) as refused:
                use()
            said.append(str(refused.value))

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert len(said) == len(uses(batch)) + 1
    assert all("on the thread that called runtime.start()" in sentence for sentence in said)
    batch.advance(1)


def test_a_batch_of_a_stopped_session_is_refused_in_a_sentence():
    batch, settings = some_batch(some_mass, 1), runtime.settings()
    runtime.stop()
    for use in uses(batch):
        with pytest.raises(InputError, match="Taichi session that has been stopped"):
            use()
    runtime.start(settings.arch, settings.threads)
    for use in uses(batch):
        with pytest.raises(InputError, match="Taichi session that has been stopped"):
            use()
    lived(some_batch(some_mass, 1))


@pytest.mark.parametrize("goes_on", [True, False])
def test_engines_set_aside_come_back_only_while_their_session_goes_on(goes_on):
    engine, settings = some_batch(some_mass, 1).loan.engine, runtime.settings()
    with pytest.MonkeyPatch.context() as patch:
        set_aside(patch)
        assert some_batch(some_mass, 1).loan.engine is not engine
        if not goes_on:
            runtime.stop()
            runtime.start(settings.arch, settings.threads)
            some_batch(some_mass, 1)
    assert (some_batch(some_mass, 1).loan.engine is engine) == goes_on


def test_a_batch_too_large_for_the_memory_is_refused_before_anything_is_allocated(monkeypatch):
    trees = impl.get_runtime().prog.get_snode_tree_size()
    monkeypatch.setattr(allocation, "available_bytes", lambda: 1e7)
    with pytest.raises(InputError, match=r"needs .* GB of memory.* fewer scenes at a time"):
        Batch(Automaton(), SceneTable(1, range(4000), 1e-4))
    assert impl.get_runtime().prog.get_snode_tree_size() == trees
    assert _POOL.count == 0
    lived(some_batch(some_mass, 1))


class HastyMass(FixedMass):
    """Writes to its field where it should only declare it."""

    def __init__(self, table):
        super().__init__(table)
        self.particle_mass[None] = 1.0


@dataclass(frozen=True)
class Hasty(RigidMass):
    def bind(self, table):
        return HastyMass(table)


def test_a_filling_that_uses_fields_when_it_binds_is_refused_in_words():
    with pytest.raises(InputError, match="bind of a filling must declare its fields and use none"):
        Batch(Hasty(), SceneTable(1, 1, 1e-4))
    lived(some_batch(some_mass, 1))


def test_an_unhashable_filling_without_structure_is_refused_in_words():
    class Loose:
        """Has all members of a filling, and is equal to others, so that it has no hash."""

        __eq__ = object.__eq__
        __hash__ = None

    for name in vars(Empty):
        if not name.startswith("_") and name != "structure":
            setattr(Loose, name, vars(Empty)[name])
    with pytest.raises(InputError, match="filling must be hashable"):
        Batch(Loose(), SceneTable(0, 1, 1e-4))
