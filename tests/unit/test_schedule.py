"""Every body and bond is visited when its own step ends: lists and step rule alone."""

import numpy as np
import taichi as ti

from taichi_dem.state.timeline import MACRO_TICKS, MAX_LEVEL
from taichi_dem.step.multirate.lists import ActiveList, Everyone
from taichi_dem.step_control import Displacement


def coarsest_level(tick):
    """Lowest level active at a tick, in plain integers."""
    rest = tick % MACRO_TICKS
    return 0 if rest == 0 else MAX_LEVEL - ((rest & -rest).bit_length() - 1)


@ti.data_oriented
class Sorter:
    """An active list over keys that a test sets."""

    def __init__(self, keys):
        self.keys = ti.field(ti.i32, shape=len(keys))
        self.keys.from_numpy(keys)
        number = ti.field(ti.i32, shape=())
        number.fill(len(keys))
        self.list = ActiveList(Everyone(number, len(keys)), self.key_of)
        self.fill()

    @ti.func
    def key_of(self, member):
        """Key of a member."""
        return self.keys[member]

    @ti.kernel
    def fill(self):
        """Take in all members."""
        for _ in range(1):
            self.list.listing.sort()

    @ti.kernel
    def move(self, member: ti.i32, key: ti.i32):
        """Give a member another key."""
        for _ in range(1):
            self.keys[member] = key
            if self.list.key[member] >= 0:
                self.list.renew(member)
            else:
                self.list.insert(member)

    @ti.kernel
    def due(self, low: ti.i32) -> ti.i32:
        """Number of members that are due at a level."""
        count = 0
        for _ in range(1):
            count = self.list.count(low)
        return count

    def check(self, keys):
        """The first due(k) places hold just the members whose keys are k or more."""
        order, place = self.list.order.to_numpy(), self.list.index.to_numpy()
        for level in reversed(range(MAX_LEVEL + 1)):
            listed = np.flatnonzero(keys >= level)
            assert sorted(order[: self.due(level)]) == listed.tolist()
        assert np.array_equal(order[place[listed]], listed)


def test_moves_keep_the_list_exact_at_every_level():
    """Random members to random keys, up and down, not at all, off the list and back."""
    random = np.random.default_rng(1)
    keys = random.integers(0, MAX_LEVEL + 1, 60).astype(np.int32)
    sorter = Sorter(keys)
    sorter.check(keys)
    for _ in range(200):
        member = int(random.integers(len(keys)))
        keys[member] = random.integers(-1, MAX_LEVEL + 1)
        sorter.move(member, int(keys[member]))
        sorter.check(keys)


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
    low = np.array([coarsest_level(int(t)) for t in random.integers(0, 1 << 22, count)])
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
