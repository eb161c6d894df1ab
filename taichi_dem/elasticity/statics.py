"""Statics of bonded bodies: small displacements and turns under forces, by conjugate gradients.

NumPy only. The three units of a face with relative displacement d at its middle and relative turn w
give the force A D d and a moment that depends on w alone, D = diag(k_n, k_s, k_s) in the face's
axes: the corners' distances from the middle add up to zero.
"""

from __future__ import annotations

import numpy as np

from taichi_dem.kit.errors import InputError
from taichi_dem.kit.fixed_order import length
from taichi_dem.mesh.mesh import Mesh
from taichi_dem.mesh.tetrahedra import area_vectors
from taichi_dem.mesh.topology import Topology, body_properties

#: Residual of a solution, as a share of the largest load, and iterations at most.
_TOLERANCE, _MOST_ITERATIONS = 1e-10, 20_000
_TINY = 1e-300


class BondStatics:
    """Linear springs of all bonds between rigid bodies.

    mesh, topology: of the bodies. springs: normal and tangential stiffness of every bond per area
    [Pa/m], (bond_count, 2). A field of motions has the shape (bodies, 6, loads), displacement of
    the centre [m] and turn [rad]; forces likewise, force [N] and moment about the centre [N m].
    """

    def __init__(self, mesh: Mesh, topology: Topology, springs: np.ndarray):
        linear, angular = _face_springs(mesh, topology, springs)
        _, centre, _ = body_properties(mesh, 1.0)
        middle = mesh.points[topology.vertices].mean(axis=1)
        sides = topology.master, topology.slave
        levers = [_lever(middle - centre[side]) for side in sides]
        count = mesh.body_count
        #: Body behind each local face, its own number where there is none: its block is zero.
        self.neighbour = np.tile(np.arange(count)[:, None], (1, 4))
        self.own, self.across = np.zeros((count, 6, 6)), np.zeros((count, 4, 6, 6))
        faces = topology.master_face, topology.slave_face
        for here, there in ((0, 1), (1, 0)):
            body, face = sides[here], faces[here]
            self.neighbour[body, face] = sides[there]
            turned = levers[here].swapaxes(1, 2) @ linear
            self.across[body, face] = -_with_turn(turned @ levers[there], angular)
            np.add.at(self.own, body, _with_turn(turned @ levers[here], angular))
        self.rows = np.moveaxis(self.across, 1, 2).reshape(count, 6, 24)

    def forces(self, motion: np.ndarray) -> np.ndarray:
        """Forces that hold the bodies at a field of motions (bodies, 6, loads)."""
        around = motion[self.neighbour].reshape(len(motion), 24, -1)
        return self.own @ motion + self.rows @ around

    def motions(self, forces: np.ndarray) -> np.ndarray:
        """Field of motions (bodies, 6, loads) under forces, up to rigid motions of each part.

        forces: balanced on each part that bonds join. Raises InputError where the iteration does
        not converge, as with forces that are not balanced.
        Conjugate gradients, preconditioned by the block of each body.
        """
        solved, rest = np.zeros(forces.shape), forces.copy()
        alone = (self.own == 0.0).all(axis=(1, 2))
        # Forces on a body without bonds are balanced: what is left of them is rounding.
        rest[alone] = 0.0
        inverse = np.linalg.inv(np.where(alone[:, None, None], np.eye(6), self.own))
        # Of the largest load: another may be zero but for rounding, as a pull along a face is.
        bound = _TOLERANCE**2 * _products(rest, inverse @ rest).max()
        way, size = np.zeros(forces.shape), np.ones(forces.shape[2])
        for _ in range(_MOST_ITERATIONS):
            scaled = inverse @ rest
            now = _products(rest, scaled)
            if np.all(now <= bound):
                return solved
            way = scaled + now / np.maximum(size, _TINY) * way
            held, size = self.forces(way), now
            step = now / np.maximum(_products(way, held), _TINY)
            solved += step * way
            rest -= step * held
        raise InputError(
            f"the springs of a mesh must be solved within {_MOST_ITERATIONS} iterations, and are "
            f"not: is it made of bodies that hang on single bonds, or of very uneven size?"
        )


def _face_springs(mesh, topology, springs):
    """Stiffness of the three units of every bond about the middle of its face.

    Two arrays (bond_count, 3, 3): force over displacement [N/m], moment over turn [N m].
    """
    corners = mesh.points[topology.vertices]
    vector = area_vectors(mesh.points, topology.vertices)
    area = length(vector)[:, None, None]
    normal = vector / area[:, 0]
    across, along = springs[:, 1, None, None], (springs[:, 0] - springs[:, 1])[:, None, None]
    law = across * np.eye(3) + along * normal[:, :, None] * normal[:, None, :]
    # A turn w displaces a corner s by w x s and the force f there has the moment s x f.
    spread = cross_matrices(corners - corners.mean(axis=1)[:, None])
    turned = -(spread @ law[:, None] @ spread).sum(axis=1)
    return area * law, area / 3.0 * turned


def _lever(arms):
    """Map from (displacement, turn) of bodies to the displacement at arms (n, 3), (n, 3, 6)."""
    return np.concatenate([np.tile(np.eye(3), (len(arms), 1, 1)), -cross_matrices(arms)], axis=2)


def _with_turn(blocks, angular):
    """Blocks (n, 6, 6) with the moments over turns (n, 3, 3) added."""
    blocks[:, 3:, 3:] += angular
    return blocks


def cross_matrices(vectors: np.ndarray) -> np.ndarray:
    """Matrices [r]x with [r]x w = r x w, (..., 3, 3), of vectors (..., 3)."""
    made = np.zeros((*vectors.shape, 3))
    for row, column, part, sign in ((0, 1, 2, -1), (0, 2, 1, 1), (1, 2, 0, -1)):
        made[..., row, column] = sign * vectors[..., part]
        made[..., column, row] = -made[..., row, column]
    return made


def _products(one, other):
    """Inner products of two fields, one for each load."""
    return np.einsum("bkl,bkl->l", one, other)
