"""Which place each contact pair gets in the new list: sorted, and those that stay are not moved."""

import taichi as ti


@ti.data_oriented
class Numbering:
    """Numbers the pairs of a ``Contacts`` by what the entries of the neighbours say.

    A row of which nothing has changed is numbered from the old list. neighbours: the
    ``VerletList``; old: the ``OldPairs``; candidates: where their spheres lie; full: 1 or 2 when
    there is no room for pairs or for spheres. faces: of a new pair those with new spheres, bit 4 f
    + g; 0 when it keeps those that it had.
    """

    scratch_fields = ("faces",)

    def __init__(self, contacts, neighbours, old, candidates, full):
        self.contacts, self.neighbours = contacts, neighbours
        self.pair_cache = neighbours.pair_cache
        self.old, self.candidates, self.full = old, candidates, full
        self.tables = contacts.tables
        self.faces = ti.field(ti.i32, shape=contacts.capacity)

    @ti.func
    def number_pairs(self, one):
        """Give the pairs that have spheres near, or an impulse waiting, a place in order."""
        for i in range(self.tables.body_count[None] + 1):
            self.old.first_of[i] = self.contacts.first_of[i]
        self.contacts.pair_count[None] = 0
        self.contacts.sphere_count[None] = 0
        for i in range(self.tables.body_count[None]):
            self.contacts.first_of[i] = self.contacts.pair_count[None]
            # A body without spheres is in no pair, now or before.
            if self.contacts.exposed_faces[i] != 0:
                self._row(i)
        self.contacts.first_of[self.tables.body_count[None]] = self.contacts.pair_count[None]

    @ti.func
    def _row(self, i):
        """Number the pairs of which body i is the first."""
        if self.pair_cache.pop_change(i) == 1:
            self._row_anew(i)
        else:
            for old in range(self.old.first_of[i], self.old.first_of[i + 1]):
                spheres = self.old.last[old] - self.old.first[old]
                if spheres > 0 or self.old.waits(old):
                    self._number(i, self.old.body[old][1], old, 0, spheres)

    @ti.func
    def _row_anew(self, i):
        """The same from the entries of its neighbours, and what waits in old pairs between."""
        old, last = self.old.first_of[i], self.old.first_of[i + 1]
        k, left = self.neighbours.first[i], self.pair_cache.met[i]
        while left > 0:
            if self.pair_cache.spheres[k] > 0:
                j = self.neighbours.body[k]
                old = self._waiting(i, old, last, j)
                former = self.old.place(old, last, j)
                faces, spheres = self.pair_cache.pop_new_faces(k), self.pair_cache.spheres[k]
                self._number(i, j, former, faces, spheres)
                old += ti.cast(former >= 0, ti.i32)
                left -= 1
            k += 1
        self._waiting(i, old, last, self.tables.body_count[None])

    @ti.func
    def _waiting(self, i, old, last, j):
        """Number the old pairs of body i before partner j that hold something; next old pair."""
        while old < last and self.old.body[ti.min(old, last - 1)][1] < j:
            if self.old.waits(old):
                self._number(i, self.old.body[old][1], old, 0, 0)
            old += 1
        return old

    @ti.func
    def _number(self, i, j, former, faces, spheres):
        """Give the pair of two bodies the next place; faces: with its spheres if these are new."""
        p, start = self.contacts.pair_count[None], 0
        if faces != 0:
            start = self.candidates.take(spheres)
        elif spheres > 0:
            start = self.old.first[former]
        if p >= self.contacts.pair_limit[None]:
            self.full[None] = 1
        elif start + spheres > self.contacts.sphere_limit[None]:
            self.full[None] = 2
        else:
            self.contacts.pair_body[p] = [i, j]
            self.faces[p], self.old.former[p] = faces, former
            self.contacts.pair_first[p], self.contacts.pair_last[p] = start, start + spheres
            self.contacts.sphere_count[None] = self.contacts.sphere_count[None] + spheres
            self.contacts.pair_count[None] = p + 1
