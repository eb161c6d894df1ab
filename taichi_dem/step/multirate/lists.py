"""Lists of members for a phase: those active at a tick, by falling level; all; of one colour."""

from collections.abc import Callable
from typing import Any

import taichi as ti

from taichi_dem.kit.ordered import CountingSort, Once, Phases, Places
from taichi_dem.state.timeline import MAX_LEVEL


@ti.data_oriented
class Everyone(Places):
    """List of all bodies, bonds or near pairs of a scene, active or not."""

    def __init__(self, number: ti.Field, most: int, slots: ti.Field | None = None):
        self.number, self.most = number, most
        self.slots, self.has_slots = slots, slots is not None

    @ti.func
    def count(self, low):
        """Number of all."""
        return self.number[None]

    @ti.func
    def pick(self, a):
        """Member at place a."""
        if ti.static(self.has_slots):
            a = self.slots[a]
        return a


@ti.data_oriented
class Colour(Places):
    """Members of one colour: those from colour_first[colour] on, in order; most: of all colours."""

    def __init__(self, colour_first: ti.Field, colour: int, most: int):
        self.colour_first, self.colour, self.most = colour_first, colour, most

    @ti.func
    def count(self, low):
        """Number of members."""
        return self.colour_first[self.colour + 1] - self.colour_first[self.colour]

    @ti.func
    def pick(self, a):
        """Place of one of them."""
        return self.colour_first[self.colour] + a


@ti.data_oriented
class Coloured(Places):
    """Members of all colours in their order; those of one share nothing."""

    def __init__(
        self,
        colour_first: ti.Field,
        colours: int,
        most: int,
        end: int | None = None,
        rest: Any = None,
    ):
        self.colour_first, self.colours, self.most = colour_first, colours, most
        self.end, self.rest = colours if end is None else end, rest

    @ti.func
    def count(self, low):
        """Number of all members."""
        return self.colour_first[self.end]

    def loops(self, item: Any) -> Phases:
        """A loop a colour, and one for the rest."""
        colours = (Colour(self.colour_first, c, self.most) for c in range(self.colours))
        each: Phases = tuple((colour, item) for colour in colours)
        return each if self.rest is None else (*each, (Once(), self.rest))


@ti.data_oriented
class ActiveList(Places):
    """Indices in order of falling key; end[k] counts the members with a key of at least k.

    everyone: all members. key_of: gives a member's key, negative for one that is not listed. order:
    the members; index: where in it each one is; key: each one's key. listing: lists all members.
    """

    def __init__(self, everyone: Everyone, key_of: Callable[..., Any]):
        self.everyone, self.most, self.key_of = everyone, everyone.most, key_of
        self.order, self.index, self.key = (ti.field(ti.i32, shape=self.most) for _ in range(3))
        self.end = ti.field(ti.i32, shape=MAX_LEVEL + 2)
        keys = MAX_LEVEL + 1, self._note, self._kept, self._put, self._end
        self.listing = CountingSort(everyone, *keys, falling=True)

    @ti.func
    def count(self, low):
        """Number of members with a key of at least low."""
        return self.end[low]

    @ti.func
    def pick(self, a):
        """Member at place a."""
        return self.order[a]

    @ti.func
    def _note(self, m):
        """Note the present key of a member."""
        key = self.key_of(m)
        self.key[m] = key
        return key

    @ti.func
    def _kept(self, m):
        return self.key[m]

    @ti.func
    def _end(self, key, last):
        self.end[key] = last

    @ti.func
    def renew(self, m):
        """Move a listed member to its present key; a negative one removes it."""
        present, key = self.key[m], self.key_of(m)
        self.key[m] = key
        while present < key and present >= 0:
            present += 1
            self._swap(m, self.end[present])
            self.end[present] = self.end[present] + 1
        while present > key:
            self.end[present] = self.end[present] - 1
            self._swap(m, self.end[present])
            present -= 1

    @ti.func
    def insert(self, m):
        """List a member that is not listed, unless its key is negative; whether that was done."""
        new = self.key[m] < 0 and self.key_of(m) >= 0
        if new:
            self._put(m, self.end[0])
            self.end[0] = self.end[0] + 1
            self.key[m] = 0
            self.renew(m)
        return new

    @ti.func
    def _swap(self, m, place):
        other, old = self.order[place], self.index[m]
        self._put(other, old)
        self._put(m, place)

    @ti.func
    def _put(self, m, place):
        self.order[place] = m
        self.index[m] = place
