"""Search for contact pairs: cell grid over bodies with broken faces, then faces, then spheres.

The list is rebuilt when a body may have left the skin, or at once when a bond breaks. Impulses that
wait in the slots of a pair are carried over, so results do not depend on when a search is made.
"""

import taichi as ti

from taichi_dem.errors import InputError
from taichi_dem.step.contacts import NEAR
from taichi_dem.types import real, vec3

_FULL = ("", f"more than {NEAR} bodies near one body", "pairs_per_body", "spheres_per_body")


@ti.data_oriented
class BroadPhase:
    """Finds the pairs and fills the lists of a ``Contacts``.

    brute_force: compare all bodies with broken faces, for tests.
    """

    def __init__(self, contacts, schedule, brute_force=False):
        n = contacts.model.body_count
        self.contacts, self.schedule = contacts, schedule
        self.model, self.state = contacts.model, contacts.state
        self.brute_force = brute_force
        self.rough = ti.field(ti.i32, shape=n)
        self.rough_count = ti.field(ti.i32, shape=())
        self.body_cell = ti.field(ti.i32, shape=n)
        self.cell_capacity = 4 * n + 64
        self.cell_first = ti.field(ti.i32, shape=self.cell_capacity + 2)
        self.cell_member = ti.field(ti.i32, shape=n)
        self.cells = ti.Vector.field(3, ti.i32, shape=())
        self.corner = ti.Vector.field(3, real, shape=())
        self.cell_size = ti.field(real, shape=())
        self.near_count = ti.field(ti.i32, shape=n)
        self.near = ti.field(ti.i32, shape=n * NEAR)
        self.near_spheres = ti.field(ti.i32, shape=n * NEAR)
        self.old_body = ti.Vector.field(2, ti.i32, shape=contacts.capacity)
        self.old_slot = ti.Vector.field(6, real, shape=2 * contacts.capacity)
        self.old_first_of = ti.field(ti.i32, shape=n + 1)
        self.full = ti.field(ti.i32, shape=())
        self.cluster = ti.Vector.field(3, real, shape=4 * n)
        self.sphere = ti.Vector.field(3, real, shape=4 * n * self.model.spheres_per_face)

    def search(self):
        """Rebuild the lists. Raises InputError when they outgrow the room the scene gave them."""
        self._search()
        full = self.full[None]
        if full == 1:
            raise InputError(f"contact search: {_FULL[1]}; the mesh is too uneven for this search")
        if full > 1:
            raise InputError(f"contact lists are full: give SphereContact a larger {_FULL[full]}")

    @ti.kernel
    def _search(self):
        for _ in range(1):
            self._list_rough()
            self._fill_cells()
        for a in range(self.rough_count[None]):
            self._place_spheres(self.rough[a])
        for a in range(self.rough_count[None]):
            self._list_near(self.rough[a])
        for p in range(self.contacts.pair_count[None]):
            self._keep(p)
        for i in range(self.model.body_count):
            self.old_first_of[i] = self.contacts.first_of[i]
            self.contacts.travel[i] = 0.0
        for a in range(self.rough_count[None]):
            self._count_spheres(self.rough[a])
        for _ in range(1):
            self._number_pairs()
        for p in range(self.contacts.pair_count[None]):
            self._fill_pair(p)
        for _ in range(1):
            self._index_second()
            self.schedule.start_pairs()
            self.contacts.search_due[None] = 0

    @ti.func
    def _list_rough(self):
        """List the bodies with spheres on some face, in order of their index."""
        count = 0
        for i in range(self.model.body_count):
            self.near_count[i] = 0
            exposed = False
            for f in range(4):
                exposed = exposed or self.state.exposed_tick[4 * i + f] >= 0
            if exposed:
                self.contacts.rough[i] = 1
                self.rough[count] = i
                count += 1
        self.rough_count[None] = count
        self.full[None] = 0

    @ti.func
    def _place_spheres(self, i):
        """World positions of a body's spheres, computed once for the many that ask."""
        size = ti.static(self.model.spheres_per_face)
        position, rotation = self.state.position[i], self.state.rotation[i]
        for face in range(4 * i, 4 * i + 4):
            if self.state.exposed_tick[face] >= 0:
                self.cluster[face] = position + rotation @ self.model.cluster[face].xyz
                for s in range(size * face, size * face + size):
                    self.sphere[s] = position + rotation @ self.model.sphere[s].xyz

    @ti.func
    def _fill_cells(self):
        """Sort the listed bodies into cells that are as wide as two of the largest reach."""
        count = self.rough_count[None]
        self._size_cells(count)
        cells = self.cells[None]
        for a in range(count):
            cell = self._cell_of(self.state.position[self.rough[a]])
            self.body_cell[a] = (cell[2] * cells[1] + cell[1]) * cells[0] + cell[0]
        total = cells[0] * cells[1] * cells[2]
        group(self.cell_first, self.cell_member, total, count, self._cell_of_member)

    @ti.func
    def _cell_of_member(self, a):
        return self.body_cell[a]

    @ti.func
    def _size_cells(self, count):
        low, high, reach = vec3(0.0), vec3(0.0), 1e-30
        for a in range(count):
            i = self.rough[a]
            if a == 0:
                low, high = self.state.position[i], self.state.position[i]
            low, high = ti.min(low, self.state.position[i]), ti.max(high, self.state.position[i])
            reach = ti.max(reach, self.model.radius[i])
        size = 2.0 * reach + self.contacts.skin[None]
        if ti.static(self.brute_force):
            size = (high - low).max() + size
        while _cell_product((high - low) / size) > self.cell_capacity:
            size *= 1.25
        self.cell_size[None], self.corner[None] = size, low
        self.cells[None] = ti.cast((high - low) / size, ti.i32) + 1

    @ti.func
    def _cell_of(self, position):
        return ti.cast((position - self.corner[None]) / self.cell_size[None], ti.i32)

    @ti.func
    def _list_near(self, i):
        """List, in order, the bodies of higher index that body i may touch or owes an impulse."""
        cells, cell = self.cells[None], self._cell_of(self.state.position[i])
        low, high = ti.max(cell - 1, 0), ti.min(cell + 2, cells)
        for z in range(low[2], high[2]):
            for y in range(low[1], high[1]):
                row = (z * cells[1] + y) * cells[0]
                # The cells of a row follow one another, and so do their members.
                first, last = self.cell_first[row + low[0]], self.cell_first[row + high[0]]
                for k in range(first, last):
                    j = self.rough[self.cell_member[k]]
                    if j > i:
                        if self._may_touch(i, j):
                            self._insert(i, j)
        for p in range(self.contacts.first_of[i], self.contacts.first_of[i + 1]):
            if self._pending(p):
                self._insert(i, self.contacts.pair_body[p][1])

    @ti.func
    def _may_touch(self, i, j):
        """Whether balls around two unbonded bodies, and then around two of their faces, meet."""
        apart = self.state.position[j] - self.state.position[i]
        reach = self.model.radius[i] + self.model.radius[j] + self.contacts.skin[None]
        touch = False
        if apart.norm_sqr() < reach * reach:
            if not self._bonded(i, j):
                for f in range(4):
                    for g in range(4):
                        if not touch:
                            touch = self._faces_near(4 * i + f, 4 * j + g)
        return touch

    @ti.func
    def _bonded(self, i, j):
        bonded = False
        for f in range(4):
            if self.model.neighbour[4 * i + f] == j:
                bonded = self.state.broken_tick[self.model.face_bond[4 * i + f]] < 0
        return bonded

    @ti.func
    def _faces_near(self, face_i, face_j):
        """Whether two faces carry spheres and the balls around these come within the skin."""
        near = False
        if self.state.exposed_tick[face_i] >= 0 and self.state.exposed_tick[face_j] >= 0:
            reach = self.model.cluster[face_i][3] + self.model.cluster[face_j][3]
            reach += self.contacts.skin[None]
            near = (self.cluster[face_j] - self.cluster[face_i]).norm_sqr() < reach * reach
        return near

    @ti.func
    def _pending(self, p):
        first = ti.abs(self.contacts.pair_slot[2 * p]).max()
        return ti.max(first, ti.abs(self.contacts.pair_slot[2 * p + 1]).max()) > 0.0

    @ti.func
    def _insert(self, i, j):
        """Put j in its place in the row of body i, unless it is there."""
        count, base = self.near_count[i], i * NEAR
        place = 0
        while place < count and self.near[base + ti.min(place, NEAR - 1)] < j:
            place += 1
        present = False
        if place < count:
            present = self.near[base + place] == j
        if not present:
            if count == NEAR:
                self.full[None] = 1
            else:
                for back in range(count - place):
                    self.near[base + count - back] = self.near[base + count - back - 1]
                self.near[base + place] = j
                self.near_count[i] = count + 1

    @ti.func
    def _keep(self, p):
        """Save a pair of the old list with what waits in its slots."""
        self.old_body[p] = self.contacts.pair_body[p]
        for side in ti.static(range(2)):
            self.old_slot[2 * p + side] = self.contacts.pair_slot[2 * p + side]

    @ti.func
    def _count_spheres(self, i):
        for m in range(self.near_count[i]):
            j = self.near[i * NEAR + m]
            self.near_spheres[i * NEAR + m] = self._spheres_near(i, j, 0, False)

    @ti.func
    def _spheres_near(self, i, j, start, write):
        """Number of sphere pairs of two bodies within the skin; writes them from start on."""
        count = 0
        size = ti.static(self.model.spheres_per_face)
        bonded = self._bonded(i, j)
        for fg in range(16):
            face_i, face_j = 4 * i + fg // 4, 4 * j + fg % 4
            if not bonded and self._faces_near(face_i, face_j):
                for ab in range(size * size):
                    a, b = size * face_i + ab // size, size * face_j + ab % size
                    reach = self.model.sphere[a][3] + self.model.sphere[b][3]
                    reach += self.contacts.skin[None]
                    if (self.sphere[b] - self.sphere[a]).norm_sqr() < reach * reach:
                        if write:
                            self.contacts.pair_sphere[start + count] = [a, b]
                        count += 1
        return count

    @ti.func
    def _number_pairs(self):
        """Give the near bodies that have spheres near, or an impulse waiting, a place in order."""
        self._retire()
        pairs, spheres = 0, 0
        for i in range(self.model.body_count):
            self.contacts.first_of[i] = pairs
            for m in range(self.near_count[i]):
                count, j = self.near_spheres[i * NEAR + m], self.near[i * NEAR + m]
                if count > 0 or self._waits(i, j):
                    if pairs >= self.contacts.capacity:
                        self.full[None] = 2
                    elif spheres + count > self.contacts.sphere_capacity:
                        self.full[None] = 3
                    else:
                        self.contacts.pair_body[pairs] = [i, j]
                        self.contacts.pair_first[pairs] = spheres
                        pairs += 1
                        spheres += count
        self.contacts.first_of[self.model.body_count] = pairs
        self.contacts.pair_first[pairs] = spheres
        self.contacts.pair_count[None] = pairs

    @ti.func
    def _waits(self, i, j):
        """Whether an impulse of the old list waits for one of two bodies."""
        waits = False
        old = self._old_pair(i, j)
        if old >= 0:
            first = ti.abs(self.old_slot[2 * old]).max()
            waits = ti.max(first, ti.abs(self.old_slot[2 * old + 1]).max()) > 0.0
        return waits

    @ti.func
    def _retire(self):
        """Close the energy account of the old pairs, in their order."""
        for p in range(self.contacts.pair_count[None]):
            self.contacts.heat[None] += self.contacts.pair_heat[p]
        self.old_first_of[self.model.body_count] = self.contacts.pair_count[None]

    @ti.func
    def _old_pair(self, i, j):
        """Place of a pair in the old list, -1 if it was not there."""
        place = -1
        for p in range(self.old_first_of[i], self.old_first_of[i + 1]):
            if self.old_body[p][1] == j:
                place = p
        return place

    @ti.func
    def _fill_pair(self, p):
        """Write a pair's spheres, take over what waited for it, book what its birth injects."""
        i, j = self.contacts.pair_body[p][0], self.contacts.pair_body[p][1]
        self._spheres_near(i, j, self.contacts.pair_first[p], True)
        old = self._old_pair(i, j)
        for side in ti.static(range(2)):
            waiting = 0.0 * self.contacts.pair_slot[2 * p + side]
            if old >= 0:
                waiting = self.old_slot[2 * old + side]
            self.contacts.pair_slot[2 * p + side] = waiting
        self.contacts.pair_heat[p] = vec3(0.0, 0.0, self._injected(p, i, j))

    @ti.func
    def _injected(self, p, i, j):
        """Energy [J] of overlaps that this tick's breaks have brought into being."""
        energy, tick = 0.0, self.state.tick[None]
        size = ti.static(self.model.spheres_per_face)
        freed = self._freed_at(i, j, tick)
        for k in range(self.contacts.pair_first[p], self.contacts.pair_first[p + 1]):
            a, b = self.contacts.pair_sphere[k][0], self.contacts.pair_sphere[k][1]
            born = ti.max(self.state.exposed_tick[a // size], self.state.exposed_tick[b // size])
            if tick > 0 and (freed or born == tick):
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


@ti.func
def group(first: ti.template(), order: ti.template(), keys, count, key_of: ti.template()):
    """List 0 .. count - 1 by key: those of key c, in order, at order[first[c]] .. first[c + 1].

    first has room for keys + 2 entries.
    """
    for c in range(keys + 2):
        first[c] = 0
    for a in range(count):
        first[key_of(a) + 2] += 1
    for c in range(keys):
        first[c + 2] += first[c + 1]
    for a in range(count):
        place = first[key_of(a) + 1]
        order[place] = a
        first[key_of(a) + 1] = place + 1


@ti.func
def _cell_product(counts):
    cells = ti.floor(counts) + 1.0
    return cells[0] * cells[1] * cells[2]
