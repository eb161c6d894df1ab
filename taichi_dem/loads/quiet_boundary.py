"""Quiet boundary: waves leave the mesh, as if the solid continued."""

import numpy as np
import taichi as ti

from taichi_dem.elasticity.rates import wave_moduli
from taichi_dem.kit.allocation import assign
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.fixed_order import length, product, transposed
from taichi_dem.kit.types import mat3, real
from taichi_dem.kit.validation import positive, word
from taichi_dem.laws.base import Effect
from taichi_dem.mesh.tetrahedra import area_vectors
from taichi_dem.mesh.topology import face_vertices, faces_of_group
from taichi_dem.physics.wrench import Block
from taichi_dem.state.capacity import Capacity
from taichi_dem.state.model import Model


@ti.data_oriented
class QuietBoundary(Effect):
    """Dashpots between the faces of a group and the ground, which reflect little of a wave.

    Parameters
    ----------
    group : str
        Group of outer faces.
    p_speed : float, optional
        Speed of compression waves [m/s]; None for that of the bonds near the face
        (``wave_moduli``).
    s_speed : float, optional
        Speed of shear waves [m/s]; None likewise.

    Notes
    -----
    Tractions of rho c_p v along the normal of a face and rho c_s v across it, v the velocity of the
    face, are those of a wave that goes on: a wave that meets the face at right angles is absorbed,
    an oblique one partly reflected. Normals and arms stay those of the mesh, as displacements are
    small there.

    References
    ----------
    J. Lysmer and R. L. Kuhlemeyer, Finite dynamic model for infinite media, J. Eng. Mech. Div. ASCE
    95(EM4), 1969, 859-877, eq. 1 and 2.
    """

    role = "ground"

    def __init__(self, group: str, p_speed: float | None = None, s_speed: float | None = None):
        self.group = word("group", group)
        self.p_speed = None if p_speed is None else positive("p_speed", p_speed)
        self.s_speed = None if s_speed is None else positive("s_speed", s_speed)

    def declare(self, capacity: Capacity) -> None:
        """Faces of every body in the group, and what resists it: the parts of a ``Block``."""
        # One field of 27 numbers, as Taichi has room for about a thousand components.
        self.faces = ti.field(ti.i32, shape=capacity.bodies)
        self.parts = ti.field(real, shape=(capacity.bodies, 27))

    def load(self, model: Model) -> None:
        """Find the faces and their impedance; InputError when the mesh has no such group."""
        body, face = faces_of_group(model.mesh, model.topology, self.group)
        corners = face_vertices(model.mesh, body, face)
        vector = area_vectors(model.mesh.points, corners)
        area = length(vector)
        normal = vector / area[:, None]
        density = np.broadcast_to(model.materials.density, model.body_count)[body]
        out = normal[:, :, None] * normal[:, None, :]
        along, across = (
            (area / 3.0 * density * speed)[:, None, None]
            for speed in self._speeds(model, corners, density)
        )
        laws = along * out + across * (np.eye(3) - out)
        assign(self.faces, np.bincount(body, minlength=model.body_count))
        # The dashpots at the three points of every face, [[a, b], [b^T, c]] as of ``point_block``.
        arms = model.mesh.points[corners] - model.centre[body][:, None]
        law = np.repeat(laws[:, None], 3, axis=1)
        lever_arm = np.swapaxes(np.cross(arms[:, :, None], np.eye(3)), -1, -2)
        lever = product(law, lever_arm)
        blocks = law, -lever, product(transposed(lever_arm), lever)
        total = np.zeros((model.body_count, 3, 3, 3))
        for k, block in enumerate(blocks):
            np.add.at(total[:, k], np.repeat(body, 3), block.reshape(-1, 3, 3))
        assign(self.parts, total.reshape(-1, 27))

    def _speeds(self, model, corners, density):
        """Speeds of both waves at each face [m/s]."""
        found = []
        for name, modulus in zip(("p_speed", "s_speed"), wave_moduli(model, corners)):
            speed = np.sqrt(modulus / density)
            given = getattr(self, name)
            if given is None and not np.isfinite(speed).all():
                raise InputError(
                    f"{name} of quiet_boundary must be given where no bond is near a face of "
                    f"group {self.group}, got None"
                )
            found.append(speed if given is None else np.full(len(speed), given))
        return found

    @ti.func
    def acts_on(self, i):
        """Nonzero for a body with a face in the group."""
        return self.faces[i]

    @ti.func
    def resistance(self, i):
        """Dashpots at the three points of each face of body i, as a ``Block``."""
        return Block(a=self._part(i, 0), b=self._part(i, 9), c=self._part(i, 18))

    @ti.func
    def _part(self, i, first):
        """A matrix of body i, by rows from an entry on."""
        found = mat3(0.0)
        for r, c in ti.static(ti.ndrange(3, 3)):
            found[r, c] = self.parts[i, first + 3 * r + c]
        return found
