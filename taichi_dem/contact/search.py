"""Search for pairs of bodies that may touch soon, and for their contacts by the contact law.

Invariants, at any tick between two searches:

- A pair has one owner: an entry in the row of its first body, first < second, which holds its slot
  of the ``PairStore`` as long as the pair is near or an impulse waits in it.
- A pair of free bodies without a bond that is not near, or a contact that a near pair does not
  hold, has a gap: the bodies cannot close it before their paths have grown to ``until``.
- No path is longer than its horizon: a search is requested before that.

So a search visits the bodies that have come near their horizon or that a break has set free, and
compares pairs whose ``until`` lies below the new horizons. The times of searches change no result.
"""

from typing import Any, Protocol

import taichi as ti

from taichi_dem.contact.contacts import Breaks, Contacts
from taichi_dem.contact.verlet_list import NearPairs, VerletList
from taichi_dem.kit import backend
from taichi_dem.kit.allocation import assign, values
from taichi_dem.kit.ordered import Once, Phases, RunningSums, Some, tasks
from taichi_dem.kit.products import norm
from taichi_dem.kit.types import vec4
from taichi_dem.methods import Method
from taichi_dem.state.model import Model

#: Marks of a body: others can touch it; a search visits it; and compares it whatever its path.
FREE, VISITED, COMPARED = 1, 2, 3
#: Share of its body skin that a body may use up before it is visited.
FAR = 0.6
#: Skins beyond their margin within which the gap of two bodies is found; others count as farther.
OUTLOOK = 3.5


class PairListener(Protocol):
    """What is told of the pairs that a search lists."""

    def notice_listed(self, p: Any, entered: Any, fresh: Any) -> None:
        """Take note of pair p: nonzero where it is new, and where a break set a body free."""


