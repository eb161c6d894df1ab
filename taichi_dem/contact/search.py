"""Search for contact pairs: the broken ones among the neighbouring faces, then their spheres.

The lists are updated when a body may have used up its body skin, or at once when a bond breaks: a
search visits the bodies that moved or broke, and keeps the results of the others. A pair keeps its
slot of the store, so results do not depend on the times of searches.
"""

from collections.abc import Callable
from typing import Any

import taichi as ti

from taichi_dem.contact.breaks import Breaks
from taichi_dem.contact.contacts import Contacts
from taichi_dem.contact.narrow_phase import NarrowPhase
from taichi_dem.contact.near_pairs import NearPairs
from taichi_dem.contact.verlet_list import FAR, VerletList
from taichi_dem.kit.allocation import assign, values
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.types import vec3
from taichi_dem.methods import Method
from taichi_dem.state.model import Model

#: Marks of a body: it has spheres, and the last search visited it.
EXPOSED, LOOKED = 1, 2
_CAPACITIES = ("", "pairs_per_body", "spheres_per_body", "neighbours_per_body")


@ti.data_oriented
class BroadPhase:
    """Finds the pairs that are near and their spheres, for the store of a ``Contacts``.

    start_pairs: takes in the pairs of a search. limits: ``StabilityLimits`` that are told of pairs,
    None where no step needs them.
    everywhere: 1 when the next search visits all bodies, as is needed once they have been moved by
    hand. looked: LOOKED for bodies that the last search visited, EXPOSED for others with spheres;
    searched: its tick. searches: their number. full: the list without capacity, an index into
    ``_CAPACITIES``.
    """

    scratch_fields = ("exposed", "exposed_count", "looked")

    def __init__(self, contacts: Contacts, start_pairs: Callable[[], Any], limits: Any):
        n = contacts.tables.capacity.bodies
        self.contacts, self.store = contacts, contacts.store
        self.start_pairs, self.limits = start_pairs, limits
        self.has_limits = limits is not None
        self.tables, self.state = contacts.tables, contacts.state
        self.exposed = ti.field(ti.i32, shape=n)
        self.exposed_count = ti.field(ti.i32, shape=())
        self.neighbours = VerletList(contacts)
        self.listed = self.neighbours.listed
        self.narrow_phase = NarrowPhase(contacts)
        self.searched = ti.field(ti.i64, shape=())
        self.looked = ti.field(ti.i32, shape=n)
        self.everywhere = ti.field(ti.i32, shape=())
        self.breaks = Breaks(contacts)
        self.near_pairs = NearPairs(contacts, self.neighbours)
        self.full = self.near_pairs.full
        self.searches = ti.field(ti.i32, shape=())

    def load(self, model: Model, method: Method) -> None:
        """Load the limits of the lists; the first search makes all of them."""
        self.neighbours.load(model, method)

    def clear(self) -> None:
        """Forget all pairs; the next search finds those present then."""
        self.store.clear()
        self.neighbours.clear()
        assign(self.contacts.search_requested, 0)

    def ask(self, everywhere: bool = False) -> None:
        """Request a search before the next step."""
        assign(self.everywhere, int(everywhere))
        if everywhere:
            self.contacts.forget_gaps()
        assign(self.contacts.search_requested, 1)

    def renew(self) -> None:
        """Update the lists, a parallel loop a phase, until no search is requested."""
        while values(self.contacts.search_requested):
            self._search()

    def search(self, everywhere: bool = True) -> None:
        """Renew the lists now. Raises InputError when they exceed their capacity."""
        self.ask(everywhere)
        self.renew()
        self.check_capacity()

    def check_capacity(self) -> None:
        """Raise InputError when lists exceed the capacity that the scene gave them."""
        option = _CAPACITIES[int(values(self.full))]
        if option:
            law = type(self.contacts.law).__name__
            raise InputError(
                f"contact lists are full: give {law} a larger {option}, or move solids apart that "
                "lie in each other"
            )

    @property
    def phases(self) -> tuple[tuple[Callable[..., Any], Callable[..., Any]], ...]:
        """Phases of a search in order, as pairs of a count and a function of an index."""
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
            (self._once, self._pack_spheres),
            (self._exposed_bodies, self._find_spheres),
            (self._once, self._number_pairs),
            (self._exposed_bodies, self._update_pairs),
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
    def _pack_spheres(self, one):
        self.store.pack_if_sparse()

    @ti.func
    def _end(self, one):
        if self.neighbours.full[None] == 1:
            self.full[None] = 3
        self.neighbours.end()
        self.near_pairs.index_second()
        self.start_pairs()
        self.everywhere[None] = 0
        self.searches[None] = self.searches[None] + 1
        # A full row of neighbours requires another search, which rebuilds the list.
        again = self.neighbours.stale[None] != 0 and self.full[None] == 0
        self.contacts.search_requested[None] = ti.cast(again, ti.i32)

    @ti.func
    def _list_exposed(self, one):
        """List the bodies with spheres on some face, in order of their index."""
        count = 0
        newest = ti.cast(0, ti.i64)
        self.breaks.expose_outer()
        for i in range(self.tables.body_count[None]):
            exposed = self.breaks.exposed_faces(i)
            newest = ti.max(newest, self.breaks.newest[i])
            self.contacts.exposed_faces[i] = exposed
            self.looked[i] = ti.cast(exposed != 0, ti.i32)
            if exposed != 0:
                self.exposed[count] = i
                count += 1
        self.exposed_count[None] = count
        self.full[None] = 0
        self.breaks.note_newest(newest)

    @ti.func
    def _choose(self, a):
        """Mark an exposed body that used up much of its skin, or that a break has exposed."""
        i = self.exposed[a]
        far = self.contacts.travel[i] > FAR * self.contacts.body_skin[i]
        looked = self.everywhere[None] | ti.cast(far, ti.i32)
        looked |= self.breaks.exposed_since(i, self.searched[None] + 1)
        if looked == 1:
            self.looked[i] = LOOKED
            self.contacts.set_body_skin(i)
            self.neighbours.reach.notice(i)

    @ti.func
    def _note_places(self, a):
        """Note the position of a body that is being searched.

        The others are compared at the positions of their last search, from which they have used up
        part of their body skin. All are searched while the list of neighbours is being rebuilt.
        """
        i = self.exposed[a]
        if self.neighbours.making() == 1:
            self.looked[i] = LOOKED
        if self.looked[i] == LOOKED:
            self.listed.note_travel(i, self.contacts.travel[i])
            self.narrow_phase.note_places(i)
            self.contacts.travel[i] = 0.0

    @ti.func
    def _find_spheres(self, a):
        """Find the sphere pairs of an exposed body with each neighbour that is being searched."""
        i = self.exposed[a]
        least = ti.select(self.looked[i] == LOOKED, EXPOSED, LOOKED)
        for k in range(self.neighbours.first[i], self.neighbours.last[i]):
            j = self.listed.body[k]
            if self.looked[j] >= least:
                faces = self._broken_faces(i, j)
                if not ti.static(self.contacts.law.meets_bodies):
                    faces &= self.listed.faces[k]
                if self.everywhere[None] == 1 or self.listed.may_gain_spheres(k, i, j, faces):
                    self._count_spheres(k, i, j, faces)

    @ti.func
    def _count_spheres(self, k, i, j, faces):
        """Count the sphere pairs of an entry, and find how far apart the others are."""
        count, hits, gap = 0, 0, 0.0
        if not self.breaks.bonded(i, j):
            compared = faces
            if self.everywhere[None] == 0:
                compared = self.listed.faces_to_compare(k, i, j, faces)
            count, hits, gap = self.narrow_phase.compare(i, j, compared, 0, False)
            if compared != faces:
                gap = ti.min(gap, self.listed.least_gap(k, i, j))
        self.listed.note_found(k, i, j, faces, count, hits, gap)

    @ti.func
    def _broken_faces(self, i, j):
        """Bit 4 f + g for every broken face f of the one and g of the other."""
        first, second = self.contacts.exposed_faces[i], self.contacts.exposed_faces[j]
        # Bit f of the first goes to bit 4 f, and each such bit then takes a copy of the second.
        spread = (first & 1) | ((first & 2) << 3) | ((first & 4) << 6) | ((first & 8) << 9)
        return spread * second

    @ti.func
    def _number_pairs(self, one):
        self.near_pairs.number(self.exposed, self.exposed_count[None])

    @ti.func
    def _update_pairs(self, a):
        """Put the near pairs of an exposed body in order, and write their new sphere pairs."""
        i = self.exposed[a]
        if self.full[None] == 0:
            if self.near_pairs.row_is_new[i] == 1:
                for k in range(self.neighbours.first[i], self.neighbours.last[i]):
                    if self.listed.slot[k] >= 0:
                        self._update_pair(k, self.listed.slot[k], i, self.listed.body[k])
            self.near_pairs.put_row(i)
            if ti.static(self.has_limits):
                for k in range(self.store.first_of[i], self.store.first_of[i + 1]):
                    self._notice(self.store.near_slot[k])

    @ti.func
    def _notice(self, p):
        """Notify the limits of a pair that is new, or has bodies that a break has exposed."""
        pair, now = self.store.body[p], self.state.tick[None]
        fresh = self.breaks.exposed_since(pair[0], now) | self.breaks.exposed_since(pair[1], now)
        self.limits.notice_listed(p, self.store.is_new[p], fresh)
        self.store.is_new[p] = 0

    @ti.func
    def _update_pair(self, k, p, i, j):
        """Write the sphere pairs of entry k, and book the energy that new overlaps inject."""
        faces, count = self.listed.new_faces[k], self.listed.found[k]
        self.listed.new_faces[k] = 0
        if faces != 0:
            if ti.static(self.contacts.law.meets_bodies):
                self.store.sphere[self.store.sphere_place[p]] = [i, j]
                self.store.replace_spheres(p, count)
            else:
                self.narrow_phase.compare(i, j, faces, self.store.sphere_place[p], True)
                self.store.replace_spheres(p, count)
                injected = self.breaks.injected(p)
                if injected > 0.0:
                    self.store.heat[p] = self.store.heat[p] + vec3(0.0, 0.0, injected)
                    self.store.waiting[p][0] = 1
        elif count == 0:
            self.store.remove_spheres(p)
