"""Rules of the automaton one at a time: collisions by eqs (9) and (10), lattice, random numbers."""

import numpy as np
import pytest
import taichi as ti

from ca_damper.automaton.lattice import (
    DIRECTIONS,
    DOWN,
    UP,
    LatticeGeometry,
    alignments,
    unit_vectors,
)
from ca_damper.automaton.paper.collisions import deflected, speed_after_pair, speed_after_wall
from ca_damper.engine.random_numbers import DEFLECT, EVENT, PURPOSES, uniform

ARRAY = ti.types.ndarray(dtype=ti.f64, ndim=1)
EPS = np.finfo(float).eps


@ti.kernel
def collide(a: ARRAY, b: ARRAY, e: ti.f64, after_a: ARRAY, after_b: ARRAY, wall: ARRAY):
    for k in a:
        after_a[k] = speed_after_pair(a[k], b[k], e)
        after_b[k] = speed_after_pair(b[k], a[k], e)
        wall[k] = speed_after_wall(a[k], b[k], e)


@ti.kernel
def deflect(draws: ARRAY, out: ti.types.ndarray(dtype=ti.i32, ndim=2)):
    for direction, k in out:
        out[direction, k] = deflected(direction, draws[k])


@pytest.mark.parametrize("restitution", [0.0, 0.75, 1.0])
def test_pairs_keep_momentum_and_part_by_restitution(restitution):
    """v_a' + v_b' = v_a + v_b and v_b' - v_a' = e (v_a - v_b), to a few roundings."""
    a, b = np.random.default_rng(1).uniform(-2, 2, (2, 100))
    after_a, after_b, wall = np.empty((3, 100))
    collide(a, b, restitution, after_a, after_b, wall)
    assert after_a + after_b == pytest.approx(a + b, abs=16 * EPS)
    assert after_b - after_a == pytest.approx(restitution * (a - b), abs=16 * EPS)
    # A wall of great mass keeps its velocity: v' - v_w = -e (v - v_w).
    assert wall - b == pytest.approx(-restitution * (a - b), abs=16 * EPS)


def test_deflection_sends_half_straight_back_and_a_quarter_to_each_side():
    """Draws in [0, 1/2) go back, [1/2, 3/4) and [3/4, 1) to the two sides of that."""
    draws = np.array([0.0, 0.4999, 0.5, 0.7499, 0.75, 0.9999])
    out = np.empty((DIRECTIONS, len(draws)), dtype=np.int32)
    deflect(draws, out)
    for direction in range(DIRECTIONS):
        turn = (out[direction] - direction) % DIRECTIONS
        assert list(turn) == [3, 3, 2, 2, 4, 4]


BOX, WIDTH = LatticeGeometry(10, 16), 6e-3


def test_inner_cells_have_six_neighbours_where_the_triangles_put_them():
    """Vertical neighbours one width away, oblique ones one column aside and half a width up."""
    ahead, centres = BOX.neighbours(), BOX.centres(WIDTH)
    inner = np.flatnonzero(BOX.inside(*BOX.column_and_row(np.arange(BOX.cells))))
    assert len(inner) == 160
    for cell in inner:
        way = (centres[ahead[cell, :DIRECTIONS]] - centres[cell]) / WIDTH
        expected = np.column_stack([np.sign(unit_vectors()[:, 0].round(9)), unit_vectors()[:, 1]])
        assert way == pytest.approx(expected, abs=1e-12)


def test_projections_are_exact():
    """cos 60 degrees is 1/2 to the last bit: gravity on oblique flights is g / 2."""
    assert np.array_equal(alignments()[:, UP], [1.0, 0.5, -0.5, -1.0, -0.5, 0.5])
    assert np.array_equal(alignments()[DOWN], -alignments()[UP])


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
