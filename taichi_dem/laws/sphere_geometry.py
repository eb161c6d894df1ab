"""Geometry of contact: spheres on broken faces (Konno et al., 2.2, Fig. 5)."""

import numpy as np
import taichi as ti

from taichi_dem.kit.allocation import assign
from taichi_dem.kit.products import matvec, norm, squared
from taichi_dem.kit.types import real
from taichi_dem.kit.validation import whole
from taichi_dem.laws.contact_contracts import Geometry
from taichi_dem.physics.sphere_pair import Nearest, is_within, meeting
from taichi_dem.state.model import Model
from taichi_dem.state.tables import Capacity


@ti.data_oriented
class SphereGeometry(Geometry):
    """Spheres inscribed behind free faces meet each other.

    Parameters
    ----------
    divisions : int, default 5
        Equal parts of the edges of a face; 5 gives the paper's six spheres a face.
    outer_faces : bool or str, default True
        True: outer faces carry spheres from the start. ``"once_broken"``: from the first break of
        any bond. False: only broken faces carry them, as in the paper; others do not touch.
    skin : float, default 0.015
        Gap up to which spheres enter the candidate list, at least, as a share of the radius of a
        body; more where bodies are fast. It changes time, not results.
    """

    constant_fields = "sphere", "cluster"

    def __init__(
        self,
        divisions: int = 5,
        outer_faces: bool | str = True,
        skin: float = 0.015,
    ):
        self.divisions = whole("divisions", divisions, 3, 20)
        super().__init__(outer_faces, skin)

    def extents(self, model: Model) -> np.ndarray:
        """A body extends to its spheres."""
        return model.spheres.extent

    def declare(self, capacity: Capacity) -> None:
        """Spheres of all faces, and a ball around those of each: centre and radius [m]."""
        self.sphere = ti.Vector.field(4, real, shape=capacity.spheres)
        self.cluster = ti.Vector.field(4, real, shape=capacity.faces)

    def upload(self, model: Model) -> None:
        """Load the spheres of a scene."""
        spheres = model.spheres
        ball = np.concatenate([spheres.centre, spheres.radius[..., None]], axis=-1)
        assign(self.sphere, ball.reshape(-1, 4))
        assign(self.cluster, spheres.cluster.reshape(-1, 4))

    @ti.func
    def nearest(self, a, b, turn, offset):
        """Where two bodies are nearest by an entry (a, b) of the pair store, a ``Nearest``."""
        first, second = self.sphere[a], self.sphere[b]
        apart = matvec(turn, second.xyz) + offset - first.xyz
        size = first[3] + second[3]
        return Nearest(first=first, apart=apart, reach=size, size=size)

    @ti.func
    def find(self, i, j, turn, offset, faces, margin, far):
        """Number of contacts of bodies i, j with a gap below a margin [m]; least gap of others."""
        return self._compare(i, j, turn, offset, faces, margin, far, -1)

    @ti.func
    def enter(self, i, j, turn, offset, faces, margin, place):
        """Enter those contacts in the pair store, from a place on."""
        self._compare(i, j, turn, offset, faces, margin, margin, place)

    @ti.func
    def _compare(self, i, j, turn, offset, faces, margin, far, place):
        count, gap = 0, far
        for fg in range(16):
            if (faces >> fg) & 1 == 1:
                first, second = 4 * i + fg // 4, 4 * j + fg % 4
                mine, other = self.cluster[first], self.cluster[second]
                middle, reach = matvec(turn, other.xyz) + offset, other[3] + gap
                if squared(middle - mine.xyz) < (mine[3] + reach) ** 2:
                    size = self.tables.face_spheres[None]
                    for a in range(size * first, size * first + size):
                        sphere = self.sphere[a]
                        # One far from the ball around those of the other face is far from all.
                        if squared(middle - sphere.xyz) < (sphere[3] + reach) ** 2:
                            count, gap = self._compare_one(
                                a, size * second, turn, offset, margin, gap, place, count
                            )
        return count, gap

    @ti.func
    def _compare_one(self, a, first, turn, offset, margin, gap, place, count):
        """The same of sphere a with those of a face, from the first on."""
        sphere = self.sphere[a]
        for b in range(first, first + self.tables.face_spheres[None]):
            other = self.sphere[b]
            reach = sphere[3] + other[3]
            apart = squared(matvec(turn, other.xyz) + offset - sphere.xyz)
            if apart < (reach + margin) ** 2:
                if place >= 0:
                    self.store.sphere[place + count] = [a, b]
                count += 1
            elif apart < (reach + gap) ** 2:
                gap = ti.sqrt(apart) - reach
        return count, gap

    @ti.func
    def is_within(self, near, margin):
        """Whether two bodies are nearer than a margin [m], by a ``Nearest``."""
        return is_within(near, margin)

    @ti.func
    def meeting(self, near, k, rotation):
        """The ``Meeting`` of entry k; rotation: of the first body."""
        return meeting(near.first, near.reach, near.apart, rotation)

    @ti.func
    def overlap(self, near):
        """Overlap of two spheres [m]."""
        return near.reach - norm(near.apart)

    @ti.func
    def gap(self, a, b, first, turned_first, second, turned_second):
        """Gap of two spheres [m]."""
        sphere, other_sphere = self.sphere[a], self.sphere[b]
        on_first, on_second = (
            matvec(turned_first, sphere.xyz),
            matvec(turned_second, other_sphere.xyz),
        )
        return norm(second + on_second - first - on_first) - sphere[3] - other_sphere[3]
