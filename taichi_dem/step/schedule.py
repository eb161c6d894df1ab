"""Who is due: levels of bodies, and lists of bodies, bonds and pairs in order of falling level.

A list sorted by level makes the members due at a tick its first part. When a level changes, only
the part that is due needs sorting anew, so that keeping order costs less than using it.
"""

import taichi as ti

from taichi_dem.timeline import MACRO_TICKS, MAX_LEVEL, device_coarsest_due, device_ticks_of
from taichi_dem.types import real


@ti.data_oriented
class DueList:
    """Indices in order of falling key; end[k] counts the members with a key of at least k.

    The order within a key does not matter: nothing that is computed depends on it.
    """

    def __init__(self, capacity):
        self.order = ti.field(ti.i32, shape=max(1, capacity))
        self.end = ti.field(ti.i32, shape=MAX_LEVEL + 2)
        self.member = ti.field(ti.i32, shape=max(1, capacity))
        self.key = ti.field(ti.i32, shape=max(1, capacity))
        self.start = ti.field(ti.i32, shape=MAX_LEVEL + 1)

    @ti.func
    def count(self, low):
        """Number of members with a key of at least low."""
        return self.end[low]

    @ti.func
    def pick(self, a):
        """Member at place a."""
        return self.order[a]

    @ti.func
    def fill(self, count):
        """Take in the members 0 .. count - 1 in any order, as if all had key 0."""
        for a in range(count):
            self.order[a] = a
        for k in range(MAX_LEVEL + 2):
            self.end[k] = 0
        self.end[0] = count

    @ti.func
    def sort_due(self, low, key_of: ti.template()):
        """Sort the members of key >= low by their present keys.

        A member whose key fell below low cannot leave the due part: it stays at low and is
        moved on at the next tick where a lower level is due. Returns 1 if there is one.
        A negative key at low 0 leaves the list. key_of: function of a member.
        """
        count = self.end[low]
        for k in range(low, MAX_LEVEL + 1):
            self.start[k] = 0
        waiting = 0
        for a in range(count):
            key = key_of(self.order[a])
            if key < low and low > 0:
                key = low
                waiting = 1
            self.member[a] = self.order[a]
            self.key[a] = key
            if key >= 0:
                self.start[key] += 1
        self._number(low)
        for a in range(count):
            key = self.key[a]
            if key >= 0:
                self.order[self.start[key]] = self.member[a]
                self.start[key] += 1
        return waiting

    @ti.func
    def _number(self, low):
        """Turn counts by key into first places and ends, finest first."""
        total = 0
        for back in range(MAX_LEVEL + 1 - low):
            k = MAX_LEVEL - back
            members = self.start[k]
            self.start[k] = total
            total += members
            self.end[k] = total


