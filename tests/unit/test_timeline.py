"""The integer clock, in Python and in kernels, without any physics."""

import numpy as np
import taichi as ti

from taichi_dem import timeline
from taichi_dem.timeline import MACRO_TICKS, MAX_LEVEL


def random_ticks(count=20000):
    """Ticks on every grid: random multiples of random steps, and zero."""
    random = np.random.default_rng(7)
    level = random.integers(0, MAX_LEVEL + 1, count)
    ticks = random.integers(0, 1 << 30, count) << (MAX_LEVEL - level)
    return np.concatenate([[0, MACRO_TICKS, MACRO_TICKS - 1], ticks]).astype(np.int64)


def test_a_tick_lies_on_the_grid_of_the_coarsest_due_level_and_on_no_coarser():
    """Definition: level k is due where the tick is a multiple of its step."""
    for tick in random_ticks().tolist():
        low = timeline.coarsest_active(tick)
        assert tick % timeline.ticks_of(low) == 0
        assert low == 0 or tick % timeline.ticks_of(low - 1) != 0


def test_steps_of_all_levels_nest():
    """Two steps of a level make one of the coarser; level 0 is the macro step."""
    assert timeline.ticks_of(0) == MACRO_TICKS
    assert timeline.ticks_of(MAX_LEVEL) == 1
    for level in range(MAX_LEVEL):
        assert timeline.ticks_of(level) == 2 * timeline.ticks_of(level + 1)


def test_a_body_that_follows_its_levels_is_always_on_its_own_grid():
    """Refine at any own time, coarsen onto the grid: every start is a multiple of the step."""
    random = np.random.default_rng(3)
    tick, level = 0, 4
    for wanted in random.integers(0, MAX_LEVEL + 1, 5000):
        level = timeline.next_level(int(wanted), tick)
        assert level >= wanted
        assert tick % timeline.ticks_of(level) == 0
        assert level == wanted or tick % timeline.ticks_of(level - 1) != 0
        tick += timeline.ticks_of(level)


@ti.kernel
def _mirror(
    ticks: ti.types.ndarray(dtype=ti.i64, ndim=1), low: ti.types.ndarray(dtype=ti.i64, ndim=2)
):
    for k in range(ticks.shape[0]):
        low[k, 0] = timeline.device_coarsest_active(ticks[k])
        low[k, 1] = timeline.device_ticks_of(ti.cast(low[k, 0], ti.i32))


def test_kernels_keep_the_same_time():
    """The device functions mirror the Python ones, number for number."""
    ticks = random_ticks()
    got = np.zeros((len(ticks), 2), dtype=np.int64)
    _mirror(ticks, got)
    low = [timeline.coarsest_active(tick) for tick in ticks.tolist()]
    assert got[:, 0].tolist() == low
    assert got[:, 1].tolist() == [timeline.ticks_of(level) for level in low]
