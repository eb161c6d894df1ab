"""Contact of spheres with faces, by which flat sides slide over each other without interlocking."""

from dataclasses import replace

import numpy as np
import taichi as ti

from taichi_dem.kit import fixed_order
from taichi_dem.kit.allocation import assign
from taichi_dem.kit.fixed_order import length
from taichi_dem.kit.products import dot, matvec, squared, transposed_matvec
from taichi_dem.kit.types import real, vec4
from taichi_dem.laws.sphere_contact import SphereContact
from taichi_dem.mesh.contact_spheres import ContactSpheres
from taichi_dem.mesh.tetrahedra import all_faces, area_vectors
from taichi_dem.physics.sphere_pair import Nearest
from taichi_dem.physics.triangle import closest_point
from taichi_dem.state.capacity import Capacity
from taichi_dem.state.model import Model

#: A distance farther than any, and a factor of its square that rounding does not reach.
_FAR, _CLEARLY = 1e30, 1.0001


@ti.data_oriented
class FaceContact(SphereContact):
    """Spheres behind the free faces of a body touch the free faces of others; both ways.

    Takes the place of ``SphereContact``, whose spheres touch on their flanks. Outer faces always
    touch.

    Parameters
    ----------
    divisions : int, default 5
        Equal parts of the edges of a face; 5 gives the paper's six spheres a face.
    skin : float, default 0.0075
        Gap up to which spheres enter the candidate list, as a share of the radius of a body to its
        corners. It changes time, not results.
    neighbours_per_body : int, default 192
        Mean capacity of the list of neighbours.
    pairs_per_body : int, default 48
        Mean capacity of the list of body pairs.
    spheres_per_body : int, default 320
        Mean capacity of the list of sphere contacts.

    Notes
    -----
    A sphere touches every other body at the one point of its free faces that is nearest to the
    centre. The overlap is the radius less that distance; the force acts along this line and derives
    from the energy, which changes continuously over edges, corners and cracks. Over the common edge
    of two bodies that make a flat side a sphere touches both and has less overlap there. A sphere
    whose centre is inside a body is pushed out through the free face that is nearest; the run
    counts as diverged by then. Faces reach farther than the spheres behind them, so the lists are
    longer. The effect is not in the paper.

    References
    ----------
    Ericson, Real-Time Collision Detection, section 5.1.5 (closest point of a triangle).

    Examples
    --------
    >>> FaceContact().face_spheres
    6
    """

    name = "face_contact"
    activation = "spheres of free faces touch a face"
    meets_faces = True
    constant_fields = ("plane", "corner")

    def __init__(
        self,
        divisions: int = 5,
        skin: float = 0.0075,
        neighbours_per_body: int = 192,
        pairs_per_body: int = 48,
        spheres_per_body: int = 320,
    ):
        room = neighbours_per_body, pairs_per_body, spheres_per_body
        super().__init__(divisions, True, skin, *room)

    def spheres(self, model: Model) -> ContactSpheres:
        """Spheres of a model; the balls around them also hold the corners of the faces."""
        spheres = super().spheres(model)
        corners = _corners(model)
        away = length(corners - spheres.cluster[:, :, None, :3]).max(axis=2)
        cluster = spheres.cluster.copy()
        cluster[..., 3] = np.maximum(cluster[..., 3], away)
        extent = np.maximum(spheres.extent, model.body_radius)
        return replace(spheres, cluster=cluster, extent=extent)

    def declare(self, capacity: Capacity) -> None:
        """Planes and corners of the faces in body frames.

        plane: outward normal and distance from the body's centre [m].
        """
        self.plane = ti.Vector.field(4, real, shape=capacity.faces)
        self.corner = ti.Vector.field(3, real, shape=3 * capacity.faces)

    def watch_faces(self, exposed_faces: ti.Field) -> None:
        """Take note of the field with a bit for each face of a body that is free."""
        self.exposed_faces = exposed_faces

    def load(self, model: Model) -> None:
        """Load the faces of a scene."""
        corners = _corners(model).reshape(-1, 3, 3)
        normal = area_vectors(corners.reshape(-1, 3), np.arange(corners.size // 3).reshape(-1, 3))
        normal /= length(normal)[:, None]
        assign(
            self.plane,
            np.concatenate([normal, fixed_order.dot(normal, corners[:, 0])[:, None]], axis=1),
        )
        assign(self.corner, corners.reshape(-1, 3))

    @ti.func
    def nearest(self, a, b, turn, offset):
        """Where a sphere, the index that is not negative, is nearest to the body of the other.

        The other index is -1 - face. Only with the nearest of a body's faces can the sphere meet.
        """
        sphere, face = self.tables.sphere[ti.max(a, b)], -1 - ti.min(a, b)
        centre = matvec(turn, sphere.xyz) + offset
        if b < 0:
            centre = transposed_matvec(turn, sphere.xyz - offset)
        found = self._nearest(centre, sphere[3], face)
        if b < 0:
            found.first, found.apart = sphere, -matvec(turn, found.apart)
        return found

    @ti.func
    def face_of(self, a):
        """Face 4 * body + f of one side of an entry of the pair store."""
        face = -1 - a
        if a >= 0:
            face = a // self.tables.face_spheres[None]
        return face

    @ti.func
    def _nearest(self, centre, radius, face):
        """A sphere's nearest point of the body of a face, in that body's frame, a ``Nearest``."""
        i = face // 4
        point, chosen, least = centre, -1, _FAR
        highest, top, within = -_FAR, -1, True
        for f in range(4 * i, 4 * i + 4):
            height = dot(self.plane[f].xyz, centre) - self.plane[f][3]
            within = within and height < 0.0
            if (self.exposed_faces[i] >> (f - 4 * i)) & 1 == 1:
                if height > highest:
                    highest, top = height, f
                # No point of a face is nearer than its plane.
                if height * height < _CLEARLY * least:
                    k = 3 * f
                    on_f = closest_point(
                        centre, self.corner[k], self.corner[k + 1], self.corner[k + 2]
                    )
                    if squared(centre - on_f) < least:
                        point, chosen, least = on_f, f, squared(centre - on_f)
        apart, reach, can_meet = centre - point, radius, chosen == face
        if within:
            # The mirror image of the centre in front of the face has the same overlap.
            apart, reach = -highest * self.plane[face].xyz, radius - 2.0 * highest
            point, can_meet = centre + apart, top == face and -highest < radius
        first = vec4(point[0], point[1], point[2], 0.0)
        met = ti.cast(can_meet, ti.i32)
        return Nearest(first=first, apart=apart, reach=reach, size=radius, can_meet=met)


def _corners(model):
    """Corners of all faces in body frames, (n, 4, 3, 3) [m]."""
    faces = all_faces(model.mesh.tetrahedra).reshape(-1, 4, 3)
    return model.mesh.points[faces] - model.centre[:, None, None]
