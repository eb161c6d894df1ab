"""The pair store: everything that belongs to a near pair of bodies, in a slot of its own."""

import numpy as np
import taichi as ti

from taichi_dem.kit.allocation import values
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.types import real, vec4

#: Sphere pairs that may be out of use, beside as many as are in use, before the rest is packed.
SLACK = 4096


@ti.data_oriented
class Columns:
    """Data of effects and methods for a pair or a sphere pair, by name; zero for a new one."""

    def __init__(self, entries: int):
        self.entries = entries
        self.by_name: dict[str, ti.Field] = {}
        self.members: tuple[ti.Field, ...] = ()

    def __len__(self):
        return len(self.members)

    def declare(self, name: str, kind: object, width: int = 0) -> ti.Field:
        """Field of a new column; width: components, 0 for a number."""
        if name in self.by_name:
            raise InputError(f"a column of the pair store must have a new name, got {name!r}")
        n = self.entries
        column = ti.Vector.field(width, kind, shape=n) if width else ti.field(kind, shape=n)
        self.by_name[name] = column
        self.members += (column,)
        return column

    @ti.func
    def clear(self, k):
        """Set all columns of entry k to zero."""
        for column in ti.static(self.members):
            column[k] = 0

    @ti.func
    def copy(self, source, k):
        """Copy an entry of all columns to entry k."""
        for column in ti.static(self.members):
            column[k] = column[source]


