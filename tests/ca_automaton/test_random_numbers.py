"""The counted random numbers: a hash that anyone can compute again, and that looks random."""

import numpy as np
import pytest
import taichi as ti

from ca_damper.engine.random_numbers import DEFLECT, EVENT, PURPOSES, uniform

MASK = np.uint64(2**32 - 1)


def scrambled(word):
    """The output permutation of PCG in NumPy, in 64 bits cut to 32."""
    state = (word * np.uint64(747796405) + np.uint64(2891336453)) & MASK
    shift = (state >> np.uint64(28)) + np.uint64(4)
    mixed = (((state >> shift) ^ state) * np.uint64(277803737)) & MASK
    return (mixed >> np.uint64(22)) ^ mixed


def expected(seed, step, cell, purpose):
    """What ``uniform`` must return."""
    shared = scrambled((np.uint64(step) + scrambled(np.uint64(seed))) & MASK)
    return scrambled(shared ^ np.uint64(cell * PURPOSES + purpose)) * 2.0**-32


@ti.kernel
def draw(purpose: ti.template(), out: ti.types.ndarray(dtype=ti.f64, ndim=3)):
    for seed, step, cell in out:
        out[seed, step, cell] = uniform(seed, step, cell, purpose)


@pytest.fixture(scope="module")
def draws():
    """Numbers of 4 seeds, 50 steps and 200 cells for two purposes."""
    out = np.empty((2, 4, 50, 200))
    draw(EVENT, out[0])
    draw(DEFLECT, out[1])
    return out


def test_numbers_follow_their_formula(draws):
    """Equality to the last bit with an independent computation."""
    for seed, step, cell in [(0, 0, 0), (3, 49, 199), (1, 7, 42)]:
        assert draws[0, seed, step, cell] == expected(seed, step, cell, EVENT)
        assert draws[1, seed, step, cell] == expected(seed, step, cell, DEFLECT)


def test_numbers_are_uniform_and_do_not_hang_together(draws):
    """Mean 1/2, variance 1/12, no correlation with cell, step, seed or purpose: 5 sigma."""
    assert draws.min() >= 0.0 and draws.max() < 1.0
    assert abs(draws.mean() - 0.5) < 5 / np.sqrt(12 * draws.size)
    # The variance of the square of a centred uniform number is 1/180.
    centred = draws - 0.5
    assert abs((centred**2).mean() - 1 / 12) < 5 * np.sqrt(1 / 180 / draws.size)
    for axis in range(4):
        product = centred * np.roll(centred, 1, axis=axis)
        # Two purposes make each pair twice: half as many independent products.
        count = draws.size / (2 if axis == 0 else 1)
        assert abs(product.mean()) < 5 / 12 / np.sqrt(count)
