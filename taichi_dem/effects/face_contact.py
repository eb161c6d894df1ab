"""Contact of spheres with faces, by which flat sides slide over each other without interlocking."""

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import taichi as ti

from taichi_dem.effects.sphere_contact import SphereContact
from taichi_dem.kit.allocation import assign
from taichi_dem.kit.fixed_order import dot, length
from taichi_dem.kit.types import real, vec3, vec4
from taichi_dem.mesh.contact_spheres import ContactSpheres
from taichi_dem.mesh.face_rims import face_rims
from taichi_dem.mesh.tetrahedra import all_faces, area_vectors
from taichi_dem.physics.sphere_pair import Nearest
from taichi_dem.physics.triangle import CORNER, EDGE, INSIDE, closest_point

if TYPE_CHECKING:
    from taichi_dem.engine.capacity import Capacity
    from taichi_dem.engine.model import Model


@ti.data_oriented
class FaceContact(SphereContact):
    """Spheres behind the free faces of a body touch the free faces of others; both ways.

    In place of ``SphereContact``, whose spheres meet on their flanks. The overlap is the radius
    less the distance from the centre to the closest point of the face; the force acts along this
    line and derives from the energy. Outer faces that continue each other are one flat side,
    without edges between them. A sphere whose centre is inside a body, by less than its radius, is
    pushed back through the free face that is nearest.

    Arguments: as of ``SphereContact``. Faces reach farther than the spheres behind them, so the
    lists are longer; a body's radius, of which the skin is a share, is that to its corners.
    Source of the closest point: Ericson, Real-Time Collision Detection, 5.1.5; not in the paper.
    """

    name = "face_contact"
    meets_faces = True
    constant_fields = ("plane", "corner", "end", "rim")

    def __init__(
        self,
        divisions: int = 5,
        outer_faces: bool = True,
        skin: float = 0.0075,
        neighbours_per_body: int = 192,
        pairs_per_body: int = 48,
        spheres_per_body: int = 320,
    ):
        room = neighbours_per_body, pairs_per_body, spheres_per_body
        super().__init__(divisions, outer_faces, skin, *room)

    def spheres(self, model: "Model") -> ContactSpheres:
        """Spheres of a model; the balls around them also hold the corners of the faces."""
        spheres = super().spheres(model)
        corners = _corners(model)
        away = length(corners - spheres.cluster[:, :, None, :3]).max(axis=2)
        cluster = spheres.cluster.copy()
        cluster[..., 3] = np.maximum(cluster[..., 3], away)
        extent = np.maximum(spheres.extent, model.body_radius)
        return replace(spheres, cluster=cluster, extent=extent)

    def declare(self, capacity: "Capacity") -> None:
        """Planes and corners of the faces in body frames, and rims (``mesh.face_rims``).

        plane: outward normal and distance from the body's centre [m]. rim: bit e for an edge and
        bit 3 + k for a corner that other bodies can meet.
        """
        faces = capacity.faces
        self.plane = ti.Vector.field(4, real, shape=faces)
        self.corner = ti.Vector.field(3, real, shape=3 * faces)
        self.end = ti.Vector.field(6, real, shape=3 * faces)
        self.rim = ti.field(ti.i32, shape=faces)

    def follow(self, exposed_faces: ti.Field) -> None:
        """Take note of the field with a bit for each face of a body that is free."""
        self.exposed_faces = exposed_faces

    def load(self, model: "Model") -> None:
        """Load the faces of a scene."""
        corners = _corners(model).reshape(-1, 3, 3)
        normal = area_vectors(corners.reshape(-1, 3), np.arange(corners.size // 3).reshape(-1, 3))
        normal /= length(normal)[:, None]
        plane = np.concatenate([normal, dot(normal, corners[:, 0])[:, None]], axis=1)
        rims = face_rims(model.mesh, model.topology.body_bond.reshape(-1) < 0)
        bits = np.concatenate([rims.edge, rims.corner], axis=1) @ (1 << np.arange(6))
        assign(self.plane, plane)
        assign(self.corner, corners.reshape(-1, 3))
        assign(self.end, rims.ends.reshape(-1, 6))
        assign(self.rim, bits.astype(np.int32))

    @ti.func
    def nearest(self, a, b, turn, offset):
        """Where a sphere, the index that is not negative, is nearest to face -1 - a or -1 - b."""
        first, apart, reach, can_meet = vec4(0.0), vec3(0.0), 0.0, 0
        if b < 0:
            first = self.tables.sphere[a]
            back = turn.transpose()
            found = self._nearest(back @ (first.xyz - offset), first[3], -1 - b)
            apart, reach, can_meet = -(turn @ found.apart), found.reach, found.can_meet
        else:
            second = self.tables.sphere[b]
            found = self._nearest(turn @ second.xyz + offset, second[3], -1 - a)
            first, apart = found.first, found.apart
            reach, can_meet = found.reach, found.can_meet
        return Nearest(first=first, apart=apart, reach=reach, can_meet=can_meet)

    @ti.func
    def face_of(self, a):
        """Face 4 * body + f of one side of an entry of the pair store."""
        face = -1 - a
        if a >= 0:
            face = a // self.tables.face_spheres[None]
        return face

    @ti.func
    def _nearest(self, centre, radius, face):
        """A sphere's nearest point on a face, in the frame of the face's body, a ``Nearest``."""
        k = 3 * face
        found = closest_point(centre, self.corner[k], self.corner[k + 1], self.corner[k + 2])
        point, region = found.point, found.region
        apart, reach, can_meet = centre - point, radius, True
        if region == INSIDE:
            depth = -apart.dot(self.plane[face].xyz)
            if 0.0 < depth and depth < radius:
                if self._is_within(centre, depth, face):
                    # The mirror image of the centre in front of the face has the same overlap.
                    apart, reach = -apart, radius + 2.0 * depth
        else:
            can_meet = self._is_met(region, apart, face)
        first = vec4(point[0], point[1], point[2], 0.0)
        return Nearest(first=first, apart=apart, reach=reach, can_meet=ti.cast(can_meet, ti.i32))

    @ti.func
    def _is_within(self, centre, depth, face):
        """Whether a point behind a face is within its body, and no other free face is nearer."""
        within, i = True, face // 4
        for f in range(4):
            plane = self.plane[4 * i + f]
            behind = plane[3] - plane.xyz.dot(centre)
            free = (self.exposed_faces[i] >> f) & 1 == 1
            if behind < 0.0 or (free and behind < depth):
                within = within and 4 * i + f == face
        return within

    @ti.func
    def _is_met(self, region, apart, face):
        """Whether the edge or corner of a face ends the flat side of which the face is a part."""
        met = (self.rim[face] >> (region - EDGE)) & 1 == 1
        if region >= CORNER:
            end = self.end[3 * face + region - CORNER]
            met = met and apart.dot(end[0:3]) <= 0.0 and apart.dot(end[3:6]) <= 0.0
        return met


def _corners(model):
    """Corners of all faces in body frames, (n, 4, 3, 3) [m]."""
    faces = all_faces(model.mesh.tetrahedra).reshape(-1, 4, 3)
    return model.mesh.points[faces] - model.centre[:, None, None]
