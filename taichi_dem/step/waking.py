"""Bodies that were woken enter the lists, and their bonds act from then on."""

import taichi as ti

from taichi_dem.kit.ordered import Once, Phases, Places
from taichi_dem.step.multirate.active_lists import ActiveLists
from taichi_dem.step.multirate.clock import Clock


@ti.data_oriented
class Waking(Places):
    """List of the bodies woken since they were listed; lists them and their bonds."""

    def __init__(self, clock: Clock, lists: ActiveLists):
        self.clock, self.lists, self.sleeping = clock, lists, clock.sleeping
        self.tables, self.store = clock.tables, clock.store
        self.most = self.tables.capacity.bodies

    @ti.func
    def count(self, low):
        """Number of bodies woken since they were listed."""
        return self.sleeping.woken_count[None]

    @ti.func
    def admit(self):
        """List the bodies woken since the last call, and the bonds that now act."""
        sleeping = self.sleeping
        for a in range(sleeping.woken_count[None]):
            i = sleeping.woken[a]
            self.lists.bodies.insert(i)
            for f in range(4):
                b = self.tables.face_bond[4 * i + f]
                if b >= 0:
                    if self.lists.bonds.insert(b):
                        sleeping.left_out[b] = self._left_out_now(b, True)
        sleeping.unsorted[None] = sleeping.unsorted[None] + sleeping.woken_count[None]
        sleeping.woken_count[None] = 0

    @ti.func
    def _left_out_now(self, b, moved: ti.template()):
        return self.sleeping.left_out_now(b, self.clock.seconds(1), moved)

    @ti.func
    def admit_in_search(self, a):
        """Note what the bonds of a body woken by a search have left out, before all are listed."""
        self._admit(a, False)

    @ti.func
    def admit_in_step(self, a):
        """The same in a step, in which bodies have moved since bonds were evaluated."""
        self._admit(a, True)

    @ti.func
    def _admit(self, a, moved: ti.template()):
        i = self.sleeping.woken[a]
        for f in range(4):
            b = self.tables.face_bond[4 * i + f]
            if b >= 0:
                if self.lists.bonds.key[b] < 0 and self.lists.bond_key(b) >= 0:
                    self.sleeping.left_out[b] = self._left_out_now(b, moved)

    @ti.func
    def sort(self, item):
        """Renew the bound of sleep; bring bodies woken of late into the order of the others."""
        if self.sleeping.is_due():
            self.sleeping.renew_bound()
            if self.sleeping.unsorted[None] > 0:
                self.sleeping.unsorted[None] = 0
                self.lists.bodies.listing.sort()
                self.lists.bonds.listing.sort()

    @ti.func
    def begin(self, item):
        """At the start bonds that sleep act once."""
        self.sleeping.starting[None] = 1

    @property
    def leaving(self) -> Phases:
        """Phases after which those that sleep are not listed."""
        return self.lists.filling(self.lists.bodies, self.lists.bonds)

    def search_phases(self) -> Phases:
        """Phases of a search: bodies that come near each other wake, and all are listed anew."""
        near = self.lists.pairs.everyone
        admit = (near, self.awaken_pair), (self, self.admit_in_search)
        return (*admit, *self.lists.filling(), (Once(), self.end_search))

    @ti.func
    def awaken_pair(self, p):
        """Wake both bodies of a pair."""
        for side in ti.static(range(2)):
            self.sleeping.awaken(self.store.body[p][side])

    @ti.func
    def end_search(self, item):
        """The bodies woken by a search are listed."""
        self.sleeping.woken_count[None] = 0
