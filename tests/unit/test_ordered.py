"""Running sums, sorts and groups are those of NumPy, in any chunks and on any number of threads."""

import numpy as np
import pytest
import taichi as ti

from taichi_dem.kit import ordered
from taichi_dem.kit.allocation import FieldTree, assign, values
from taichi_dem.kit.ordered import CountingSort, Grouping, RunningSums, Some, side_by_side

MOST, KEYS = 6000, 7


@ti.data_oriented
class Lists:
    """Sums, a sort by few keys and groups by many of numbers that a test sets."""

    def __init__(self):
        self.number, self.groups = (ti.field(ti.i32, shape=()) for _ in range(2))
        self.key, self.before, self.place = (ti.field(ti.i32, shape=MOST) for _ in range(3))
        self.last, self.total = ti.field(ti.i32, shape=KEYS), ti.field(ti.i32, shape=())
        self.first, self.order = ti.field(ti.i32, shape=MOST + 1), ti.field(ti.i32, shape=MOST)
        numbers = Some(self._count, MOST)
        sums = RunningSums(numbers, 1, self._value, self._put, self._end)
        ways = KEYS, self._key, self._key, self._put_place, self._end_key
        sort = CountingSort(numbers, *ways)
        lists = Some(self._group_count, MOST), numbers
        groups = Grouping(self.first, self.order, *lists, self._group, self._twice)
        phases = (*side_by_side(sort.phases[:2], sums.phases), *sort.phases[2:], *groups.phases)
        self.tasks = ordered.tasks(phases, MOST)

    @ti.kernel
    def make(self):
        """All of them."""
        for _, phases in ti.static(self.tasks):
            for a in range(phases[0][0].count(0)):
                phases[0][1](phases[0][0].pick(a))

    @ti.func
    def _count(self):
        return self.number[None]

    @ti.func
    def _group_count(self):
        return self.groups[None]

    @ti.func
    def _value(self, a):
        return ti.Vector([self.key[a]])

    @ti.func
    def _put(self, a, before, value):
        self.before[a] = before[0]

    @ti.func
    def _end(self, total):
        self.total[None] = total[0]

    @ti.func
    def _key(self, m):
        return ti.select(self.key[m] < KEYS, self.key[m], -1)

    @ti.func
    def _put_place(self, m, place):
        self.place[place] = m

    @ti.func
    def _end_key(self, key, last):
        self.last[key] = last

    @ti.func
    def _group(self, a):
        return (7 * a + self.key[a]) % self.groups[None]

    @ti.func
    def _twice(self, a):
        return 2 * a


@pytest.fixture(scope="module", params=[(1, 64), (5, 2000)], ids=str)
def lists(request, taichi_session):
    """The lists in chunks of some size, each phase a parallel loop."""
    with pytest.MonkeyPatch.context() as change:
        change.setattr(ordered, "_CPU", request.param)
        change.setattr(ordered, "_SERIAL_UP_TO", 0)
        with FieldTree():
            made = Lists()
        yield made


@pytest.mark.parametrize("count", [1, 2, 63, 1024, 1025, 5999])
def test_lists_are_those_of_numpy(lists, count):
    """Sums before each place; places by key, in order; members of each group, in order."""
    key = np.random.default_rng(count).integers(0, KEYS + 2, count).astype(np.int32)
    groups = max(1, count // 3)
    for field, value in ((lists.number, count), (lists.groups, groups), (lists.key, key)):
        assign(field, value)
    for _ in range(2):
        lists.make()
        assert np.array_equal(values(lists.before)[:count], np.cumsum(key) - key)
        assert values(lists.total) == key.sum()
        listed = np.flatnonzero(key < KEYS)
        by_key = listed[np.argsort(key[listed], kind="stable")]
        assert np.array_equal(values(lists.place)[: len(listed)], by_key)
        assert np.array_equal(values(lists.last), np.cumsum(np.bincount(key[listed], None, KEYS)))
        group = (7 * np.arange(count) + key) % groups
        assert np.array_equal(values(lists.order)[:count], 2 * np.argsort(group, kind="stable"))
        ends = np.cumsum(np.bincount(group, None, groups))
        assert np.array_equal(values(lists.first)[1 : groups + 1], ends)
