"""Eqs (9) and (10) and the random deflection, one collision at a time."""

import numpy as np
import pytest
import taichi as ti

from ca_damper.automaton.collisions import deflected, speed_after_pair, speed_after_wall
from ca_damper.automaton.lattice import DIRECTIONS

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
