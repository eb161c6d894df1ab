"""Geometry of contact: whole bodies, by the energy of their shared volume."""

import numpy as np
import taichi as ti

from taichi_dem.kit.allocation import assign
from taichi_dem.kit.fixed_order import dot, length
from taichi_dem.kit.products import (
    cross,
    matmul,
    matmul_transposed,
    matvec,
    norm,
    transposed_matvec,
)
from taichi_dem.kit.types import real, vec3, vec4
from taichi_dem.kit.validation import whole
from taichi_dem.laws.contact_contracts import Geometry
from taichi_dem.mesh.mesh import Mesh, volumes
from taichi_dem.mesh.tetrahedra import LOCAL_FACES, all_faces, area_vectors
from taichi_dem.physics.body_overlap import raised, ray_ends, sum_of_rays, turning
from taichi_dem.physics.rotation import place_in
from taichi_dem.physics.sphere_pair import Meeting, Nearest
from taichi_dem.state.model import Model
from taichi_dem.state.pair_store import PairStore
from taichi_dem.state.tables import Capacity

#: Largest number of parts of an edge, overlap [m2] that counts as none, and distance from which on
#: the rays to a face are left out at once, as a share of the size of their body.
MOST_PARTS, _NONE, _FAR = 8, 1e-28, 0.02


