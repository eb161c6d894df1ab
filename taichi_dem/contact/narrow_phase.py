"""Narrow phase of the contact search: sphere pairs within a margin, and the gap of all others."""

import taichi as ti

from taichi_dem.contact.contacts import Contacts
from taichi_dem.kit.products import matvec, squared
from taichi_dem.kit.types import real, vec4
from taichi_dem.physics.rotation import place_in

#: Skins beyond their margin within which the gap of two spheres is found; others count as farther.
OUTLOOK = 7.0


@ti.data_oriented
class NarrowPhase:
    """Compares the spheres on the faces of two bodies, at the positions of their last search.

    sphere: centre and radius of every sphere there [m]. cluster: centre of the ball around those of
    a face [m]. position, rotation: of every body there, where bodies meet.
    """

    def __init__(self, contacts: Contacts):
        self.contacts, self.tables, self.state = contacts, contacts.tables, contacts.state
        self.store = contacts.store
        capacity = self.tables.capacity
        self.sphere = ti.Vector.field(4, real, shape=capacity.spheres)
        self.cluster = ti.Vector.field(3, real, shape=capacity.faces)
        self.law = contacts.law
        if self.law.meets_bodies:
            self.position = ti.Vector.field(3, real, shape=capacity.bodies)
            self.rotation = ti.Matrix.field(3, 3, real, shape=capacity.bodies)

    @ti.func
    def note_places(self, i):
        """Compute the positions of the spheres of body i, once for all comparisons."""
        size = self.tables.face_spheres[None]
        position, rotation = self.state.position[i], self.state.rotation[i]
        if ti.static(self.law.meets_bodies):
            self.position[i], self.rotation[i] = position, rotation
        for face in range(4 * i, 4 * i + 4):
            self.cluster[face] = self.contacts.cluster_centre(i, face)
            if self.state.exposed_tick[face] >= 0:
                for s in range(size * face, size * face + size):
                    sphere = self.tables.sphere[s]
                    place = position + matvec(rotation, sphere.xyz)
                    self.sphere[s] = vec4(place[0], place[1], place[2], sphere[3])

    @ti.func
    def compare(self, i, j, faces, start, write):
        """Find the sphere pairs of two bodies within their margin: number, and bits of their faces.

        Returns also the smallest gap of others [m], at most OUTLOOK skins beyond the margin. faces:
        bit 4 f + g for faces f and g to compare. write: enter the pairs in the store, from start
        on; the gap of others is not found then.
        """
        margin = self.contacts.margin(i, j)
        count, hits, least = 0, 0, margin
        if not write:
            least += 0.5 * OUTLOOK * (self.contacts.skin[i] + self.contacts.skin[j])
        if ti.static(self.law.meets_bodies):
            if faces != 0:
                count, least = self._of_bodies(i, j, margin)
                hits = count * faces
            faces = 0
        for fg in range(16):
            if (faces >> fg) & 1 == 1:
                face_i, face_j = 4 * i + fg // 4, 4 * j + fg % 4
                if self._clusters_near(face_i, face_j, least):
                    place = start + count
                    more, least = self._of_faces(face_i, face_j, place, margin, least, write)
                    count += more
                    hits |= ti.cast(more > 0, ti.i32) << fg
        return count, hits, least

    @ti.func
    def _clusters_near(self, face_i, face_j, wide):
        """Whether the balls around the spheres of two faces are nearer than wide [m]."""
        reach = self.tables.cluster[face_i][3] + self.tables.cluster[face_j][3] + wide
        return squared(self.cluster[face_j] - self.cluster[face_i]) < reach * reach

    @ti.func
    def _of_bodies(self, i, j, margin):
        """1 where two bodies may meet, and how far they may go until then."""
        count = 0
        apart = self.position[j] - self.position[i]
        turn, offset = place_in(self.rotation[i], self.rotation[j], apart)
        gap = self.law.gap(i, j, turn, offset)
        if gap < margin:
            count, gap = 1, margin
        return count, gap

    @ti.func
    def _of_faces(self, face_i, face_j, start, margin, least, write):
        count = 0
        size = self.tables.face_spheres[None]
        for a in range(size * face_i, size * face_i + size):
            mine = self.sphere[a]
            whole = mine[3] + self.tables.cluster[face_j][3] + least
            # A sphere far from the ball around those of the other face is as far from all of them.
            if squared(self.cluster[face_j] - mine.xyz) < whole * whole:
                for b in range(size * face_j, size * face_j + size):
                    other = self.sphere[b]
                    reach = mine[3] + other[3]
                    apart2 = squared(other.xyz - mine.xyz)
                    if apart2 < (reach + least) * (reach + least):
                        if apart2 < (reach + margin) * (reach + margin):
                            if write:
                                self.store.sphere[start + count] = [a, b]
                            count += 1
                        else:
                            least = ti.sqrt(apart2) - reach
        return count, least
