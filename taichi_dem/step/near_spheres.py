"""Spheres of two bodies that are within the skin of the contact search, and how far the others."""

import taichi as ti

from taichi_dem.step.neighbours import REACH
from taichi_dem.types import real


@ti.data_oriented
class NearSpheres:
    """Compares the spheres on the faces of two bodies, where these were last looked at.

    sphere: centre of every sphere there [m]. near: the ``Neighbours``, which know where the balls
    around those of a face are.
    """

    def __init__(self, contacts, near):
        self.contacts, self.model, self.state = contacts, contacts.model, contacts.state
        self.near = near
        count = 4 * self.model.body_count * self.model.spheres_per_face
        self.sphere = ti.Vector.field(3, real, shape=count)

    @ti.func
    def place(self, i):
        """Note where the spheres of body i are; computed once for many that ask."""
        size = ti.static(self.model.spheres_per_face)
        position, rotation = self.state.position[i], self.state.rotation[i]
        for face in range(4 * i, 4 * i + 4):
            if self.state.exposed_tick[face] >= 0:
                for s in range(size * face, size * face + size):
                    self.sphere[s] = position + rotation @ self.model.sphere[s].xyz

    @ti.func
    def of_pair(self, i, j, faces, start, write):
        """Number of sphere pairs of two bodies within the skin, and the smallest other gap [m].

        faces: bit 4 f + g for faces f and g to compare. The gap is that of spheres outside the
        skin, and no more than the reach of the ``Neighbours``. write: enter the pairs among the
        candidates, from start on; then other gaps are of no interest.
        """
        count, least = 0, self.contacts.skin[None]
        if not write:
            least *= REACH
        for fg in range(16):
            if (faces >> fg) & 1 == 1:
                face_i, face_j = 4 * i + fg // 4, 4 * j + fg % 4
                if self.near.clusters_near(face_i, face_j, least):
                    more, least = self._of_faces(face_i, face_j, start + count, least, write)
                    count += more
        return count, least

    @ti.func
    def _of_faces(self, face_i, face_j, start, least, write):
        count = 0
        size, skin = ti.static(self.model.spheres_per_face), self.contacts.skin[None]
        for a in range(size * face_i, size * face_i + size):
            mine = self.model.sphere[a][3]
            whole = mine + self.model.cluster[face_j][3] + least
            # A sphere far from the ball around those of the other face is as far from all of them.
            if (self.near.cluster[face_j] - self.sphere[a]).norm_sqr() < whole * whole:
                for b in range(size * face_j, size * face_j + size):
                    reach = mine + self.model.sphere[b][3]
                    apart2 = (self.sphere[b] - self.sphere[a]).norm_sqr()
                    if apart2 < (reach + skin) * (reach + skin):
                        if write:
                            self.contacts.pair_sphere[start + count] = [a, b]
                        count += 1
                    elif apart2 < (reach + least) * (reach + least):
                        least = ti.sqrt(apart2) - reach
        return count, least