@ti.data_oriented
class BodyGeometry(Geometry):
    """Whole bodies meet each other, also at outer faces, by rays from their middles to their faces.

    The size of an overlap is q, where flat sides meet: the root of the contact area times the
    depth. q0 is the smallest q since the two could touch. A law gets (q - q0) / sqrt(area).

    Parameters
    ----------
    parts : int, default 3
        Equal parts of the edges of a face; parts^2 rays go from the middle of a body to each face.
        Those of the smaller body of a pair count more, by the square of the ratio of volumes.
    outer_faces : bool or str, default True
        True: outer faces meet from the start. ``"once_broken"``: from the first break of any bond.
    skin : float, default 0.0075
        Gap up to which pairs are candidates, as a share of a body's radius: time, not results.

    References
    ----------
    Munjiza, The combined finite-discrete element method (2004), for the potential.
    """

    by_face = False
    at_start = 0.5, 0.5, 110.0
    constant_fields = (
        *("corner", "outward", "plane", "incentre", "volume", "face_area", "far"),
        *("ends", "end_count", "least_weight"),
    )

    def __init__(
        self,
        parts: int = 3,
        outer_faces: bool | str = True,
        skin: float = 0.0075,
    ):
        self.parts = whole("parts", parts, 2, MOST_PARTS)
        super().__init__(outer_faces, skin)

    def extents(self, model: Model) -> np.ndarray:
        """A body extends to its corners."""
        return model.body_radius

    def declare(self, capacity: Capacity) -> None:
        """Corners, planes (4 x 3 normals, 4 distances) and ray ends of bodies, in their frames."""
        self.corner = ti.Matrix.field(4, 3, real, shape=capacity.bodies)
        self.outward = ti.Matrix.field(4, 3, real, shape=capacity.bodies)
        self.plane = ti.Vector.field(4, real, shape=capacity.bodies)
        self.incentre = ti.Vector.field(4, real, shape=capacity.bodies)
        self.volume, self.face_area, self.far = (
            ti.field(real, shape=capacity.bodies) for _ in range(3)
        )
        self.ends = ti.Vector.field(4, real, shape=4 * MOST_PARTS**2)
        self.end_count, self.least_weight = ti.field(ti.i32, shape=()), ti.field(real, shape=())

    def declare_columns(self, store: PairStore) -> None:
        """Keep q0 [m2] of each pair, and 1 once it is known; paths [m] up to which it is apart."""
        super().declare_columns(store)
        self.rest = store.sphere_column("rest_overlap", real, 2)
        self.clear_until = store.sphere_column("clear_until", real)

    def forget_paths(self) -> None:
        """Compare all pairs anew, wherever bodies have been put."""
        assign(self.clear_until, 0.0)

    def upload(self, model: Model) -> None:
        """Upload the bodies of a scene."""
        corners, normal, ends = _corners(model), _outward(model.mesh), ray_ends(self.parts)
        area = length(normal)
        normal /= area[..., None]
        assign(self.corner, corners)
        assign(self.outward, normal)
        assign(self.plane, dot(normal, corners[:, LOCAL_FACES[:, 0]]))
        assign(self.incentre, area / area.sum(axis=1, keepdims=True))
        assign(self.volume, volumes(model.mesh))
        assign(self.far, _FAR * np.cbrt(volumes(model.mesh)))
        assign(self.face_area, area.max(axis=1))
        assign(self.ends, np.concatenate([ends, np.zeros((4 * MOST_PARTS**2 - len(ends), 4))]))
        assign(self.end_count, len(ends))
        assign(self.least_weight, ends[ends > 0.0].min())

    @ti.func
    def nearest(self, a, b, turn, offset):
        """How bodies a and b overlap, or a bound of their gap, a ``Nearest``."""
        force, moment, middle = vec3(0.0), vec3(0.0), vec3(0.0)
        doubled, volume, outside, ones = 0.0, 0.0, 1e30, vec4(1.0)
        for side in range(2):
            at, planes, total, slope, apart = self._side(side, a, b, turn, offset, True, 0.0)
            # Rays of a large body miss a small one, or stand for more than all of it.
            weight = self._weight(a, b)
            if side == 1:
                weight = 2.0 - weight
            outside, slope = ti.min(outside, apart), weight * slope
            doubled += weight * total
            weights, push = matvec(slope, ones), matmul(slope, planes)
            middle, volume = middle + transposed_matvec(at, weights), volume + weights.sum()
            sign = 2.0 * side - 1.0
            force += sign * transposed_matvec(push, ones)
            moment += sign * turning(at, push)
        near, strength = Nearest(reach=-outside, size=1.0), norm(force)
        if doubled > _NONE * _NONE and strength > 0.0:
            middle /= volume
            near.first, near.apart = vec4(middle[0], middle[1], middle[2], 0.0), force / strength
            near.couple = (moment - cross(middle, force)) / strength
            # The overlap is q = sqrt(doubled) [m2], and moves by this much a metre.
            slope = 0.5 * strength / ti.sqrt(doubled)
            near.area, near.reach = slope * slope, ti.sqrt(doubled) / slope
            near.size = 2.0 * near.reach * ti.min(self.volume[a], self.volume[b]) / volume
        else:
            near.apart = vec3(1.0, 0.0, 0.0)
        return near

    @ti.func
    def find(self, i, j, turn, offset, faces, margin, far):
        """Bodies i and j make one contact where a ray of one may enter the other soon."""
        count, gap = 0, self.outside(i, j, turn, offset, margin)
        if gap < margin:
            count, gap = 1, margin
        return count, gap

    @ti.func
    def enter(self, i, j, turn, offset, faces, margin, place):
        """Enter that contact in the pair store."""
        self.store.sphere[place] = [i, j]

    @ti.func
    def outside(self, a, b, turn, offset, enough):
        """A bound of the way that bodies may go before a ray of one enters the other [m]."""
        outside = 1e30
        for side in range(2):
            if outside >= enough:
                outside = ti.min(outside, self._side(side, a, b, turn, offset, False, enough)[4])
        return outside

    @ti.func
    def _side(self, side, a, b, turn, offset, whole: ti.template(), enough):
        """Corners of one body, planes of the other in the first's frame; their ``sum_of_rays``."""
        body, at, planes = a, self.corner[a], matmul_transposed(self.outward[b], turn)
        distances = self.plane[b] + matvec(planes, offset)
        if side == 1:
            body, at = b, raised(matmul_transposed(self.corner[b], turn), offset)
            planes, distances = self.outward[a], self.plane[a]
        total, slope, apart = sum_of_rays(
            raised(-matmul_transposed(at, planes), distances),
            self.incentre[body],
            self.volume[body],
            self.far[body],
            self.ends,
            self.least_weight[None],
            self.end_count[None],
            whole,
            enough,
        )
        return at, planes, total, slope, apart

    @ti.func
    def _weight(self, a, b):
        """Weight of the rays of body a against those of body b; both add to 2."""
        ratio = self.volume[a] / self.volume[b]
        return 2.0 / (1.0 + ratio * ratio)

    @ti.func
    def gap(self, a, b, first, turned_first, second, turned_second):
        """Gap of two bodies [m], by their rays."""
        turn, offset = place_in(turned_first, turned_second, second - first)
        return -self.nearest(a, b, turn, offset).reach

    @ti.func
    def overlap(self, near):
        """Overlap of two bodies [m], with what lies at rest."""
        return near.reach

    @ti.func
    def depth(self, near, overlap):
        """How deep two bodies overlap, with what lies at rest."""
        return near.reach / near.size

    @ti.func
    def largest_area(self, a, b):
        """Bound of the area of contact of two bodies [m2]."""
        return ti.min(self.face_area[a], self.face_area[b])

    @ti.func
    def weight(self, a, b, area):
        """Factor of the rate in a dashpot per area, sqrt(m1 m2 / (m1 + m2) / area) [kg^1/2 / m]."""
        slack = self.tables.mass_inverse[a] + self.tables.mass_inverse[b]
        return 1.0 / ti.sqrt(slack * ti.max(area, _NONE))

    def largest_areas(self, mesh: Mesh) -> np.ndarray:
        """Largest face of each body [m2], (n,)."""
        return length(_outward(mesh)).max(axis=1)

    def weights(self, mass: np.ndarray, area: np.ndarray) -> np.ndarray:
        """Weight of each body and its like, (n,)."""
        return np.sqrt(0.5 * mass / area)

    @ti.func
    def is_within(self, near, margin):
        """Whether two bodies are nearer than a margin [m]."""
        return near.reach + margin > 0.0

    @ti.func
    def meeting(self, near, k, rotation):
        """The ``Meeting`` of entry k; rotation: of the first body."""
        overlap = near.reach
        if near.area > 0.0:
            overlap -= self._rest(near, k) / ti.sqrt(near.area)
        return Meeting(
            overlap=overlap,
            normal=matvec(rotation, near.apart),
            arm=matvec(rotation, near.first.xyz),
            area=near.area,
            couple=matvec(rotation, near.couple),
            weight=self.weight(self.store.sphere[k][0], self.store.sphere[k][1], near.area),
        )

    @ti.func
    def may_meet(self, k, paths, margin):
        """Whether bodies may be within a margin [m] by entry k, so far as their paths tell."""
        return not paths + margin < self.clear_until[k]

    @ti.func
    def settle(self, near, k, paths):
        """Take the present overlap of entry k as that at rest, if it is the smallest so far."""
        self.rest[k] = [self._rest(near, k), 1.0]
        # Rounding of paths is far below what is left of the gap.
        self.clear_until[k] = paths + ti.max(0.0, -near.reach) * (1.0 - 1e-6)

    @ti.func
    def _rest(self, near, k):
        """Overlap at rest of entry k [m2], as ``settle`` would leave it."""
        rest = ti.max(near.reach, 0.0) * ti.sqrt(near.area)
        if self.rest[k][1] > 0.0:
            rest = ti.min(rest, self.rest[k][0])
        return rest


def _corners(model):
    return model.mesh.points[model.mesh.tetrahedra] - model.centre[:, None]


def _outward(mesh):
    return area_vectors(mesh.points, all_faces(mesh.tetrahedra)).reshape(-1, 4, 3)