@ti.data_oriented
class PairStore:
    """Slots of near pairs of bodies, their sphere pairs, and the order in which pairs are visited.

    body: the two bodies of a slot, first < second; first .. last: places of its sphere pairs;
    impulse[2 p + side]: pending impulse [N s] and moment about the body's centre [N m s], valid
    where waiting is 1; heat: of dashpots, friction, injected and of the law [J], until the first
    body takes it. Other columns are zero when their pair comes near, or their sphere pair is found.

    Pairs are visited by (first body, second body), whatever the order of slots, so that sums do not
    depend on the history of searches: first_of[i], second_start[i]: where those of body i begin.
    """

    scratch_fields = ("sphere_place",)

    def __init__(self, bodies: int, slots: int, spheres: int):
        self.slots, self.spheres = slots, spheres
        self._allocate_slots(slots)
        self.sphere = ti.Vector.field(2, ti.i32, shape=spheres)
        self.owner = ti.field(ti.i32, shape=spheres)
        self.sphere_count, self.sphere_end = (ti.field(ti.i32, shape=()) for _ in range(2))
        self.columns, self.sphere_columns = Columns(slots), Columns(spheres)
        self.near_count = ti.field(ti.i32, shape=())
        self.near_slot = ti.field(ti.i32, shape=slots)
        self.first_of = ti.field(ti.i32, shape=bodies + 1)
        self.second_start = ti.field(ti.i32, shape=bodies + 2)
        self.second_slot = ti.field(ti.i32, shape=slots)

    def _allocate_slots(self, slots):
        self.body, self.waiting = (ti.Vector.field(2, ti.i32, shape=slots) for _ in range(2))
        self.first, self.last, self.is_new = (ti.field(ti.i32, shape=slots) for _ in range(3))
        self.sphere_place, self.free = (ti.field(ti.i32, shape=slots) for _ in range(2))
        self.impulse = ti.Vector.field(6, real, shape=2 * slots)
        self.heat = ti.Vector.field(4, real, shape=slots)
        self.deepest = ti.field(real, shape=slots)
        self.free_count, self.used_end = (ti.field(ti.i32, shape=()) for _ in range(2))

    def column(self, name: str, kind: object, width: int = 0) -> ti.Field:
        """Field with an entry a slot; kind: data type, width: components, 0 for a number."""
        return self.columns.declare(name, kind, width)

    def sphere_column(self, name: str, kind: object, width: int = 0) -> ti.Field:
        """The same with an entry a sphere pair."""
        return self.sphere_columns.declare(name, kind, width)

    def near_table(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Near pairs in order: both bodies (n, 2), number of sphere pairs (n,) and deepest (n,)."""
        slots = values(self.near_slot, slice(int(values(self.near_count))))
        counts = values(self.last, slots) - values(self.first, slots)
        return values(self.body, slots), counts, values(self.deepest, slots)

    @ti.func
    def number(self):
        """Number of near pairs."""
        return self.near_count[None]

    @ti.func
    def slot_at(self, a):
        """Slot of the pair at a place of all near pairs."""
        return self.near_slot[a]

    @ti.func
    def place_of(self, p):
        """Place of a near pair among all near pairs."""
        place = self.first_of[self.body[p][0]]
        while self.near_slot[place] != p:
            place += 1
        return place

    @ti.func
    def slots_with(self, fresh, freed):
        """Number of slots with so many new pairs, once so many have been freed."""
        return self.used_end[None] + ti.max(0, fresh - freed - self.free_count[None])

    @ti.func
    def places_with(self, spheres):
        """Number of places with so many new sphere pairs."""
        return self.sphere_end[None] + spheres

    @ti.func
    def allocate(self, nth, freed, i, j):
        """Slot of the nth new pair of a search that has freed some, all of it zero."""
        left = self.free_count[None] + freed - 1 - nth
        p = self.used_end[None] - 1 - left
        if left >= 0:
            p = self.free[left]
        self.body[p] = [i, j]
        self.clear_slot(p)
        return p

    @ti.func
    def take(self, fresh, spheres, freed):
        """Take over what a search has allocated, reserved and freed."""
        left = self.free_count[None] + freed - fresh
        self.free_count[None] = ti.max(left, 0)
        self.used_end[None] = self.used_end[None] + ti.max(-left, 0)
        self.sphere_end[None] = self.sphere_end[None] + spheres

    @ti.func
    def clear_slot(self, p):
        """Reset the slot of a pair."""
        self.first[p], self.last[p], self.waiting[p], self.is_new[p] = 0, 0, [0, 0], 1
        self.heat[p], self.deepest[p] = vec4(0.0), 0.0
        for slot in range(2 * p, 2 * p + 2):
            self.impulse[slot] = ti.Vector.zero(real, 6)
        self.columns.clear(p)

    @ti.func
    def release(self, p, nth):
        """Free the slot of a pair, the nth of a search, and the places of its sphere pairs."""
        self.remove_spheres(p)
        self.free[self.free_count[None] + nth] = p

    @ti.func
    def waits(self, p):
        """Whether an impulse or heat waits for a body of a pair."""
        return self.waiting[p][0] == 1 or self.waiting[p][1] == 1

    @ti.func
    def remove_spheres(self, p):
        """Free the places of the sphere pairs of a pair."""
        self.first[p], self.last[p] = 0, 0

    @ti.func
    def reserve_spheres(self, p, place):
        """Keep new places for the sphere pairs of a pair, from this one on."""
        self.sphere_place[p], self.owner[place] = place, p

    @ti.func
    def replace_spheres(self, p, count):
        """Replace the sphere pairs of a pair by those at its new places."""
        # Sphere pairs that were present keep their columns; those of new ones are zero.
        start = self.sphere_place[p]
        end = start + count
        if ti.static(len(self.sphere_columns) > 0):
            for k in range(start, end):
                former = self._former(p, self.sphere[k], k - start)
                if former >= 0:
                    self.sphere_columns.copy(former, k)
                else:
                    self.sphere_columns.clear(k)
        self.first[p], self.last[p] = start, end

    @ti.func
    def _former(self, p, spheres, nth):
        """Present place of two spheres of a pair, -1 where they are not listed."""
        first, last, slot = self.first[p], self.last[p], -1
        if first + nth < last:
            if self._is(first + nth, spheres):
                slot = first + nth
        if slot < 0:
            for k in range(first, last):
                if self._is(k, spheres):
                    slot = k
        return slot

    @ti.func
    def _is(self, k, spheres):
        same = self.sphere[k] == spheres
        return same.all()

    @ti.func
    def pack_if_sparse(self):
        """Pack the sphere pairs where too many places are out of use."""
        end, used = self.sphere_end[None], self.sphere_count[None]
        if end > 2 * used + SLACK or end > self.spheres // 2:
            self.pack_spheres()

    @ti.func
    def pack_spheres(self):
        """Move the sphere pairs that are in use together."""
        k, packed = 0, 0
        while k < self.sphere_end[None]:
            p = self.owner[k]
            count = 0
            if self.first[p] == k:
                count = self.last[p] - k
            for a in range(count):
                self.sphere[packed + a] = self.sphere[k + a]
                self.sphere_columns.copy(k + a, packed + a)
            if count > 0:
                self.owner[packed] = p
                self.first[p], self.last[p] = packed, packed + count
            packed += count
            k += ti.max(1, count)
        self.sphere_end[None] = packed
