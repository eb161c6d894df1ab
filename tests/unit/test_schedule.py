"""Active lists and the step rule, on made-up keys and speeds."""

from types import SimpleNamespace

import numpy as np
import pytest
import taichi as ti

from taichi_dem.stability.step_control import Displacement
from taichi_dem.step.active_list import ActiveList, itself
from taichi_dem.step.schedule import Schedule
from taichi_dem.timeline import MACRO_TICKS, MAX_LEVEL, coarsest_active


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
            self.list.fill(count, itself, self.key_of)

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
        sorter.move(member, int(keys[member]))
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


class WantedLevels:
    """Step rule of a test: every body wants a level that the test writes."""

    def __init__(self, levels):
        self.levels = ti.field(ti.i32, shape=len(levels))
        self.levels.from_numpy(levels)
        self.bodies = ti.field(ti.i32, shape=())

    @ti.func
    def wanted(self, level, speed2, low):
        """The body's number comes as its squared speed; no coarser than its time allows."""
        return ti.max(self.levels[ti.cast(speed2, ti.i32)], low)


def ring(count, uniform, levels):
    """Schedule of bodies in a ring, each bonded to the next; all it needs are fields."""
    slots = [[4 * i, 4 * ((i + 1) % count) + 1] for i in range(count)]
    faces, others = np.full((2, 4 * count), -1)
    for b, (first, second) in enumerate(slots):
        faces[[first, second]] = b
        others[[first, second]] = second // 4, first // 4
    tables = SimpleNamespace(
        on_demand=False,
        capacity=SimpleNamespace(bodies=count, bonds=count),
        body_count=filled(ti.i32, np.array(count)),
        bond_count=filled(ti.i32, np.array(count)),
        bond_slots=ti.Vector.field(2, ti.i32, shape=count),
        face_bond=filled(ti.i32, faces),
        neighbour=filled(ti.i32, others),
    )
    tables.bond_slots.from_numpy(np.array(slots, dtype=np.int32))
    state = SimpleNamespace(
        tick=filled(ti.i64, np.array(0)),
        broken_tick=filled(ti.i64, np.full(count, -1)),
        **{name: filled(ti.i32, np.zeros(count)) for name in ("level", "bound")},
        last_tick=filled(ti.i64, np.zeros(count)),
    )
    schedule = Schedule(tables, state, None, WantedLevels(levels), uniform, False)
    schedule.load(None, SimpleNamespace(dt0=1.0, distance=None))
    return schedule


def filled(kind, array):
    """Field with the values of an array."""
    field = ti.field(kind, shape=array.shape)
    field.from_numpy(array.astype(np.int64 if kind == ti.i64 else np.int32))
    return field


@ti.data_oriented
class Clock:
    """Runs a schedule alone; visits: how often each body and bond was due."""

    def __init__(self, schedule, count):
        self.schedule = schedule
        self.bodies, self.bonds = (ti.field(ti.i32, shape=count) for _ in range(2))

    @ti.kernel
    def start(self):
        """Fill the lists."""
        for _ in range(1):
            self.schedule.start_all()

    @ti.kernel
    def step(self):
        """Go to the next tick; all who are due choose their step."""
        low = ti.static(self.schedule.low)
        for _ in range(1):
            self.schedule.advance_clock(0)
            for a in range(self.schedule.bonds.count(low[None])):
                b = self.schedule.bonds.order[a]
                self.bonds[b] = self.bonds[b] + 1
            for a in range(self.schedule.bodies.count(low[None])):
                i = self.schedule.bodies.order[a]
                self.bodies[i] = self.bodies[i] + 1
                self.schedule.state.last_tick[i] = self.schedule.state.tick[None]
                self.schedule.choose_level(i, ti.cast(i, ti.f64))
            self.schedule.reorder(0)


@pytest.mark.parametrize("uniform", [False, True])
def test_a_schedule_alone_visits_each_body_and_bond_as_its_level_asks(uniform):
    """In a largest step 2^k times, a bond at the finer of its two levels; evaluations tell it."""
    levels = np.array([0, 3, 1, 5, 0, 2, 2], dtype=np.int32)
    count = len(levels)
    clock = Clock(ring(count, uniform, levels), count)
    clock.start()
    # The first step is a largest one for all, after it each has its level.
    clock.step()
    told = clock.schedule.evaluations.to_numpy()
    assert told[:3].tolist() == [1, count, count]
    own = np.full(count, levels.max()) if uniform else levels
    assert clock.schedule.state.level.to_numpy().tolist() == own.tolist()
    for field in (clock.bodies, clock.bonds):
        field.fill(0)
    for _ in range(2 ** levels.max()):
        clock.step()
    assert clock.schedule.state.tick[None] == 2 * MACRO_TICKS
    assert clock.schedule.state.last_tick.to_numpy().tolist() == [2 * MACRO_TICKS] * count
    finer = np.maximum(own, np.roll(own, -1))
    assert clock.bodies.to_numpy().tolist() == (2**own).tolist()
    assert clock.bonds.to_numpy().tolist() == (2**finer).tolist()
    told = clock.schedule.evaluations.to_numpy() - told
    visited = (2**finer).sum()
    assert told.tolist() == [2 ** own.max(), (2**own).sum(), visited, 0, count * 2**5, visited]
