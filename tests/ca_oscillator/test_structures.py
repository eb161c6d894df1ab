"""A structure of the damper is compiled once, and no number of an earlier batch stays in it."""

import hashlib

import numpy as np

from ca_damper import Batch, SceneTable, Spheres


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


def some_batch(seed):
    """A started batch of spheres with all numbers at random."""
    draw = np.random.default_rng(seed)
    filling, scenes = some_spheres(draw), int(draw.integers(1, 6))
    particles = draw.integers(0, 41, scenes)
    frequency, amplitude = draw.uniform(5, 7, scenes), draw.uniform(1e-4, 2e-3, scenes)
    structure = draw.uniform([0.05, 100.0, 0.05], [0.2, 200.0, 0.1])
    dt = filling.default_dt * draw.uniform(0.7, 1.0, scenes)
    seeds = draw.integers(0, 1000, scenes)
    table = SceneTable(particles, seeds, dt, frequency, amplitude, *structure)
    tolerances = {"rtol": 10.0 ** draw.uniform(-10, -7), "atol": 10.0 ** draw.uniform(-13, -11)}
    batch = Batch(filling, table, measured_cycles=int(draw.integers(1, 4)), **tolerances)
    batch.start("rigid")
    return batch


def lived(batch):
    """Digest of a short life of a batch: all that it gives."""
    cycles = batch.run(0, 1)
    batch.drive(6.2)
    batch.advance(100)
    return digest(batch, cycles.record)


def digest(batch, *others):
    """Of all bits of what a batch shows."""
    places = [part for s in range(batch.count) for part in batch.snapshot(s).values()]
    arrays = [*others, *batch.sample().values(), *places]
    whole = b"".join(np.ascontiguousarray(array).tobytes() for array in arrays)
    return hashlib.sha256(whole).hexdigest()


def test_a_second_batch_compiles_nothing_and_has_its_bits_as_alone(compilations, compiled_anew):
    lived(some_batch(0))
    compilations.clear()
    later = lived(some_batch(3))
    assert compilations == []
    compiled_anew()
    assert later == lived(some_batch(3))
    assert "advance" in compilations


def test_batches_that_live_at_once_have_an_engine_each_and_their_bits_as_alone():
    """Two batches in turns of 37 steps, the second made when the first is under way."""
    alone = []
    for seed in (1, 2):
        batch = some_batch(seed)
        batch.advance(10 * 37)
        alone.append(digest(batch))
    one = some_batch(1)
    one.advance(5 * 37)
    other = some_batch(2)
    for turn in range(10):
        other.advance(37)
        if turn % 2:
            one.advance(37)
    assert one.engine is not other.engine
    assert [digest(one), digest(other)] == alone
