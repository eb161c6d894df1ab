"""Results of earlier searches by pair of neighbours, so that few pairs are searched again."""

import taichi as ti

from taichi_dem.kit.types import real


@ti.data_oriented
class PairCache:
    """Cached search results of each entry of the ``VerletList``.

    Of an entry, side by side as they are asked for together: faces: which of the two bodies' faces
    are near, bit 4 f + g for faces f and g; broken: which of these are broken too; spheres: how
    many of their spheres are within the margin of the two; new_faces: faces among which these have
    just been found; until: how far the two have gone, together, when the gap of others may be 0
    [m].

    Of a body: met: how many of its entries have spheres; changed: 1 when these may be others;
    travelled: how far any point of it had gone when it was last looked at [m]; cluster: where the
    ball around the spheres of a face was then [m].
    """

    def __init__(self, contacts, capacity):
        n = contacts.tables.capacity.bodies
        self.tables, self.state, self.contacts = contacts.tables, contacts.state, contacts
        entry = [*(ti.field(ti.i32) for _ in range(4)), ti.field(real)]
        ti.root.dense(ti.i, capacity).place(*entry)
        self.faces, self.broken, self.spheres, self.new_faces, self.until = entry
        self.met = ti.field(ti.i32, shape=n)
        self.changed = ti.field(ti.i32, shape=n)
        self.travelled = ti.field(real, shape=n)
        self.cluster = ti.Vector.field(3, real, shape=4 * n)

    @ti.func
    def begin(self, k, faces):
        """Know nothing yet of entry k but which faces are near."""
        self.faces[k], self.broken[k], self.spheres[k], self.new_faces[k] = faces, 0, 0, 0
        self.until[k] = 0.0

    @ti.func
    def forget(self, k, i):
        """Entry k of body i goes: its spheres, if it had any, are far apart by now."""
        self.met[i] = self.met[i] - ti.cast(self.spheres[k] > 0, ti.i32)
        self.changed[i] = 1

    @ti.func
    def move(self, k, place):
        """Move what is known of entry k to another place."""
        self.faces[place], self.broken[place] = self.faces[k], self.broken[k]
        self.spheres[place], self.new_faces[place] = self.spheres[k], self.new_faces[k]
        self.until[place] = self.until[k]

    @ti.func
    def note_clusters(self, i, travel):
        """Note where the clusters of body i are, which has come a way of travel [m] since."""
        self.travelled[i] = self.travelled[i] + travel
        for face in range(4 * i, 4 * i + 4):
            self.cluster[face] = self.middle(i, face)

    @ti.func
    def middle(self, i, face):
        """Centre of a face's cluster now [m]."""
        return self.state.position[i] + self.state.rotation[i] @ self.tables.cluster[face].xyz

    @ti.func
    def may_gain_spheres(self, k, i, j, faces):
        """Whether entry k, bodies i and j, may have more spheres than it had; faces: broken now."""
        return self.broken[k] != faces or (faces != 0 and self._may_be_closer(k, i, j))

    @ti.func
    def to_ask(self, k, i, j, faces):
        """Those of the faces that are broken now which may bring entry k spheres.

        They are the fresh ones, where it has none so far and cannot have got any else.
        """
        if self.spheres[k] == 0 and not self._may_be_closer(k, i, j):
            faces &= ~self.broken[k]
        return faces

    @ti.func
    def _may_be_closer(self, k, i, j):
        """Whether two bodies have gone so far that more spheres may be within their margin."""
        return self.gap(k, i, j) < self.contacts.margin(i, j)

    @ti.func
    def gap(self, k, i, j):
        """Lower bound on the present gap of the pair's unlisted spheres [m]."""
        return self.until[k] - self.travelled[i] - self.travelled[j]

    @ti.func
    def found(self, k, i, j, faces, spheres, hits, gap):
        """Note the spheres of entry k, on which faces they are, and the smallest other gap [m]."""
        had = ti.cast(self.spheres[k] > 0, ti.i32)
        self.met[i] = self.met[i] - had + ti.cast(spheres > 0, ti.i32)
        self.broken[k], self.spheres[k], self.new_faces[k] = faces, spheres, hits
        self.changed[i] = 1
        self.until[k] = self.travelled[i] + self.travelled[j] + gap

    @ti.func
    def pop_new_faces(self, k):
        """Faces with spheres of entry k if these have just been found, else 0; once."""
        faces = self.new_faces[k]
        self.new_faces[k] = 0
        return faces

    @ti.func
    def pop_change(self, i):
        """1 if the entries of body i that have spheres may be others than at the last call."""
        changed = self.changed[i]
        self.changed[i] = 0
        return changed

    @ti.func
    def clusters_near(self, face_i, face_j, wide):
        """Whether the balls around the spheres of two faces come nearer than wide [m]."""
        reach = self.tables.cluster[face_i][3] + self.tables.cluster[face_j][3] + wide
        return (self.cluster[face_j] - self.cluster[face_i]).norm_sqr() < reach * reach
