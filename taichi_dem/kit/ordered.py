"""Lists and sums in a fixed order, made by any number of threads to the same bits."""

from collections.abc import Callable
from itertools import zip_longest
from typing import Any

import taichi as ti

from taichi_dem.kit import backend, runtime

#: Places of a chunk at least, and chunks at most: few threads of a CPU, many of a GPU.
_CPU, _GPU = (1024, 64), (32, 4096)
#: Chunks of which the sums are added up first where there are more.
_GROUP = 64
#: Bodies up to which a CPU makes light phases on one thread: to wake the others takes 30 us.
_SERIAL_UP_TO = 32768
#: A list, and the function that is called with each of its members.
Phases = tuple[tuple[Any, Callable[..., Any]], ...]


def is_serial(places: int) -> bool:
    """Whether one thread makes light phases over so many places at most."""
    settings: Any = runtime.settings()
    return settings.arch == "cpu" and (places <= _SERIAL_UP_TO or settings.threads == 1)


def tasks(phases: tuple, bodies: int) -> tuple[tuple[bool, tuple], ...]:
    """Phases by the loops of a parallel driver: whether each is on one thread, and which."""
    listed: list[tuple[bool, tuple]] = []
    for phase in phases:
        members = phase[0]
        serial = backend.is_cpu() and members.most == 1
        serial = serial or (members.light and is_serial(bodies))
        if serial and listed and listed[-1][0]:
            listed[-1] = True, (*listed[-1][1], phase)
        else:
            listed.append((serial, (phase,)))
    return tuple(listed)


@ti.data_oriented
class Places:
    """Base of lists whose members are the numbers 0 .. count - 1.

    light: whether to visit a member takes some nanoseconds only.
    """

    most: int
    light = False

    @ti.func
    def pick(self, a):
        """The place itself."""
        return a

    def loops(self, item: Callable[..., Any]) -> Phases:
        """Loops that visit the members: one, as none needs another's."""
        return ((self, item),)


@ti.data_oriented
class Once(Places):
    """List of one member, for phases that run once."""

    most = 1

    @ti.func
    def count(self, low):
        """One."""
        return 1


@ti.data_oriented
class Some(Places):
    """As many places as a function says, at most ``most``; light: as of ``Places``."""

    def __init__(self, number: Callable[..., Any], most: int, light: bool = False):
        self.number, self.most, self.light = number, most, light

    @ti.func
    def count(self, low):
        """Number of places."""
        return self.number()


@ti.data_oriented
class OnlyIf(Places):
    """A list that is empty unless a function says 1."""

    def __init__(self, due: Callable[..., Any], members: Any):
        self.due, self.members = due, members
        self.most, self.light = members.most, members.light

    @ti.func
    def count(self, low):
        """Number of members now."""
        return self.due() * self.members.count(low)

    @ti.func
    def pick(self, a):
        """Member at place a."""
        return self.members.pick(a)


@ti.data_oriented
class Joined(Places):
    """Phases that need nothing of each other as one; visit: what is done with each place."""

    light = True

    def __init__(self, phases: Phases):
        mosts = [members.most for members, _ in phases]
        self.parts = tuple((*phase, sum(mosts[:k])) for k, phase in enumerate(phases))
        self.most = sum(mosts)

    @ti.func
    def count(self, low):
        """Room of all."""
        return self.most

    @ti.func
    def visit(self, a):
        """Visit the member of the list to which a place belongs, if there is one."""
        for members, item, begin in ti.static(self.parts):
            if begin <= a and a < begin + members.most and a - begin < members.count(0):
                item(members.pick(a - begin))


def side_by_side(*several: Phases) -> Phases:
    """Phases of several that need nothing of each other; on a GPU one loop for the first of all."""
    if backend.is_cpu():
        return tuple(phase for phases in several for phase in phases)
    together = (tuple(filter(None, phases)) for phases in zip_longest(*several))
    return tuple((joined, joined.visit) for joined in map(Joined, together))


