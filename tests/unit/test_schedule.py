"""Due lists and the step rule, on made-up keys and speeds."""

import numpy as np
import taichi as ti

from taichi_dem.step.schedule import DueList
from taichi_dem.step_control import Displacement
from taichi_dem.timeline import MAX_LEVEL, coarsest_due


@ti.data_oriented
class Sorter:
    """A due list over keys that a test sets."""

    def __init__(self, count):
        self.count = count
        self.keys = ti.field(ti.i32, shape=count)
        self.list = DueList(count)

    @ti.func
    def key_of(self, member):
        """Key of a member."""
        return self.keys[member]

    @ti.kernel
    def fill(self):
        """Take in all members."""
        for _ in range(1):
            self.list.fill(self.count)

    @ti.kernel
    def sort(self, low: ti.i32) -> ti.i32:
        """Sort what is due at a level."""
        waiting = 0
        ti.loop_config(serialize=True)
        for _ in range(1):
            waiting = self.list.sort_due(low, self.key_of)
        return waiting

    def members(self, level):
        """Members listed with a key of at least a level."""
        return set(self.list.order.to_numpy()[: self.list.end[level]].tolist())


def test_full_sort_puts_every_member_behind_its_key():
    """end[k] counts the keys >= k, and the first end[k] places hold just those members."""
    sorter = Sorter(300)
    keys = np.random.default_rng(0).integers(-1, MAX_LEVEL + 1, 300).astype(np.int32)
    sorter.keys.from_numpy(keys)
    sorter.fill()
    assert sorter.sort(0) == 0
    for level in range(MAX_LEVEL + 1):
        assert sorter.members(level) == set(np.flatnonzero(keys >= level).tolist())


def test_partial_sorts_follow_changing_keys():
    """Members that are due change keys within the due range; all lists stay exact."""
    random = np.random.default_rng(1)
    sorter = Sorter(200)
    keys = random.integers(0, 9, 200).astype(np.int32)
    sorter.keys.from_numpy(keys)
    sorter.fill()
    sorter.sort(0)
    for _ in range(200):
        low = int(random.integers(0, 9))
        due = np.flatnonzero(keys >= low)
        some = due[random.random(len(due)) < 0.3]
        keys[some] = random.integers(low, 9, len(some))
        sorter.keys.from_numpy(keys)
        assert sorter.sort(low) == 0
        for level in range(10):
            assert sorter.members(level) == set(np.flatnonzero(keys >= level).tolist())


def test_a_member_that_fell_below_waits_at_the_due_level_and_leaves_at_a_coarser_tick():
    """At low 3 a key of 1 cannot be placed: it stays among the due, said by the return value."""
    sorter = Sorter(4)
    sorter.keys.from_numpy(np.array([5, 4, 3, 0], dtype=np.int32))
    sorter.fill()
    sorter.sort(0)
    sorter.keys.from_numpy(np.array([5, 1, 3, 0], dtype=np.int32))
    assert sorter.sort(3) == 1
    assert sorter.members(3) == {0, 1, 2}
    assert sorter.sort(1) == 0
    assert sorter.members(3) == {0, 2}
    assert sorter.members(1) == {0, 1, 2}
    sorter.keys.from_numpy(np.array([5, -1, 3, 0], dtype=np.int32))
    assert sorter.sort(0) == 0
    assert sorter.members(0) == {0, 2, 3}


@ti.data_oriented
class Rule:
    """The displacement rule asked for many bodies at once."""

    def __init__(self, criterion):
        self.criterion = criterion

    @ti.kernel
    def ask(
        self,
        level: ti.types.ndarray(dtype=ti.i32, ndim=1),
        speed: ti.types.ndarray(dtype=ti.f64, ndim=1),
        low: ti.types.ndarray(dtype=ti.i32, ndim=1),
    ):
        """Replace levels by wanted ones."""
        for k in range(level.shape[0]):
            level[k] = self.criterion.wanted(level[k], speed[k] ** 2, low[k])


def test_the_paper_rule_takes_the_largest_step_that_is_short_enough_and_on_the_grid():
    """dt_i <= l / |v_i| (Konno et al., 3.1); one level coarser would break that or the grid.

    Squares are compared: a speed within 1e-12 of a limit could go either way; none is.
    """
    random = np.random.default_rng(5)
    count, dt0, distance = 2000, 1e-8, 1e-8
    speed = 10.0 ** random.uniform(-3, 3.5, count)
    low = np.array([coarsest_due(int(t)) for t in random.integers(0, 1 << 22, count)])
    low = np.minimum(low, 6).astype(np.int32)
    level = np.maximum(low, random.integers(0, 12, count)).astype(np.int32)
    Rule(Displacement(distance, dt0)).ask(level, speed, low)
    step = dt0 / 2.0**level
    assert np.all(step * speed <= distance)
    assert np.all(level >= low)
    coarser = level > low
    assert coarser.any()
    assert np.all(2.0 * step[coarser] * speed[coarser] > distance)
