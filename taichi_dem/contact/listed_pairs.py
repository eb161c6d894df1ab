"""Entries of the Verlet list: data of a pair that only the search reads."""

import taichi as ti

from taichi_dem.contact.contacts import Contacts
from taichi_dem.kit.types import real


@ti.data_oriented
class ListedPairs:
    """The pair of each entry of the Verlet list, with the results of its last search.

    A block lists forty pairs for one that is near. Data that only a search reads are stored here,
    in the order of its visits; all else is in the slot of the ``PairStore``.
    Of an entry: body: the second of the two; slot: of the pair, -1 while it is not near; faces:
    pairs of their faces that are near, bit 4 f + g for faces f and g; broken: faces that were
    compared; found: number of sphere pairs within the margin; new_faces: faces whose sphere pairs
    are not written yet; until: sum of the two bodies' travel at which the gap of others may be 0
    [m].
    Of a body: travelled: travel of any point when the body was last searched [m]; surveyed: that
    plus its body skin; changed: 1 when the near pairs of its row may have changed.
    """

    def __init__(self, contacts: Contacts, capacity: int):
        self.contacts = contacts
        self.body, self.slot, self.new_faces = (ti.field(ti.i32, shape=capacity) for _ in range(3))
        # Stored contiguously: every search reads many entries that are no longer in the cache.
        asked = [*(ti.field(ti.i32) for _ in range(3)), ti.field(real)]
        ti.root.dense(ti.i, capacity).place(*asked)
        self.faces, self.broken, self.found, self.until = asked
        n = contacts.tables.capacity.bodies
        self.travelled, self.surveyed = (ti.field(real, shape=n) for _ in range(2))
        self.changed = ti.field(ti.i32, shape=n)

    @ti.func
    def begin(self, k, j, faces, p):
        """Begin entry k for a pair with body j, of which only the near faces are known.

        p: its slot, -1 for none.
        """
        self.body[k], self.slot[k], self.faces[k] = j, p, faces
        self.forget(k)

    @ti.func
    def forget(self, k):
        """Forget the last search of entry k: all its faces have to be compared."""
        self.broken[k], self.found[k], self.new_faces[k], self.until[k] = 0, 0, 0, 0.0

    @ti.func
    def move(self, k, place):
        """Move entry k to another place."""
        self.body[place], self.slot[place] = self.body[k], self.slot[k]
        self.faces[place], self.broken[place] = self.faces[k], self.broken[k]
        self.found[place], self.new_faces[place] = self.found[k], self.new_faces[k]
        self.until[place] = self.until[k]

    @ti.func
    def note_travel(self, i, way):
        """Add the displacement [m] of body i since it was last searched."""
        self.travelled[i] = self.travelled[i] + way
        self.surveyed[i] = self.travelled[i] + self.contacts.body_skin[i]

    @ti.func
    def may_gain_spheres(self, k, i, j, faces):
        """Whether entry k, bodies i and j, may have more sphere pairs than were found.

        faces: those that are broken now.
        """
        return self.broken[k] != faces or (faces != 0 and self._may_be_closer(k, i, j))

    @ti.func
    def faces_to_compare(self, k, i, j, faces):
        """Broken faces that may bring entry k new sphere pairs.

        Only newly broken ones, where it has no sphere pairs and cannot have gained any else.
        """
        if self.found[k] == 0 and not self._may_be_closer(k, i, j):
            faces &= ~self.broken[k]
        return faces

    @ti.func
    def _may_be_closer(self, k, i, j):
        """Whether two bodies have gone so far that more spheres may be within their margin."""
        return self.until[k] < self.surveyed[i] + self.surveyed[j]

    @ti.func
    def least_gap(self, k, i, j):
        """Lower bound on the present gap of the pair's spheres that were not found [m]."""
        return self.until[k] - self.travelled[i] - self.travelled[j]

    @ti.func
    def note_found(self, k, i, j, faces, count, hits, gap):
        """Note the sphere pairs of entry k, on which faces they are, and the least other gap [m].

        faces: those that were broken.
        """
        self.changed[i] = self.changed[i] | ti.cast(self.found[k] + count > 0, ti.i32)
        self.broken[k], self.found[k], self.new_faces[k] = faces, count, hits
        self.until[k] = self.travelled[i] + self.travelled[j] + gap
