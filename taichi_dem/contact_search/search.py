"""Search for contact pairs: the broken ones among the neighbouring faces, then their spheres.

The list is renewed when a body may have used up its body skin, or at once when a bond breaks: a
search looks at the bodies that moved or broke, and keeps what it knows of the others. Impulses that
wait in the slots of a pair are carried over, so results do not depend on when a search is made.
"""

import taichi as ti

from taichi_dem.contact_search.candidates import Candidates
from taichi_dem.contact_search.cell_grid import group
from taichi_dem.contact_search.narrow_phase import NarrowPhase
from taichi_dem.contact_search.numbering import Numbering
from taichi_dem.contact_search.old_pairs import OldPairs
from taichi_dem.contact_search.verlet_list import FAR, VerletList
from taichi_dem.kit.allocation import assign, values
from taichi_dem.kit.errors import InputError

_CAPACITIES = ("", "pairs_per_body", "spheres_per_body", "neighbours_per_body")


@ti.data_oriented
class BroadPhase:
    """Finds the pairs and fills the lists of a ``Contacts``.

    solver: of the dashpots, whose impulses go with the pairs, None without. brute_force: compare
    all bodies with broken faces, for tests. everywhere: 1 when the next search looks at all bodies,
    as is needed once they have been moved by hand. looked: 1 for those at which the last one
    looked; searched: its tick. searches: how many there were. full: which list has no room left,
    an index into ``_CAPACITIES``.
    """

    scratch_fields = ("exposed", "exposed_count", "looked")

    def __init__(self, contacts, schedule, solver=None, brute_force=False):
        n = contacts.tables.capacity.bodies
        self.contacts, self.schedule = contacts, schedule
        self.solver, self.solves = solver, solver is not None
        self.tables, self.state = contacts.tables, contacts.state
        self.exposed = ti.field(ti.i32, shape=n)
        self.exposed_count = ti.field(ti.i32, shape=())
        self.neighbours = VerletList(contacts, brute_force)
        self.pair_cache = self.neighbours.pair_cache
        self.spheres = NarrowPhase(contacts, self.pair_cache)
        self.searched = ti.field(ti.i64, shape=())
        self.looked = ti.field(ti.i32, shape=n)
        self.everywhere = ti.field(ti.i32, shape=())
        self.fresh = ti.field(ti.i32, shape=())
        self.old = OldPairs(contacts)
        self.candidates = Candidates(contacts, solver)
        self.full = ti.field(ti.i32, shape=())
        self.numbering = Numbering(contacts, self.neighbours, self.old, self.candidates, self.full)
        self.searches = ti.field(ti.i32, shape=())

    def load(self, model, method):
        """Let the first search make all lists."""
        self.neighbours.load(model, method)

    def ask(self, everywhere=False):
        """Let the driver make a search before its next step."""
        assign(self.everywhere, int(everywhere))
        assign(self.contacts.search_requested, 1)

    def renew(self):
        """Renew the lists, a parallel loop a phase, until no search is due."""
        while values(self.contacts.search_requested):
            self._search()

    def search(self, everywhere=True):
        """Renew the lists now. Raises InputError when they exceed their capacity."""
        self.ask(everywhere)
        self.renew()
        self.check_capacity()

    def check_capacity(self):
        """Raise InputError when lists exceed the capacity that the scene gave them."""
        option = _CAPACITIES[int(values(self.full))]
        if option:
            raise InputError(f"contact lists are full: give SphereContact a larger {option}")

    @property
    def phases(self):
        """What a search does, as pairs of how often and what, in order."""
        return (
            (self._once, self._list_exposed),
            (self._exposed_bodies, self._choose),
            (self._once, self._begin),
            (self._all_anew, self.neighbours.list_anew),
            (self.neighbours.making, self._sort),
            (self._all_anew, self.neighbours.count),
            (self.neighbours.making, self._allot),
            (self._all_anew, self.neighbours.fill),
            (self._all_amended, self.neighbours.amend),
            (self._exposed_bodies, self._note_places),
            (self._once, self.candidates.pack),
            (self._pairs, self._save_pair),
            (self._exposed_bodies, self._count_spheres),
            (self._once, self.numbering.number_pairs),
            (self._pairs, self._fill_pair),
            (self._once, self._end),
        )

    @ti.kernel
    def _search(self):
        for count, item in ti.static(self.phases):
            for a in range(count()):
                item(a)

    @ti.func
    def is_requested(self):
        """1 when a search is called for."""
        return self.contacts.search_requested[None]

    @ti.func
    def overflows(self):
        """1 when a list has no room left."""
        return ti.cast(self.full[None] != 0, ti.i32)

    @ti.func
    def _exposed_bodies(self):
        return self.exposed_count[None]

    @ti.func
    def _all_anew(self):
        return self.neighbours.making() * self.tables.body_count[None]

    @ti.func
    def _all_amended(self):
        return self.neighbours.amending() * self.tables.body_count[None]

    @ti.func
    def _pairs(self):
        return self.contacts.pair_count[None]

    @ti.func
    def _once(self):
        return 1

    @ti.func
    def _begin(self, one):
        self.neighbours.begin()
        self.searched[None] = self.state.tick[None]

    @ti.func
    def _sort(self, one):
        self.neighbours.grid.fill()

    @ti.func
    def _allot(self, one):
        self.neighbours.allot()

    @ti.func
    def _end(self, one):
        if self.neighbours.full[None] == 1:
            self.full[None] = 3
        self.neighbours.end()
        self._index_second()
        self.schedule.start_pairs()
        self.everywhere[None] = 0
        self.searches[None] = self.searches[None] + 1
        # A row of neighbours without room calls for another search, which makes the list anew.
        again = self.neighbours.stale[None] != 0 and self.full[None] == 0
        self.contacts.search_requested[None] = ti.cast(again, ti.i32)

    @ti.func
    def _list_exposed(self, one):
        """List the bodies with spheres on some face, in order of their index."""
        count = 0
        newest = ti.cast(0, ti.i64)
        for i in range(self.tables.body_count[None]):
            exposed = 0
            for f in range(4):
                since = self.state.exposed_tick[4 * i + f]
                newest = ti.max(newest, since)
                if since >= 0:
                    exposed |= 1 << f
            self.contacts.exposed_faces[i] = exposed
            self.looked[i] = 0
            if exposed != 0:
                self.exposed[count] = i
                count += 1
        self.exposed_count[None] = count
        self.full[None] = 0
        # A second search at the tick of a break must not book its injection again.
        self.fresh[None] = ti.cast(newest > self.state.injected_tick[None], ti.i32)
        self.state.injected_tick[None] = newest

    @ti.func
    def _choose(self, a):
        """Look at an exposed body if it used up much of its skin, or if a break exposed it."""
        i = self.exposed[a]
        far = self.contacts.travel[i] > FAR * self.contacts.body_skin[i]
        looked = self.everywhere[None] | ti.cast(far, ti.i32)
        for face in range(4 * i, 4 * i + 4):
            looked |= ti.cast(self.state.exposed_tick[face] > self.searched[None], ti.i32)
        self.looked[i] = looked
        if looked == 1:
            self.contacts.set_body_skin(i)
            self.neighbours.notice(i)

    @ti.func
    def _note_places(self, a):
        """Note where a body is that is looked at.

        The others count as lying where they were when they were last looked at: they have used up
        that much of their body skin since. All are looked at while the list of neighbours is made
        anew.
        """
        i = self.exposed[a]
        if self.neighbours.making() == 1:
            self.looked[i] = 1
        if self.looked[i] == 1:
            self.pair_cache.note_clusters(i, self.contacts.travel[i])
            self.contacts.travel[i] = 0.0
            self.spheres.note_spheres(i)

    @ti.func
    def _bonded(self, i, j):
        bonded = False
        for f in range(4):
            if self.tables.neighbour[4 * i + f] == j:
                bonded = self.state.broken_tick[self.tables.face_bond[4 * i + f]] < 0
        return bonded

    @ti.func
    def _save_pair(self, p):
        """Save a pair of the old list with what waits for it."""
        self.old.keep(p)
        if ti.static(self.schedule.has_limits):
            self.schedule.limits.contact_limits.save(p)

    @ti.func
    def _count_spheres(self, a):
        """Number of sphere pairs of an exposed body with each neighbour that is looked at."""
        i = self.exposed[a]
        looked = self.looked[i]
        for k in range(self.neighbours.first[i], self.neighbours.last[i]):
            j = self.neighbours.body[k]
            if looked | self.looked[j] != 0 and self.contacts.exposed_faces[j] != 0:
                faces = self.pair_cache.faces[k] & self._broken_faces(i, j)
                if self.everywhere[None] == 1 or self.pair_cache.may_gain_spheres(k, i, j, faces):
                    self._count_entry(k, i, j, faces)

    @ti.func
    def _count_entry(self, k, i, j, faces):
        """Count the spheres of entry k of the neighbours, and find how far apart the others are."""
        count, hits, gap = 0, 0, 0.0
        if not self._bonded(i, j):
            asked = faces
            if self.everywhere[None] == 0:
                asked = self.pair_cache.to_ask(k, i, j, faces)
            count, hits, gap = self.spheres.of_pair(i, j, asked, 0, False)
            if asked != faces:
                gap = ti.min(gap, self.pair_cache.gap(k, i, j))
        self.pair_cache.found(k, i, j, faces, count, hits, gap)

    @ti.func
    def _broken_faces(self, i, j):
        """Bit 4 f + g for every broken face f of the one and g of the other."""
        first, second = self.contacts.exposed_faces[i], self.contacts.exposed_faces[j]
        # Bit f of the first goes to bit 4 f, and each such bit then takes a copy of the second.
        spread = (first & 1) | ((first & 2) << 3) | ((first & 4) << 6) | ((first & 8) << 9)
        return spread * second

    @ti.func
    def _fill_pair(self, p):
        """Write a pair's spheres, take over what waited for it, book what its birth injects."""
        i, j = self.contacts.pair_body[p][0], self.contacts.pair_body[p][1]
        injected = 0.0
        faces = self.numbering.faces[p]
        if faces != 0:
            self.spheres.of_pair(i, j, faces, self.contacts.pair_first[p], True)
            injected = self._injected(p, i, j)
            if ti.static(self.solves):
                self.solver.pairs.carry_over(p, self.old)
        self.old.hand_over(p, injected)
        if ti.static(self.schedule.has_limits):
            fresh = self._exposed_now(i) | self._exposed_now(j)
            self.schedule.limits.carry_over_pair(p, self.old.former[p], fresh)

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
        size = self.tables.face_spheres[None]
        fresh, freed = self.fresh[None] == 1, self._freed_at(i, j, tick)
        for k in range(self.contacts.pair_first[p], self.contacts.pair_last[p]):
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
            if self.tables.neighbour[4 * i + f] == j:
                freed = self.state.broken_tick[self.tables.face_bond[4 * i + f]] == tick
        return freed

    @ti.func
    def _index_second(self):
        """List for every body the pairs in which it is second, in order."""
        first, touch, pairs = ti.static(
            self.contacts.second_start, self.contacts.second_pair, self.contacts.pair_count
        )
        group(first, touch, self.tables.body_count[None], pairs[None], self._second_of)

    @ti.func
    def _second_of(self, p):
        return self.contacts.pair_body[p][1]
