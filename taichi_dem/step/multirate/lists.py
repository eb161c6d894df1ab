"""Lists of members for a phase: those active at a tick, by falling level; all; one."""

import taichi as ti

from taichi_dem.state.timeline import MAX_LEVEL


@ti.func
def itself(a):
    """Member function of lists whose members are 0 .. count - 1."""
    return a


@ti.func
def first_key(member):
    """Key function of lists in which all are active at the start."""
    return 0


@ti.data_oriented
class Places:
    """Base of lists whose members are the numbers 0 .. count - 1."""

    @ti.func
    def pick(self, a):
        """The place itself."""
        return a


@ti.data_oriented
class Once(Places):
    """List of one member, for phases that run once a substep."""

    @ti.func
    def count(self, low):
        """One."""
        return 1


@ti.data_oriented
class Everyone(Places):
    """List of all bodies or bonds of a scene, active or not. number: field of how many."""

    def __init__(self, number: ti.Field):
        self.number = number

    @ti.func
    def count(self, low):
        """Number of all."""
        return self.number[None]


@ti.data_oriented
class Colour:
    """The members of one colour: those from colour_first[colour] on, in their order."""

    def __init__(self, colour_first: ti.Field, colour: int):
        self.colour_first, self.colour = colour_first, colour

    @ti.func
    def count(self, low):
        """Number of members."""
        return self.colour_first[self.colour + 1] - self.colour_first[self.colour]

    @ti.func
    def pick(self, a):
        """Place of one of them."""
        return self.colour_first[self.colour] + a


@ti.data_oriented
class ActiveList:
    """Indices in order of falling key; end[k] counts the members with a key of at least k.

    order: the members; index: where in it each one is; key: each one's key, -1 for one that is
    not listed. The order within a key does not matter: nothing that is computed depends on it.
    """

    def __init__(self, capacity: int):
        self.order, self.index, self.key = (ti.field(ti.i32, shape=capacity) for _ in range(3))
        self.end = ti.field(ti.i32, shape=MAX_LEVEL + 2)

    @ti.func
    def count(self, low):
        """Number of members with a key of at least low."""
        return self.end[low]

    @ti.func
    def pick(self, a):
        """Member at place a."""
        return self.order[a]

    @ti.func
    def fill(self, count, member_of: ti.template(), key_of: ti.template()):
        """List those members whose key is not negative.

        member_of: function of 0 .. count - 1, ``itself`` where members are just these. key_of:
        function of a member.
        """
        for k in range(MAX_LEVEL + 2):
            self.end[k] = 0
        for a in range(count):
            m = member_of(a)
            key = key_of(m)
            self.key[m] = key
            if key >= 0:
                self.end[key] = self.end[key] + 1
        total = 0
        for back in range(MAX_LEVEL + 1):
            members = self.end[MAX_LEVEL - back]
            self.end[MAX_LEVEL - back] = total
            total += members
        for a in range(count):
            m = member_of(a)
            key = self.key[m]
            if key >= 0:
                self._put(m, self.end[key])
                self.end[key] = self.end[key] + 1

    @ti.func
    def move(self, m, key):
        """Change the key of a listed member; a negative one removes it.

        It changes places with the first, or last, of each key that it passes.
        """
        present = self.key[m]
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
    def insert(self, m, key):
        """List a member that is not listed, unless its key is negative."""
        if key >= 0 and self.key[m] < 0:
            self._put(m, self.end[0])
            self.end[0] = self.end[0] + 1
            self.key[m] = 0
            self.move(m, key)

    @ti.func
    def _swap(self, m, place):
        other, old = self.order[place], self.index[m]
        self._put(other, old)
        self._put(m, place)

    @ti.func
    def _put(self, m, place):
        self.order[place] = m
        self.index[m] = place