@ti.data_oriented
class Chunks(Places):
    """Chunks of the places of a list, each of which is visited in order; at least ``fewest``."""

    light = True

    def __init__(self, members: Any, fewest: int = 0):
        self.members, self.fewest = members, fewest
        self.least, self.most = _CPU if backend.is_cpu() else _GPU
        self.most = min(self.most, -(-members.most // self.least))
        if is_serial(members.most):
            self.most = 1

    @ti.func
    def count(self, low):
        """Number of chunks."""
        count = self.fewest
        if ti.static(self.most > 1):
            number = self.members.count(0)
            size = self._size(number)
            count = ti.max((number + size - 1) // size, count)
        elif ti.static(self.fewest == 0):
            count = ti.min(self.members.count(0), 1)
        return count

    @ti.func
    def _size(self, number):
        """Places of a chunk; the last one may have fewer."""
        return ti.max(self.least, (number + self.most - 1) // self.most)

    @ti.func
    def span(self, c):
        """First place of a chunk, and one past its last."""
        first, last = 0, self.members.count(0)
        if ti.static(self.most > 1):
            size = self._size(last)
            first, last = c * size, ti.min(last, (c + 1) * size)
        return first, last


@ti.data_oriented
class RunningSums:
    """Sums of ``value(place)``, whole numbers, over all places of a list before a place.

    ``put(place, sum before, value)`` is called with each place, ``end(sum of all)`` after the last.
    """

    scratch_fields = ("total", "of_group")

    def __init__(
        self,
        places: Any,
        width: int,
        value: Callable[..., Any],
        put: Callable[..., Any],
        end: Callable[..., Any],
    ):
        self.chunks, self.width = Chunks(places), width
        self.value, self.put, self.end = value, put, end
        most = self.chunks.most
        self.total = ti.Vector.field(width, ti.i32, shape=most)
        self.grouped = most > _GROUP
        before: Phases = ((self.chunks, self._add),) if most > 1 else ()
        if self.grouped:
            groups = Some(self._groups, -(-most // _GROUP), light=True)
            self.of_group = ti.Vector.field(width, ti.i32, shape=groups.most)
            before += ((groups, self._add_group),)
        self.phases: Phases = (*before, (self.chunks, self._give))

    @ti.func
    def _add(self, c):
        first, last = self.chunks.span(c)
        total = ti.Vector.zero(ti.i32, self.width)
        for a in range(first, last):
            total += self.value(a)
        self.total[c] = total

    @ti.func
    def _groups(self):
        return (self.chunks.count(0) + _GROUP - 1) // _GROUP

    @ti.func
    def _add_group(self, g):
        self.of_group[g] = self._sum(g * _GROUP, ti.min((g + 1) * _GROUP, self.chunks.count(0)))

    @ti.func
    def _sum(self, first, last):
        total = ti.Vector.zero(ti.i32, self.width)
        for c in range(first, last):
            total += self.total[c]
        return total

    @ti.func
    def _before(self, c):
        total = ti.Vector.zero(ti.i32, self.width)
        if ti.static(self.grouped):
            for g in range(c // _GROUP):
                total += self.of_group[g]
            total += self._sum(c // _GROUP * _GROUP, c)
        elif ti.static(self.chunks.most > 1):
            total = self._sum(0, c)
        return total

    @ti.func
    def _give(self, c):
        """Give each place of a chunk its sum."""
        first, last = self.chunks.span(c)
        total = self._before(c)
        for a in range(first, last):
            value = self.value(a)
            self.put(a, total, value)
            total += value
        if c == self.chunks.count(0) - 1:
            self.end(total)


@ti.data_oriented
class CountingSort:
    """Sorts the members of a list by few keys; those of one key keep their order.

    key_of: negative for a member that is left out. put(member, place); end(key, one past its last).
    """

    scratch_fields = ("counts",)

    def __init__(
        self,
        members: Any,
        keys: int,
        key_of: Callable[..., Any],
        kept: Callable[..., Any],
        put: Callable[..., Any],
        end: Callable[..., Any],
        falling: bool = False,
    ):
        self.chunks, self.members, self.keys = Chunks(members, fewest=1), members, keys
        self.key_of, self.kept, self.put, self.end = key_of, kept, put, end
        self.falling = falling
        # Members of each key and chunk, in the order of the sort; then those that come before them.
        self.counts = ti.field(ti.i32, shape=self.chunks.most * keys)
        places = Some(self._places, self.chunks.most * keys, light=True)
        before = RunningSums(places, 1, self._count, self._begin, self._end)
        self.phases: Phases = (
            (self.chunks, self.tally),
            *before.phases,
            (self.chunks, self.place),
        )

    @ti.func
    def _places(self):
        return self.keys * self.chunks.count(0)

    @ti.func
    def at(self, c, key):
        """Place of a chunk and a key in ``counts``."""
        if ti.static(self.falling):
            key = self.keys - 1 - key
        if ti.static(self.chunks.most > 1):
            key = key * self.chunks.count(0) + c
        return key

    @ti.func
    def tally(self, c):
        """Count the members of a chunk by key."""
        for key in range(self.keys):
            self.counts[self.at(c, key)] = 0
        first, last = self.chunks.span(c)
        for a in range(first, last):
            key = self.key_of(self.members.pick(a))
            if key >= 0:
                at = self.at(c, key)
                self.counts[at] = self.counts[at] + 1

    @ti.func
    def _count(self, at):
        return ti.Vector([self.counts[at]])

    @ti.func
    def _begin(self, at, before, value):
        """Take over where the members of a chunk and key begin."""
        self.counts[at] = before[0]
        chunks, key = 1, at
        if ti.static(self.chunks.most > 1):
            chunks = self.chunks.count(0)
            key = at // chunks
        if at == key * chunks + chunks - 1:
            if ti.static(self.falling):
                key = self.keys - 1 - key
            self.end(key, before[0] + value[0])

    @ti.func
    def _end(self, total):
        """Nothing is left to do."""

    @ti.func
    def place(self, c):
        """Put the members of a chunk where they come."""
        first, last = self.chunks.span(c)
        for a in range(first, last):
            m = self.members.pick(a)
            key = self.kept(m)
            if key >= 0:
                at = self.at(c, key)
                self.put(m, self.counts[at])
                self.counts[at] = self.counts[at] + 1

    @ti.func
    def sort(self):
        """All of it, by one thread."""
        for members, item in ti.static(self.phases):
            for a in range(members.count(0)):
                item(members.pick(a))


@ti.data_oriented
class Grouping:
    """Lists members by many keys: those of key c, in order, at order[first[c]] .. first[c + 1]."""

    def __init__(
        self,
        first: ti.Field,
        order: ti.Field,
        keys: Any,
        members: Any,
        key_of: Callable[..., Any],
        named: Callable[..., Any],
    ):
        self.first, self.order, self.keys = first, order, keys
        self.key_of, self.named = key_of, named
        # Zero between two calls: each member that is counted is placed.
        self.counts = ti.field(ti.i32, shape=keys.most)
        sums = RunningSums(keys, 1, self._count_of, self._begin, self._end)
        self.phases: Phases = (
            (members, self._count),
            *sums.phases,
            (members, self._place),
            (keys, self._put_in_order),
        )

    @ti.func
    def _count(self, a):
        ti.atomic_add(self.counts[self.key_of(a)], 1)

    @ti.func
    def _count_of(self, c):
        return ti.Vector([self.counts[c]])

    @ti.func
    def _begin(self, c, before, value):
        self.first[c] = before[0]

    @ti.func
    def _end(self, total):
        self.first[self.keys.count(0)] = total[0]

    @ti.func
    def _place(self, a):
        """Put a member anywhere among those of its key."""
        key = self.key_of(a)
        self.order[self.first[key] + ti.atomic_sub(self.counts[key], 1) - 1] = a

    @ti.func
    def _put_in_order(self, c):
        """Put the members of a key in order, and write what they are named."""
        start, end = self.first[c], self.first[c + 1]
        for k in range(start + 1, end):
            a, place = self.order[k], k
            while place > start and self.order[ti.max(place - 1, 0)] > a:
                self.order[place] = self.order[place - 1]
                place -= 1
            self.order[place] = a
        for k in range(start, end):
            self.order[k] = self.named(self.order[k])
