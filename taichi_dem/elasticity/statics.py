"""Statics of bonded bodies: small displacements and turns under forces, by conjugate gradients.

NumPy only.
"""

from __future__ import annotations

import numpy as np

from taichi_dem.elasticity.rates import face_laws, levers
from taichi_dem.kit.errors import InputError
from taichi_dem.mesh.mesh import Mesh
from taichi_dem.mesh.topology import Topology, body_properties

#: Residual of a solution, as a share of the largest load, and iterations at most.
_TOLERANCE, _MOST_ITERATIONS = 1e-10, 20_000
_TINY = 1e-300


def motions_under(
    mesh: Mesh, topology: Topology, springs: np.ndarray, forces: np.ndarray
) -> np.ndarray:
    """Motions of rigid bodies joined by linear springs, up to rigid motions of each part.

    mesh, topology: of the bodies. springs: normal and tangential stiffness of every bond per area
    [Pa/m], (bond_count, 2). forces: force [N] and moment about the centre [N m], (bodies, 6,
    loads), balanced on each part that bonds join. Returns, likewise, the displacement of the centre
    [m] and the turn [rad]. Raises InputError where the iteration does not converge, as with forces
    that are not balanced.
    Conjugate gradients, preconditioned by the block of each body.
    """
    own, rows, neighbour = _blocks(mesh, topology, springs)
    solved, rest = np.zeros(forces.shape), forces.copy()
    alone = (own == 0.0).all(axis=(1, 2))
    # Forces on a body without bonds are balanced: what is left of them is rounding.
    rest[alone] = 0.0
    inverse = np.linalg.inv(np.where(alone[:, None, None], np.eye(6), own))
    # Of the largest load: another may be zero but for rounding, as a pull along a face is.
    bound = _TOLERANCE**2 * _products(rest, inverse @ rest).max()
    way, size = np.zeros(forces.shape), np.ones(forces.shape[2])
    for _ in range(_MOST_ITERATIONS):
        scaled = inverse @ rest
        now = _products(rest, scaled)
        if np.all(now <= bound):
            return solved
        way = scaled + now / np.maximum(size, _TINY) * way
        held = own @ way + rows @ way[neighbour].reshape(len(way), 24, -1)
        size, step = now, now / np.maximum(_products(way, held), _TINY)
        solved += step * way
        rest -= step * held
    raise InputError(
        f"the springs of a mesh must be solved within {_MOST_ITERATIONS} iterations, and are "
        f"not: is it made of bodies that hang on single bonds, or of very uneven size?"
    )


def _blocks(mesh, topology, springs):
    """Forces on each body by its own motion (bodies, 6, 6) and its neighbours' (bodies, 6, 24).

    And the body behind each local face, its own number where there is none: its block is zero.
    """
    _, centre, _ = body_properties(mesh, 1.0)
    corners = mesh.points[topology.vertices]
    sides = topology.master, topology.slave
    faces = topology.master_face, topology.slave_face
    maps = [levers(corners - centre[side][:, None]) for side in sides]
    area, law = face_laws(mesh.points, topology.vertices, springs)
    law = (area[:, None, None] / 3.0 * law)[:, None]
    count = mesh.body_count
    neighbour = np.tile(np.arange(count)[:, None], (1, 4))
    own, across = np.zeros((count, 6, 6)), np.zeros((count, 4, 6, 6))
    for here, there in ((0, 1), (1, 0)):
        body, face = sides[here], faces[here]
        neighbour[body, face] = sides[there]
        pulled = maps[here].swapaxes(2, 3) @ law
        across[body, face] = -(pulled @ maps[there]).sum(axis=1)
        np.add.at(own, body, (pulled @ maps[here]).sum(axis=1))
    return own, np.moveaxis(across, 1, 2).reshape(count, 6, 24), neighbour


def _products(one, other):
    """Inner products of two fields, one for each load."""
    return np.einsum("bkl,bkl->l", one, other)