@ti.data_oriented
class BroadPhase:
    """Finds the pairs that are near and their spheres, for the store of a ``Contacts``."""

    scratch_fields = ("free", "free_count", "mark")

    def __init__(self, contacts: Contacts, pair_phases: Phases, limits: PairListener | None):
        n = contacts.tables.capacity.bodies
        self.contacts, self.store = contacts, contacts.store
        self.pair_phases, self.has_limits = pair_phases, limits is not None
        self.limits: Any = limits
        self.tables, self.state = contacts.tables, contacts.state
        self.free, self.mark = (ti.field(ti.i32, shape=n) for _ in range(2))
        self.free_count = ti.field(ti.i32, shape=())
        self.neighbours = VerletList(contacts)
        self.searched = ti.field(ti.i64, shape=())
        self.everywhere, self.again = (ti.field(ti.i32, shape=()) for _ in range(2))
        self.breaks = Breaks(contacts)
        self.near_pairs = NearPairs(contacts, self.neighbours)
        self.full = self.near_pairs.full
        self.searches = ti.field(ti.i32, shape=())
        ends = self._is_free, self._put_free, self._end_free
        self.listing = RunningSums(Some(self._body_count, n, light=True), 1, *ends)
        # No whole body is nearer to another for a face that is free now.
        self.geometry = contacts.geometry
        self.set_free = COMPARED if self.geometry.by_face else VISITED
        self.phases = self._phases(n)
        self.tasks = tasks(self.phases, n)

    def upload(self, model: Model, method: Method) -> None:
        """Upload a scene; the first search makes all lists."""
        self.neighbours.forget()
        self.breaks.upload(model)

    def ask(self, everywhere: bool = False) -> None:
        """Request a search before the next step."""
        assign(self.everywhere, int(everywhere))
        assign(self.contacts.search_requested, 1)

    def renew(self) -> bool:
        """Update the lists, a parallel loop a phase; whether there was room for them."""
        while values(self.contacts.search_requested):
            self._search()
        return not values(self.full)

    def search(self, everywhere: bool = True) -> None:
        """Renew the lists now, as far as there is room (``lacking``)."""
        if everywhere:
            # Bodies may have been moved by hand.
            self.geometry.forget_paths()
        self.ask(everywhere)
        self.renew()

    def lacking(self) -> tuple[int, int, int]:
        """Least lengths of the lists of pairs, contacts and neighbours, where they lack room."""
        if not values(self.full):
            return 0, 0, 0
        pairs, contacts = values(self.near_pairs.lacking).tolist()
        return pairs, contacts, int(values(self.neighbours.lacking))

    def ask_again(self) -> None:
        """Request the search again for which there was no room."""
        if values(self.neighbours.lacking):
            self.neighbours.forget()
        else:
            self.neighbours.renew_all()
        assign(self.again, 1)
        assign(self.contacts.search_requested, 1)

    def _phases(self, n) -> Phases:
        """Phases of a search in order, for at most n bodies."""
        bodies = Some(self._body_count, n, light=True)
        free, light = Some(self._free_bodies, n), Some(self._free_bodies, n, light=True)
        anew, amended = Some(self.neighbours.listed_anew, n), Some(self._all_amended, n)
        return (
            # Faces that broke; the bodies that others can touch, listed in order.
            *self.breaks.phases(bodies),
            (bodies, self._mark_free),
            *self.listing.phases,
            # Which of them have used up their skin, or were set free.
            (Some(self._unchosen, n), self._choose),
            (Once(), self._begin),
            # Rows of neighbours: made anew from a grid of cells, or with escaped bodies added.
            (anew, self.neighbours.list_anew),
            *self.neighbours.grid.phases,
            (anew, self.neighbours.count),
            *self.neighbours.allotting.phases,
            (Once(), self.neighbours.check_room),
            (anew, self.neighbours.fill),
            (amended, self.neighbours.amend),
            # The gap of each pair that may have closed.
            (free, self._visit),
            # Pairs that are near get a slot, others lose theirs.
            (light, self._count_row),
            *self.near_pairs.numbering.phases,
            (bodies, self.near_pairs.place_row),
            (light, self._release),
            (free, self._update_pairs),
            (Once(), self._end_pairs),
            *self.near_pairs.second.phases,
            # The lists of what is due take them in.
            *self.pair_phases,
            (Once(), self._end),
        )

    @ti.kernel
    def _search(self):
        for serial, phases in ti.static(self.tasks):
            if ti.static(serial):
                ti.loop_config(serialize=True)
                for _ in range(1):
                    for members, item in ti.static(phases):
                        for a in range(members.count(0)):
                            item(members.pick(a))
            elif ti.static(backend.is_cpu()):
                for a in range(phases[0][0].count(0)):
                    phases[0][1](phases[0][0].pick(a))
            else:
                for a in range(ti.static(phases[0][0].most)):
                    if a < phases[0][0].count(0):
                        phases[0][1](phases[0][0].pick(a))
                        self.state.check_loops(phases[0][0].count(0))

    @ti.func
    def is_requested(self):
        """1 when a search is called for."""
        return self.contacts.search_requested[None]

    @ti.func
    def overflows(self):
        """1 when a list has no room left."""
        return ti.cast(self.full[None] != 0, ti.i32)

    @ti.func
    def _free_bodies(self):
        return self.free_count[None]

    @ti.func
    def _unchosen(self):
        """Number of free bodies, or 0 in a search that is made again, which has compared them."""
        return self.free_count[None] * (1 - self.again[None])

    @ti.func
    def _all_amended(self):
        return self.neighbours.amending() * self.tables.body_count[None]

    @ti.func
    def _begin(self, item):
        self.neighbours.begin(self.free_count[None])
        self.searched[None] = self.state.tick[None]
        self.store.pack_if_sparse()

    @ti.func
    def _end_pairs(self, item):
        """Take over the numbers of pairs."""
        self.neighbours.end()
        self.near_pairs.end()

    @ti.func
    def _end(self, item):
        if self.full[None] == 0:
            self.everywhere[None], self.again[None] = 0, 0
            self.searches[None] = self.searches[None] + 1
            self.breaks.end_search()
        # A full row of neighbours requires another search, which rebuilds the list.
        again = self.neighbours.stale[None] != 0 and self.full[None] == 0
        again = again and self.free_count[None] > 0
        self.contacts.search_requested[None] = ti.cast(again, ti.i32)

    @ti.func
    def _mark_free(self, i):
        self.mark[i] = self.breaks.is_free(i)
        self.contacts.free[i] = self.mark[i]

    @ti.func
    def _body_count(self):
        return self.tables.body_count[None]

    @ti.func
    def _is_free(self, i):
        return ti.Vector([ti.cast(self.mark[i] == FREE, ti.i32)])

    @ti.func
    def _put_free(self, i, before, value):
        """List the bodies that others can touch, in order of their index."""
        if value[0] == 1:
            self.free[before[0]] = i

    @ti.func
    def _end_free(self, total):
        self.free_count[None] = total[0]

    @ti.func
    def _choose(self, a):
        """Mark a free body that used up much of its skin, or of which a face was set free."""
        i = self.free[a]
        if self.everywhere[None] == 1:
            self.mark[i] = COMPARED
        elif self.breaks.free_since(i, self.searched[None] + 1) == 1:
            self.mark[i] = self.set_free
        elif self.contacts.is_far(i, FAR):
            self.mark[i] = VISITED
        if self.mark[i] >= VISITED:
            self.contacts.set_body_skin(i)
            self.neighbours.reach.notice(i)

    @ti.func
    def _visit(self, a):
        """Compare a free body with each neighbour, where either is visited and they may meet."""
        # Few bodies are visited: in the rows of all others nothing but marks is read.
        i, least = self.free[a], VISITED
        if self.mark[i] >= VISITED or self.neighbours.making() == 1:
            least = FREE
        for k in range(self.neighbours.first[i], self.neighbours.last[i]):
            j = self.neighbours.body[k]
            if self.mark[j] >= least:
                self._visit_entry(k, i, j)

    @ti.func
    def _visit_entry(self, k, i, j):
        """Compare an entry if it may meet, or has a body that is compared whatever its path."""
        mark = ti.max(self.mark[i], self.mark[j])
        if mark == COMPARED or self.neighbours.until[k] < self.contacts.horizons(i, j):
            if not self.breaks.bonded(i, j):
                self._compare(k, i, j)

    @ti.func
    def _compare(self, k, i, j):
        """Count the contacts of an entry, and find how far apart all else is."""
        count, margin = 0, self.contacts.margin(i, j)
        far = margin + OUTLOOK * (self.contacts.skin[i] + self.contacts.skin[j])
        gap = norm(self.state.position[j] - self.state.position[i])
        gap -= self.tables.extent[i] + self.tables.extent[j]
        if gap < far:
            turn, offset = self.contacts.place(i, j)
            faces = self.breaks.free_faces(i, j)
            count, gap = self.geometry.find(i, j, turn, offset, faces, margin, far)
        keeps = ti.static(not self.geometry.by_face) and count == self.neighbours.found[k]
        self.neighbours.note_found(k, i, count, self.contacts.paths(i, j) + gap, keeps)

    @ti.func
    def _count_row(self, a):
        """Count what of the row of a free body is near, comes, and goes."""
        self.near_pairs.count_row(self.free[a])

    @ti.func
    def _release(self, a):
        """Free the slots of the pairs of a free body that are near no longer."""
        self.near_pairs.release(self.free[a])

    @ti.func
    def _update_pairs(self, a):
        """Put the near pairs of a free body in order, and write their new contacts."""
        i = self.free[a]
        if self.full[None] == 0:
            if self.near_pairs.row_is_new[i] == 1:
                self.near_pairs.renew_row(i)
                for k in range(self.neighbours.first[i], self.neighbours.last[i]):
                    if self.neighbours.slot[k] >= 0:
                        self._update_pair(k, self.neighbours.slot[k])
            self.near_pairs.put_row(i)
            if ti.static(self.has_limits):
                for k in range(self.store.first_of[i], self.store.first_of[i + 1]):
                    self._notice(self.store.near_slot[k])

    @ti.func
    def _notice(self, p):
        """Notify the limits of a pair that is new, or has bodies that a break has set free."""
        pair, now = self.store.body[p], self.state.tick[None]
        fresh = self.breaks.free_since(pair[0], now) | self.breaks.free_since(pair[1], now)
        self.limits.notice_listed(p, self.store.is_new[p], fresh)
        self.store.is_new[p] = 0

    @ti.func
    def _update_pair(self, k, p):
        """Write the contacts of entry k, and book the energy that new overlaps inject."""
        count, i, j = self.neighbours.found[k], self.store.body[p][0], self.store.body[p][1]
        if self.neighbours.is_new[k] == 1:
            turn, offset = self.contacts.place(i, j)
            faces, margin = self.breaks.free_faces(i, j), self.contacts.margin(i, j)
            place = self.store.sphere_place[p]
            self.geometry.enter(i, j, turn, offset, faces, margin, place)
            self.store.replace_spheres(p, count)
            if ti.static(self.geometry.by_face):
                injected = self.breaks.injected(p)
                if injected > 0.0:
                    self.store.heat[p] = self.store.heat[p] + vec4(0.0, 0.0, injected, 0.0)
                    self.store.waiting[p][0] = 1
        elif count == 0:
            self.store.remove_spheres(p)
        self.neighbours.is_new[k] = 0
