"""Active lists and the step rule, on made-up keys and speeds."""

import numpy as np
import taichi as ti

from taichi_dem.stability.step_control import Displacement
from taichi_dem.step.schedule import ActiveList
from taichi_dem.timeline import MAX_LEVEL, coarsest_active


@ti.data_oriented
class Sorter:
    """An active list over keys that a test sets."""

    def __init__(self, keys):
        self.keys = ti.field(ti.i32, shape=len(keys))
        self.keys.from_numpy(keys)
        self.list = ActiveList(len(keys))
        self.fill(len(keys))

    @ti.func
    def key_of(self, member):
        """Key of a member."""
        return self.keys[member]

    @ti.kernel
    def fill(self, count: ti.i32):
        """Take in the first count members."""
        for _ in range(1):
            self.list.fill(count, self.key_of)

    @ti.kernel
    def move(self, member: ti.i32, key: ti.i32):
        """Give a member another key."""
        for _ in range(1):
            self.list.move(member, key)

    def check(self, keys):
        """end[k] counts the keys >= k, the first end[k] places hold just those members."""
        order, end = self.list.order.to_numpy(), self.list.end.to_numpy()
        place = self.list.index.to_numpy()
        for level in reversed(range(MAX_LEVEL + 1)):
            listed = np.flatnonzero(keys >= level)
            assert end[level] == len(listed)
            assert sorted(order[: end[level]]) == listed.tolist()
        assert np.array_equal(order[place[listed]], listed)


def test_a_full_list_puts_every_member_behind_its_key():
    """Also when it is filled a second time, with fewer members and other keys."""
    random = np.random.default_rng(0)
    keys = random.integers(-1, MAX_LEVEL + 1, 300).astype(np.int32)
    sorter = Sorter(keys)
    sorter.check(keys)
    keys = random.integers(-1, MAX_LEVEL + 1, 300).astype(np.int32)
    sorter.keys.from_numpy(keys)
    sorter.fill(100)
    sorter.check(keys[:100])


def test_moves_keep_the_list_exact_at_every_level():
    """500 moves of random members to random keys, up and down and not at all."""
    random = np.random.default_rng(1)
    keys = random.integers(0, MAX_LEVEL + 1, 60).astype(np.int32)
    sorter = Sorter(keys)
    for _ in range(500):
        member = int(random.integers(60))
        keys[member] = random.integers(0, MAX_LEVEL + 1)
        sorter.move(member, keys[member])
        sorter.check(keys)


def test_a_negative_key_takes_a_member_off_the_list():
    """Members leave one by one, from whatever key they had; the others stay."""
    keys = np.array([5, MAX_LEVEL, 3, 0, 0, 5], dtype=np.int32)
    sorter = Sorter(keys)
    for member in (3, 1, 5, 0, 2, 4):
        keys[member] = -1
        sorter.move(member, -1)
        sorter.check(keys)
    assert sorter.list.end[0] == 0


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
    low = np.array([coarsest_active(int(t)) for t in random.integers(0, 1 << 22, count)])
    low = np.minimum(low, 6).astype(np.int32)
    level = np.maximum(low, random.integers(0, 12, count)).astype(np.int32)
    rule = Displacement()
    rule.load(distance, dt0)
    Rule(rule).ask(level, speed, low)
    step = dt0 / 2.0**level
    assert np.all(step * speed <= distance)
    assert np.all(level >= low)
    coarser = level > low
    assert coarser.any()
    assert np.all(2.0 * step[coarser] * speed[coarser] > distance)