@ti.data_oriented
class Schedule:
    """Clock and due lists of a run.

    criterion: rule from ``step_control``. uniform: all bodies share the finest level wanted.
    drifted: bodies next to a due one are brought to its time too, else only due bodies move.
    dt0 [s]: step of level 0. finest: finest level present. low: coarsest level now due.
    evaluations: substeps, bodies advanced, bonds and pairs evaluated, and the bonds and pairs that
    one step for all would have evaluated in the same substeps.
    """

    def __init__(self, model, state, contacts, criterion, dt0, uniform, drifted):
        self.model, self.state, self.contacts = model, state, contacts
        self.criterion, self.uniform, self.drifted = criterion, uniform, drifted
        self.has_contact = contacts is not None
        self.dt0 = dt0
        self.tick_seconds = dt0 / MACRO_TICKS
        self.step_seconds = ti.field(real, shape=MAX_LEVEL + 1)
        for k in range(MAX_LEVEL + 1):
            self.step_seconds[k] = dt0 / 2.0**k
        self.bodies = DueList(model.body_count)
        self.bonds = DueList(model.bond_count)
        self.pairs = DueList(contacts.capacity if contacts else 1)
        self.low = ti.field(ti.i32, shape=())
        self.finest = ti.field(ti.i32, shape=())
        self.dirty = ti.field(ti.i32, shape=())
        self.waiting = ti.field(ti.i32, shape=())
        self.wanted = ti.field(ti.i32, shape=())
        self.evaluations = ti.field(ti.i64, shape=5)

    @ti.func
    def pair_step(self, i, j):
        """Seconds until two bodies are looked at again: the smaller of their steps."""
        return self.step_seconds[ti.max(self.state.level[i], self.state.level[j])]

    @ti.func
    def elapsed(self, i):
        """Seconds since body i was last advanced."""
        ticks = self.state.tick[None] - self.state.last_tick[i]
        return ti.cast(ticks, real) * self.step_seconds[MAX_LEVEL]

    @ti.func
    def seconds(self, tick):
        """Time of a tick [s]."""
        return ti.cast(tick, real) * self.step_seconds[MAX_LEVEL]

    @ti.func
    def tick_on(self, one):
        """Move the clock to the next tick at which a body is due."""
        if ti.static(self.has_contact):
            self.evaluations[3] += self.pairs.end[self.low[None]]
            self.evaluations[4] += self.pairs.end[0]
        self.state.tick[None] += device_ticks_of(self.finest[None])
        self.low[None] = device_coarsest_due(self.state.tick[None])
        self.wanted[None] = 0

    @ti.func
    def choose_level(self, i, speed2):
        """Let body i, if it is its own time, take the step it wants."""
        low, level = self.low[None], self.state.level[i]
        if level >= low:
            wanted = self.criterion.wanted(level, speed2, low)
            if ti.static(self.uniform):
                # Ask first: an atomic for every body costs as much as its rotation.
                if wanted > self.wanted[None]:
                    ti.atomic_max(self.wanted[None], wanted)
            elif wanted != level:
                self.state.level[i] = wanted
                self.dirty[None] = 1

    @ti.func
    def put_in_order(self, one):
        """Sort what is due by its new levels, if any has changed."""
        if ti.static(self.uniform):
            self._level_all()
        low = self.low[None]
        if self.dirty[None] == 1 or low <= self.waiting[None]:
            self.dirty[None] = 0
            waiting = self.bonds.sort_due(low, self._bond_key)
            if ti.static(self.has_contact):
                waiting |= self.pairs.sort_due(low, self._pair_key)
            waiting |= self.bodies.sort_due(low, self._body_key)
            # A member that waits for a still coarser tick goes on waiting.
            if low <= self.waiting[None]:
                self.waiting[None] = -1
            if waiting == 1:
                self.waiting[None] = low - 1
            self._find_finest()
        self._count()

    @ti.func
    def start_all(self):
        """Fill all lists anew and sort them, as if level 0 were due."""
        if ti.static(self.uniform):
            self._level_all()
        self.bodies.fill(self.model.body_count)
        self.bonds.fill(self.model.bond_count)
        self.waiting[None] = -1
        self.bodies.sort_due(0, self._body_key)
        self.bonds.sort_due(0, self._bond_key)
        if ti.static(self.has_contact):
            self.start_pairs()
        self._find_finest()

    @ti.func
    def start_pairs(self):
        """Take in the pairs of a new contact search; neighbours may now reach further."""
        self.pairs.fill(self.contacts.pair_count[None])
        self.pairs.sort_due(0, self._pair_key)
        if ti.static(self.drifted):
            self.bodies.fill(self.model.body_count)
            self.bodies.sort_due(0, self._body_key)

    @ti.func
    def _level_all(self):
        """Give every body the finest level that any of them wants."""
        if self.wanted[None] != self.state.level[0]:
            self.dirty[None] = 1
            for i in range(self.model.body_count):
                self.state.level[i] = self.wanted[None]

    @ti.func
    def _find_finest(self):
        finest = MAX_LEVEL
        while finest > 0 and self.bodies.end[finest] == 0:
            finest -= 1
        self.finest[None] = finest

    @ti.func
    def _count(self):
        """Count what this tick evaluates: substeps, bodies, bonds, contact pairs."""
        low = self.low[None]
        self.evaluations[0] += 1
        self.evaluations[1] += self.bodies.end[low]
        self.evaluations[2] += self.bonds.end[low]
        self.evaluations[4] += self.bonds.end[0]

    @ti.func
    def _bond_key(self, b):
        key = -1
        if self.state.broken_tick[b] < 0:
            slots = self.model.bond_slots[b]
            key = ti.max(self.state.level[slots[0] >> 2], self.state.level[slots[1] >> 2])
        return key

    @ti.func
    def _pair_key(self, p):
        pair = self.contacts.pair_body[p]
        return ti.max(self.state.level[pair[0]], self.state.level[pair[1]])

    @ti.func
    def _body_key(self, i):
        """Own level, or the finest level among those it touches where neighbours drift along."""
        key = self.state.level[i]
        if ti.static(self.drifted):
            for f in range(4):
                j = self.model.neighbour[4 * i + f]
                if j >= 0:
                    if self.state.broken_tick[self.model.face_bond[4 * i + f]] < 0:
                        key = ti.max(key, self.state.level[j])
            if ti.static(self.has_contact):
                key = ti.max(key, self.contacts.finest_partner(i))
        return key
