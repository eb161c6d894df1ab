"""Rates of each body of a mesh: how fast its bonds or contacts answer, which limits its step."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from taichi_dem.kit.fixed_order import (
    inverse_factor,
    largest_eigenvalues,
    length,
    parts_in_cache,
    product,
    transposed,
)
from taichi_dem.materials.body_materials import AnyMaterial
from taichi_dem.materials.bond_rules import Constant, Density, per_bond
from taichi_dem.mesh import tetrahedra as geometry
from taichi_dem.mesh.contact_spheres import spheres_of_faces
from taichi_dem.mesh.mesh import Mesh
from taichi_dem.mesh.topology import Topology, body_properties, face_vertices


def dashpots_of(material: AnyMaterial) -> tuple[Constant, Constant]:
    """Normal and tangential dashpot per area of bonds [Pa s/m], numbers or rules."""
    return material.normal_damping, material.shear_damping


def springs_of(material: AnyMaterial) -> tuple[Constant, Constant]:
    """Normal and tangential stiffness per area of bonds [Pa/m], numbers or rules."""
    return material.normal_stiffness, material.shear_stiffness


def bond_rates(
    mesh: Mesh, topology: Topology, density: Density, coefficients: tuple[Constant, Constant]
) -> np.ndarray:
    """Largest eigenvalue of M^-1/2 G M^-1/2 of every body, shape (body_count,).

    G is the 6x6 block with which the bonds of a body resist its velocity and spin when the
    neighbours stand still: the sum of (A / 3) J^T diag(normal, tangential) J over the three
    contact units of each bonded face, J the map from (velocity, spin) to the velocity at the
    vertex (Konno et al., section 2.1, units at the vertices).  M holds mass and inertia.
    coefficients: normal and tangential coefficient per area, numbers or rules (``springs_of``);
    [Pa s/m] gives rates [1/s], [Pa/m] gives squared angular frequencies [1/s2].
    """
    return subset_rates(mesh, topology, density, coefficients, subsets=(15,))[:, 0]


def subset_rates(
    mesh: Mesh,
    topology: Topology,
    density: Density,
    coefficients: tuple[Constant, Constant],
    subsets: Sequence[int] = range(16),
) -> np.ndarray:
    """``bond_rates`` with only some of a body's bonds intact, shape (body_count, len(subsets)).

    subsets: bit f of each stands for the bond at local face f; the default is all sixteen.
    """
    mass, centre, inertia = body_properties(mesh, density)
    body, face = np.nonzero(topology.body_bond >= 0)
    laws = per_bond(mesh, topology, density, coefficients)[topology.body_bond[body, face]]
    blocks = np.zeros((mesh.body_count, 4, 6, 6))
    vertices = face_vertices(mesh, body, face)
    area, law = face_laws(mesh.points, vertices, laws)
    arms = mesh.points[vertices] - centre[body][:, None]
    blocks[body, face] = area[:, None, None] / 3.0 * point_blocks(arms, law)
    root = inverse_root(mass, inertia)
    rates = np.zeros((mesh.body_count, len(subsets)))
    for part in parts_in_cache(mesh.body_count):
        for column, subset in enumerate(subsets):
            intact = [face for face in range(4) if subset >> face & 1]
            total = blocks[part][:, intact].sum(axis=1)
            rates[part, column] = scaled_eigenvalues(root[part], total)
    return np.maximum(rates, 0.0)


def face_laws(
    points: np.ndarray, faces: np.ndarray, coefficients: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Areas [m^2] of faces, and what resists a velocity there per area: (n,) and (n, 3, 3).

    faces: point indices, (n, 3). coefficients: normal and tangential one of each, (n, 2).
    """
    vector = geometry.area_vectors(points, faces)
    area = length(vector)
    normal = vector / area[:, None]
    normally, across = coefficients[:, 0, None, None], coefficients[:, 1, None, None]
    along = normal[:, :, None] * normal[:, None, :]
    return area, across * np.eye(3) + (normally - across) * along


def contact_eigenvalues(
    mesh: Mesh, density: Density, divisions: int, friction: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Largest eigenvalues of M^-1/2 (J^T D J) M^-1/2 of each body [1/kg], two arrays (n,).

    The first is for the worst of its spheres in contact, the second for all of the worst face. D is
    the identity with friction, n n^T without; contacts act where a sphere touches its face. The
    step finds the same from the near contacts (``stability/contact_limits.py``).
    """
    mass, centre, inertia = body_properties(mesh, density)
    spheres = spheres_of_faces(mesh, centre, divisions)
    root = inverse_root(mass, inertia)
    one, whole_face = np.zeros(len(mass)), np.zeros(len(mass))
    faces = geometry.all_faces(mesh.tetrahedra)
    normals = geometry.unit_normals(mesh.points, faces).reshape(-1, 4, 3)
    for face in range(4):
        outward = normals[:, face]
        arms = spheres.centre[:, face] + spheres.radius[:, face, :, None] * outward[:, None]
        along = outward[:, :, None] * outward[:, None, :]
        law = np.broadcast_to(np.eye(3), along.shape) if friction else along
        found = scaled_eigenvalues(root, point_blocks(arms, law))
        whole_face = np.maximum(whole_face, found)
        for k in range(spheres.per_face):
            found = scaled_eigenvalues(root, point_blocks(arms[:, k : k + 1], law))
            one = np.maximum(one, found)
    return one, whole_face


def point_blocks(arms: np.ndarray, law: np.ndarray) -> np.ndarray:
    """Sum over points of J^T law J, J the map from (velocity, spin) to the point's velocity.

    arms: points from the centre [m], shape (n, points, 3). law: what resists their velocity,
    shape (n, 3, 3). Returns (n, 6, 6).
    """
    lever = levers(arms)
    return product(transposed(lever), product(law[:, None], lever)).sum(axis=1)


def levers(arms: np.ndarray) -> np.ndarray:
    """Maps J from (velocity, spin) to the velocity of points at arms (..., 3), (..., 3, 6)."""
    made = np.zeros((*arms.shape, 6))
    made[..., :3] = np.eye(3)
    x, y, z = np.moveaxis(arms, -1, 0)
    for row, column, part in ((0, 1, z), (1, 2, x), (2, 0, y)):
        made[..., row, 3 + column], made[..., column, 3 + row] = part, -part
    return made


def scaled_eigenvalues(root: np.ndarray, blocks: np.ndarray) -> np.ndarray:
    """Largest eigenvalue of root G root^T for every 6x6 block G, shape (n,)."""
    return largest_eigenvalues(product(root, product(blocks, transposed(root))))


def inverse_root(mass: np.ndarray, inertia: np.ndarray) -> np.ndarray:
    """W with W^T W = M^-1 of M = diag(mass, mass, mass, inertia), shape (n, 6, 6).

    W G W^T has the eigenvalues of M^-1/2 G M^-1/2.
    """
    root = np.zeros((len(mass), 6, 6))
    root[:, :3, :3] = np.eye(3) / np.sqrt(mass)[:, None, None]
    root[:, 3:, 3:] = inverse_factor(inertia)
    return root
