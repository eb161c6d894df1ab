"""Floors of a machine: kernels do the work that is counted, and shares follow from least times."""

import numpy as np
import pytest
import taichi as ti

from taichi_dem.kit.study import floors
from taichi_dem.kit.study.floors import CACHE, CHAINS, LANES, MEMORY, MULTIPLY_ADD, Copy, Work

ENTRIES = 1 << 10


@pytest.mark.parametrize("rate", [Copy.bandwidth, Copy.bandwidth_of_one_core])
def test_a_copy_copies_all_numbers(rate):
    copy, numbers = Copy(ENTRIES), np.arange(ENTRIES, dtype=float)
    assert copy.bytes == 2 * numbers.nbytes
    copy.a.from_numpy(numbers.reshape(copy.a.to_numpy().shape))
    assert rate(copy, repeats=1) > 0.0
    assert (copy.b.to_numpy().ravel() == numbers).all()
    assert (copy.a.to_numpy().ravel() == numbers).all()


def test_every_chain_is_multiplied_and_added_to():
    sums, first = ti.Vector.field(LANES, ti.f64, shape=CHAINS), np.arange(LANES * CHAINS) - 5.0
    sums.from_numpy(first.reshape(CHAINS, LANES))
    # In halves and whole numbers nothing is rounded: s -> s / 2 + 1 for four times.
    floors._multiply_add(sums, 0.5, 1.0, 4)
    assert (sums.to_numpy().ravel() == first / 16.0 + 2.0 * (1.0 - 1.0 / 16.0)).all()


def test_the_slower_of_bytes_and_operations_sets_the_least_time():
    rates = {MEMORY: 4.0, CACHE: 8.0, MULTIPLY_ADD: 2.0}
    assert Work(bytes=32).seconds(rates) == 4.0
    assert Work(bytes=32, store=MEMORY).seconds(rates) == 8.0
    assert Work(bytes=32, flops=10).seconds(rates) == 5.0


def test_work_of_parts_and_of_many_adds_up():
    assert Work(bytes=1, flops=2, store=MEMORY) * 3.0 + Work(1, 1) == Work(4, 7, MEMORY)


def test_bytes_alone_need_no_rate_of_operations():
    assert Work(bytes=8).seconds({CACHE: 4.0}) == 2.0
