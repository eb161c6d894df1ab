"""Search for contact pairs: the broken ones among the neighbouring faces, then their spheres.

The list is renewed when a body may have left the skin, or at once when a bond breaks: a search
looks at the bodies that moved or broke, and keeps what it knows of the others. Impulses that wait
in the slots of a pair are carried over, so results do not depend on when a search is made.
"""

import taichi as ti

from taichi_dem.errors import InputError
from taichi_dem.step.cells import group
from taichi_dem.step.neighbours import Neighbours
from taichi_dem.step.old_pairs import OldPairs
from taichi_dem.types import real

_ROOM = ("", "pairs_per_body", "spheres_per_body")


@ti.data_oriented
class BroadPhase:
    """Finds the pairs and fills the lists of a ``Contacts``.

    solver: of the dashpots, whose impulses go with the pairs, None without. brute_force: compare
    all bodies with broken faces, for tests. serial: one loop for all, for one core. looked: 1 for
    the bodies at which a search looks, all of them everywhere; searched: tick of the last one.
    """

    def __init__(self, contacts, schedule, solver=None, brute_force=False, serial=False):
        n = contacts.model.body_count
        self.contacts, self.schedule = contacts, schedule
        self.solver, self.solves = solver, solver is not None
        self.serial, self.phases = serial, None
        self.model, self.state = contacts.model, contacts.state
        self.rough = ti.field(ti.i32, shape=n)
        self.rough_count = ti.field(ti.i32, shape=())
        self.near = Neighbours(contacts, brute_force)
        self.pair_faces = ti.field(ti.i32, shape=contacts.capacity)
        self.searched = ti.field(ti.i64, shape=())
        self.looked = ti.field(ti.i32, shape=n)
        self.everywhere = ti.field(ti.i32, shape=())
        self.fresh = ti.field(ti.i32, shape=())
        self.old = OldPairs(contacts)
        self.full = ti.field(ti.i32, shape=())
        self.sphere = ti.Vector.field(3, real, shape=4 * n * self.model.spheres_per_face)

    def search(self, everywhere=True):
        """Renew the lists. Raises InputError when they outgrow the room the scene gave them.

        everywhere: look at all bodies, as is needed once they have been moved by hand.
        """
        self.everywhere[None] = int(everywhere)
        if self.phases is None:
            self.phases = self._phases()
        self._search()
        if self.near.stale[None] and not self.near.full[None]:
            # A row of neighbours had no room left.
            self._search()
        room = "neighbours_per_body" if self.near.full[None] else _ROOM[self.full[None]]
        if room:
            raise InputError(f"contact lists are full: give SphereContact a larger {room}")

    def _phases(self):
        """What a search does, as pairs of how often and what, in order."""
        return (
            (self._bodies, self.near.place),
            (self._once, self._begin),
            (self._bodies, self.near.count),
            (self._once, self._allot),
            (self._bodies, self.near.fill),
            (self._rough_bodies, self._place_spheres),
            (self._pairs, self._keep),
            (self._bodies, self._count_spheres),
            (self._once, self._number_pairs),
            (self._pairs, self._fill_pair),
            (self._once, self._end),
        )

    @ti.kernel
    def _search(self):
        if ti.static(self.serial):
            # One task: to wake a pool of threads a dozen times takes longer than the search.
            for _ in range(1):
                for count, item in ti.static(self.phases):
                    for a in range(count()):
                        item(a)
        else:
            for count, item in ti.static(self.phases):
                for a in range(count()):
                    item(a)

    @ti.func
    def _bodies(self):
        return self.model.body_count

    @ti.func
    def _rough_bodies(self):
        return self.rough_count[None]

    @ti.func
    def _pairs(self):
        return self.contacts.pair_count[None]

    @ti.func
    def _once(self):
        return 1

    @ti.func
    def _begin(self, one):
        self._list_rough()
        self.near.begin()
        self._choose_extent()

    @ti.func
    def _allot(self, one):
        self.near.allot()

    @ti.func
    def _end(self, one):
        self.near.end()
        self._index_second()
        self.schedule.start_pairs()
        self.contacts.search_due[None] = 0

    @ti.func
    def _list_rough(self):
        """List the bodies with spheres on some face, in order of their index."""
        count = 0
        newest = ti.cast(0, ti.i64)
        for i in range(self.model.body_count):
            exposed = 0
            for f in range(4):
                since = self.state.exposed_tick[4 * i + f]
                newest = ti.max(newest, since)
                if since >= 0:
                    exposed |= 1 << f
            self.contacts.rough[i] = exposed
            if exposed != 0:
                self.rough[count] = i
                count += 1
        self.rough_count[None] = count
        self.full[None] = 0
        # A second search at the tick of a break must not book its injection again.
        self.fresh[None] = ti.cast(newest > self.state.injected_tick[None], ti.i32)
        self.state.injected_tick[None] = newest

    @ti.func
    def _choose_extent(self):
        """Look at the bodies that went far into their skin or that a break has exposed.

        All are looked at while the list of neighbours is made anew.
        """
        far = 0.25 * self.contacts.skin[None]
        if self.near.making() or self.everywhere[None] == 1:
            far = -1.0
        for i in range(self.model.body_count):
            looked = ti.cast(self.contacts.travel[i] > far, ti.i32)
            for face in range(4 * i, 4 * i + 4):
                looked |= ti.cast(self.state.exposed_tick[face] > self.searched[None], ti.i32)
            self.looked[i] = looked
        for a in range(self.near.gone_count[None]):
            self.looked[self.near.gone[a]] = 1
        for i in range(self.model.body_count):
            if self.looked[i] == 1:
                self.contacts.travel[i] = 0.0
        self.searched[None] = self.state.tick[None]

    @ti.func
    def _place_spheres(self, a):
        """World positions of a rough body's spheres, computed once for the many that ask."""
        i = self.rough[a]
        size = ti.static(self.model.spheres_per_face)
        position, rotation = self.state.position[i], self.state.rotation[i]
        for face in range(4 * i, 4 * i + 4):
            if self.state.exposed_tick[face] >= 0:
                for s in range(size * face, size * face + size):
                    self.sphere[s] = position + rotation @ self.model.sphere[s].xyz

    @ti.func
    def _bonded(self, i, j):
        bonded = False
        for f in range(4):
            if self.model.neighbour[4 * i + f] == j:
                bonded = self.state.broken_tick[self.model.face_bond[4 * i + f]] < 0
        return bonded

    @ti.func
    def _keep(self, p):
        """Save a pair of the old list with what waits for it."""
        self.old.keep(p)
        if ti.static(self.schedule.has_rates):
            self.schedule.rates.near.keep(p)
        if ti.static(self.solves):
            self.solver.pairs.keep(p)

    @ti.func
    def _count_spheres(self, i):
        """Number of sphere pairs of body i with each neighbour that this search looks at."""
        self.old.first_of[i] = self.contacts.first_of[i]
        for k in range(self.near.first[i], self.near.last[i]):
            j = self.near.body[k]
            if self.looked[i] | self.looked[j] != 0:
                faces, spheres = self.near.faces[k] & self._broken_faces(i, j), 0
                if faces != 0:
                    if not self._bonded(i, j):
                        spheres = self._spheres_near(i, j, faces, 0, False)
                self.near.broken[k], self.near.spheres[k] = faces, spheres

    @ti.func
    def _broken_faces(self, i, j):
        """Bit 4 f + g for every broken face f of the one and g of the other."""
        first, second = self.contacts.rough[i], self.contacts.rough[j]
        # Bit f of the first goes to bit 4 f, and each such bit then takes a copy of the second.
        spread = (first & 1) | ((first & 2) << 3) | ((first & 4) << 6) | ((first & 8) << 9)
        return spread * second

    @ti.func
    def _spheres_near(self, i, j, faces, start, write):
        """Number of sphere pairs of two bodies within the skin; writes them from start on."""
        count = 0
        for fg in range(16):
            if (faces >> fg) & 1 == 1:
                face_i, face_j = 4 * i + fg // 4, 4 * j + fg % 4
                if self.near.clusters_near(face_i, face_j, self.contacts.skin[None]):
                    count += self._face_spheres(face_i, face_j, start + count, write)
        return count

    @ti.func
    def _face_spheres(self, face_i, face_j, start, write):
        count = 0
        size = ti.static(self.model.spheres_per_face)
        for a in range(size * face_i, size * face_i + size):
            reach = self.model.sphere[a][3] + self.contacts.skin[None]
            whole = reach + self.model.cluster[face_j][3]
            # A sphere that misses the ball around the other six misses all of them.
            if (self.near.cluster[face_j] - self.sphere[a]).norm_sqr() < whole * whole:
                for b in range(size * face_j, size * face_j + size):
                    gap = reach + self.model.sphere[b][3]
                    if (self.sphere[b] - self.sphere[a]).norm_sqr() < gap * gap:
                        if write:
                            self.contacts.pair_sphere[start + count] = [a, b]
                        count += 1
        return count

    @ti.func
    def _number_pairs(self, one):
        """Give the pairs that have spheres near, or an impulse waiting, a place in order."""
        self.old.first_of[self.model.body_count] = self.contacts.pair_count[None]
        self.contacts.pair_count[None] = 0
        self.contacts.pair_first[0] = 0
        for i in range(self.model.body_count):
            self.contacts.first_of[i] = self.contacts.pair_count[None]
            old, last = self.old.first_of[i], self.old.first_of[i + 1]
            for k in range(self.near.first[i], self.near.last[i]):
                if self.near.spheres[k] > 0:
                    j = self.near.body[k]
                    old = self._number_waiting(i, old, last, j)
                    self._number(i, j, self.near.broken[k], self.near.spheres[k])
            self._number_waiting(i, old, last, self.model.body_count)
        self.contacts.first_of[self.model.body_count] = self.contacts.pair_count[None]

    @ti.func
    def _number_waiting(self, i, old, last, j):
        """Number the old pairs of body i before partner j that hold something; next old pair."""
        while old < last and self.old.body[ti.min(old, last - 1)][1] <= j:
            partner = self.old.body[old][1]
            if partner < j:
                if self.old.waits(old):
                    self._number(i, partner, 0, 0)
            old += 1
        return old

    @ti.func
    def _number(self, i, j, faces, spheres):
        p = self.contacts.pair_count[None]
        last = self.contacts.pair_first[p] + spheres
        if p >= self.contacts.capacity:
            self.full[None] = 1
        elif last > self.contacts.sphere_capacity:
            self.full[None] = 2
        else:
            self.contacts.pair_body[p] = [i, j]
            self.pair_faces[p] = faces
            self.contacts.pair_first[p + 1] = last
            self.contacts.pair_count[None] = p + 1

    @ti.func
    def _fill_pair(self, p):
        """Write a pair's spheres, take over what waited for it, book what its birth injects."""
        i, j = self.contacts.pair_body[p][0], self.contacts.pair_body[p][1]
        old, injected = self.old.place(i, j), 0.0
        if self.looked[i] | self.looked[j] != 0:
            self._spheres_near(i, j, self.pair_faces[p], self.contacts.pair_first[p], True)
            injected = self._injected(p, i, j)
        else:
            self.old.copy_spheres(p, old)
        self.old.hand_over(p, old, injected)
        if ti.static(self.schedule.has_rates):
            self.schedule.rates.take_pair(p, old, self._exposed_now(i) | self._exposed_now(j))
        if ti.static(self.solves):
            self.solver.pairs.take(p, old, self.old)

    @ti.func
    def _exposed_now(self, i):
        """1 when a face of body i has got its spheres at this tick."""
        exposed = 0
        for face in range(4 * i, 4 * i + 4):
            exposed |= ti.cast(self.state.exposed_tick[face] == self.state.tick[None], ti.i32)
        return exposed

    @ti.func
    def _injected(self, p, i, j):
        """Energy [J] of overlaps that this tick's breaks have brought into being."""
        energy, tick = 0.0, self.state.tick[None]
        size = ti.static(self.model.spheres_per_face)
        fresh, freed = self.fresh[None] == 1, self._freed_at(i, j, tick)
        for k in range(self.contacts.pair_first[p], self.contacts.pair_first[p + 1]):
            a, b = self.contacts.pair_sphere[k][0], self.contacts.pair_sphere[k][1]
            born = ti.max(self.state.exposed_tick[a // size], self.state.exposed_tick[b // size])
            if fresh and (freed or born == tick):
                overlap = ti.max(0.0, -self.contacts.gap(i, j, a, b))
                energy += self.contacts.law.stored(overlap)
        return energy

    @ti.func
    def _freed_at(self, i, j, tick):
        """Whether the bond of two bodies was released at a tick."""
        freed = False
        for f in range(4):
            if self.model.neighbour[4 * i + f] == j:
                freed = self.state.broken_tick[self.model.face_bond[4 * i + f]] == tick
        return freed

    @ti.func
    def _index_second(self):
        """List for every body the pairs in which it is second, in order."""
        first, touch, pairs = ti.static(
            self.contacts.touch_first, self.contacts.touch, self.contacts.pair_count
        )
        group(first, touch, self.model.body_count, pairs[None], self._second_of)

    @ti.func
    def _second_of(self, p):
        return self.contacts.pair_body[p][1]
