"""Rates of each body of a mesh, which limit its step, and moduli of waves (NumPy only)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from taichi_dem.kit.fixed_order import (
    dot,
    inverse,
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
from taichi_dem.mesh.mesh import Mesh
from taichi_dem.mesh.tetrahedra import area_vectors, signed_volumes, unit_normals
from taichi_dem.mesh.topology import (
    Topology,
    body_properties,
    face_vertices,
    interior_crossings,
    spheres_of_faces,
)

#: Rings of bodies around a face over which its moduli are means.
_RINGS = 2
#: Share of the way to its own balance that each body goes where all go at once.
_STEP = 0.7
#: Unit strains, (6, 3, 3), and their components: those along x, y and z, then in yz, xz and xy.
PAIRS = ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))
STRAINS = np.zeros((6, 3, 3))
for _k, (_a, _b) in enumerate(PAIRS):
    STRAINS[_k, _a, _b] += 0.5
    STRAINS[_k, _b, _a] += 0.5


def dashpots_of(material: AnyMaterial) -> tuple[Constant, Constant]:
    """Normal and tangential dashpot per area of bonds [Pa s/m], numbers or rules."""
    return material.normal_damping, material.shear_damping


def springs_of(material: AnyMaterial) -> tuple[Constant, Constant]:
    """Normal and tangential stiffness per area of bonds [Pa/m], numbers or rules."""
    return material.normal_stiffness, material.shear_stiffness


def bond_rates(
    mesh: Mesh,
    topology: Topology,
    density: Density,
    coefficients: tuple[Constant, Constant],
    multiply: Any = product,
    bodies: np.ndarray | None = None,
) -> np.ndarray:
    """Largest eigenvalue of M^-1/2 G M^-1/2 of every body, shape (body_count,); else 0 for some."""
    # G: sum of (A / 3) J^T diag(normal, tangential) J over the contact units of all bonds, with
    # neighbours at rest (Konno et al., section 2.1); M: mass and inertia.
    return subset_rates(mesh, topology, density, coefficients, (15,), multiply, bodies)[:, 0]


def bond_bounds(
    mesh: Mesh, topology: Topology, density: Density, coefficients: tuple[Constant, Constant]
) -> np.ndarray:
    """Bound of ``bond_rates`` from above, the sum of all eigenvalues: in a fifth of the time."""
    mass, centre, inertia = body_properties(mesh, density)
    corners, normals, area = _faces(mesh, centre)
    laws = np.append(per_bond(mesh, topology, density, coefficients), [[0.0, 0.0]], axis=0)
    weights = area / 3.0 * np.moveaxis(laws[topology.body_bond], -1, 0)
    sums = _eigenvalue_sums(mass, inertia, corners, normals, *weights[..., None])
    return sums.sum(axis=1)


def subset_rates(
    mesh: Mesh,
    topology: Topology,
    density: Density,
    coefficients: tuple[Constant, Constant],
    subsets: Sequence[int] = range(16),
    multiply: Any = product,
    bodies: np.ndarray | None = None,
) -> np.ndarray:
    """``bond_rates`` with only some of a body's bonds intact, shape (body_count, len(subsets))."""
    chosen = np.arange(mesh.body_count) if bodies is None else bodies
    root, blocks = _roots_and_blocks(mesh, topology, density, coefficients, multiply, chosen)
    rates = np.zeros((mesh.body_count, len(subsets)))
    for part in parts_in_cache(len(chosen)):
        for column, subset in enumerate(subsets):
            intact = [face for face in range(4) if subset >> face & 1]
            total = blocks[part][:, intact].sum(axis=1)
            rates[chosen[part], column] = scaled_eigenvalues(root[part], total, multiply)
    return np.maximum(rates, 0.0)


def largest_bond_rate(
    mesh: Mesh, topology: Topology, density: Density, coefficients: tuple[Constant, Constant]
) -> float:
    """Largest of ``bond_rates``, in a tenth of the time."""
    return float(bond_rates(mesh, topology, density, coefficients, np.matmul).max())


def _roots_and_blocks(mesh, topology, density, coefficients, multiply, bodies):
    """``inverse_root`` of bodies, (n, 6, 6), and the blocks of their four bonds, (n, 4, 6, 6)."""
    mass, centre, inertia = (of_all[bodies] for of_all in body_properties(mesh, density))
    bonds = topology.body_bond[bodies]
    row, face = np.nonzero(bonds >= 0)
    laws = per_bond(mesh, topology, density, coefficients)[bonds[row, face]]
    blocks = np.zeros((len(bodies), 4, 6, 6))
    vertices = face_vertices(mesh, bodies[row], face)
    area, law = face_laws(mesh.points, vertices, laws)
    arms = mesh.points[vertices] - centre[row][:, None]
    blocks[row, face] = area[:, None, None] / 3.0 * point_blocks(arms, law, multiply)
    return inverse_root(mass, inertia), blocks


def face_laws(
    points: np.ndarray, faces: np.ndarray, coefficients: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Areas [m^2] of faces, and what resists a velocity there per area: (n,) and (n, 3, 3)."""
    vector = geometry.area_vectors(points, faces)
    area = length(vector)
    normal = vector / area[:, None]
    normally, across = coefficients[:, 0, None, None], coefficients[:, 1, None, None]
    along = normal[:, :, None] * normal[:, None, :]
    return area, across * np.eye(3) + (normally - across) * along


def _faces(mesh, centre):
    """Corners from the centre of each body (n, 4, 3, 3) [m], normals and areas of its faces."""
    faces = geometry.all_faces(mesh.tetrahedra)
    vector = area_vectors(mesh.points, faces).reshape(-1, 4, 3)
    area = length(vector)
    corners = mesh.points[faces].reshape(-1, 4, 3, 3) - centre[:, None, None]
    return corners, vector / area[..., None], area


def _eigenvalue_sums(mass, inertia, arms, normals, normally, across):
    """Sum of the eigenvalues that points of each face give its body, (n, 4).

    arms: of the points (n, 4, k, 3). normally, across: what resists a velocity there, along the
    normal of the face and along each tangent.
    """
    slack, ease = 1.0 / mass[:, None, None], inverse(inertia)[:, None]
    turn = np.cross(arms, normals[:, :, None])
    along = slack + dot(turn, turn @ ease)
    whole = np.trace(ease, axis1=2, axis2=3)[..., None]
    both = 3.0 * slack + dot(arms, arms) * whole - dot(arms, arms @ ease)
    return (normally * along + across * (both - along)).sum(axis=2)


def contact_bounds(mesh: Mesh, density: Density, divisions: int, friction: bool) -> np.ndarray:
    """Bound of ``contact_eigenvalues`` from above, the sum of all eigenvalues."""
    mass, centre, inertia = body_properties(mesh, density)
    corners, normals, _ = _faces(mesh, centre)
    points = interior_crossings(divisions) @ corners
    return _eigenvalue_sums(mass, inertia, points, normals, 1.0, float(friction)).max(axis=1)


def contact_eigenvalues(
    mesh: Mesh,
    density: Density,
    divisions: int,
    friction: bool,
    multiply: Any = product,
    bodies: np.ndarray | None = None,
) -> np.ndarray:
    """Largest eigenvalue of M^-1/2 (J^T D J) M^-1/2 of each body [1/kg], (n,); else 0 for some."""
    chosen = np.arange(mesh.body_count) if bodies is None else bodies
    largest = np.zeros(mesh.body_count)
    if not len(chosen):
        return largest
    mass, centre, inertia = body_properties(mesh, density)
    spheres = spheres_of_faces(mesh, centre, divisions)
    root = inverse_root(mass[chosen], inertia[chosen])
    faces = geometry.all_faces(mesh.tetrahedra)
    normals = geometry.unit_normals(mesh.points, faces).reshape(-1, 4, 3)
    for face in range(4):
        outward, radius = normals[chosen, face], spheres.radius[chosen, face, :, None]
        arms = spheres.centre[chosen, face] + radius * outward[:, None]
        along = outward[:, :, None] * outward[:, None, :]
        law = np.broadcast_to(np.eye(3), along.shape) if friction else along
        blocks = point_blocks(arms, law, multiply)
        found = scaled_eigenvalues(root, blocks, multiply)
        largest[chosen] = np.maximum(largest[chosen], found)
    return largest


def point_blocks(arms: np.ndarray, law: np.ndarray, multiply: Any = product) -> np.ndarray:
    """Sum over points of J^T law J, J the map from (velocity, spin) to the point's velocity."""
    blocks = np.empty((len(arms), 6, 6))
    for part in parts_in_cache(len(arms)):
        lever = levers(arms[part])
        blocks[part] = multiply(transposed(lever), multiply(law[part, None], lever)).sum(axis=1)
    return blocks


def levers(arms: np.ndarray) -> np.ndarray:
    """Maps J from (velocity, spin) to the velocity of points at arms (..., 3), (..., 3, 6)."""
    matrices = np.zeros((*arms.shape, 6))
    matrices[..., :3] = np.eye(3)
    x, y, z = np.moveaxis(arms, -1, 0)
    for row, column, part in ((0, 1, z), (1, 2, x), (2, 0, y)):
        matrices[..., row, 3 + column], matrices[..., column, 3 + row] = part, -part
    return matrices


def scaled_eigenvalues(root: np.ndarray, blocks: np.ndarray, multiply: Any = product) -> np.ndarray:
    """Largest eigenvalue of root G root^T for every 6x6 block G, shape (n,)."""
    if multiply is not product:
        return np.linalg.eigvalsh(root @ blocks @ transposed(root))[:, -1]
    return largest_eigenvalues(product(root, product(blocks, transposed(root))))


def inverse_root(mass: np.ndarray, inertia: np.ndarray) -> np.ndarray:
    """W with W^T W = M^-1 of M = diag(mass, mass, mass, inertia), shape (n, 6, 6)."""
    root = np.zeros((len(mass), 6, 6))
    root[:, :3, :3] = np.eye(3) / np.sqrt(mass)[:, None, None]
    root[:, 3:, 3:] = inverse_factor(inertia)
    return root


def wave_moduli(model: Any, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Moduli of waves that meet faces at right angles, two arrays (n,) [Pa]."""
    # Mean field (R. J. Bathurst and L. Rothenburg, J. Appl. Mech. 55, 1988, 17-23), relaxed by 0.7
    # of a step to equilibrium: a bound from above, 5 to 25 % over the modulus of a large block.
    mesh, count = model.mesh, len(model.mesh.points)
    rings = [_bodies_at(mesh.tetrahedra, faces, count)]
    for _ in range(_RINGS):
        rings.append(_bodies_at(mesh.tetrahedra, mesh.tetrahedra[rings[-1]], count))
    sums = _body_sums(model, rings[-1])
    for bodies in rings[_RINGS - 1 :: -1]:
        corners = mesh.tetrahedra[bodies]
        at_points = np.zeros((count, sums.shape[1]))
        np.add.at(at_points, corners.ravel(), np.repeat(sums[bodies], 4, axis=0))
        sums[bodies] = sum(at_points[corners[:, k]] for k in range(4))
    around = sum(at_points[faces[:, k]] for k in range(3))
    around[around[:, -1] == 0.0] = np.nan
    mean = (around[:, :-1] / around[:, -1:]).reshape(-1, 6, 6)
    normal = unit_normals(mesh.points, faces)
    shear = sum(_modulus(mean, normal, tangent) for tangent in _tangents(normal))
    return _modulus(mean, normal, normal), 0.5 * shear


def _modulus(stiffness, normal, direction):
    """Twice the energy per volume [Pa] of the strain (n w + w n) / 2."""
    outer = normal[:, :, None] * direction[:, None, :]
    strain = np.stack([0.5 * (outer + transposed(outer))[:, a, b] for a, b in PAIRS], axis=1)
    strain[:, 3:] *= 2.0
    return dot(strain, product(stiffness, strain[:, :, None])[:, :, 0])


def _tangents(normal):
    axis = np.eye(3)[np.argmin(np.abs(normal), axis=1)]
    first = np.cross(normal, axis)
    first = first / length(first)[:, None]
    return first, np.cross(normal, first)


def _body_sums(model, bodies):
    """Twice the energy of each body by pairs of unit strains [J], and its volume, (n, 37)."""
    top = model.topology
    chosen = np.zeros(model.body_count, dtype=bool)
    chosen[bodies] = True
    bonds = np.flatnonzero(chosen[top.master] | chosen[top.slave])
    links = np.stack([top.master[bonds], top.slave[bonds]])
    maps, laws = _openings(model, bonds, links)
    opening = product(
        STRAINS[None], (model.centre[links[1]] - model.centre[links[0]])[:, None, :, None]
    )
    opening = np.repeat(transposed(opening[..., 0])[:, None], 3, axis=1)
    givers = bodies[(top.body_bond[bodies] >= 0).all(axis=1)]
    opening = opening + _given_way(maps, laws, links, opening, givers)
    energy = product(transposed(opening), product(laws, opening)).sum(axis=1).reshape(-1, 36)
    volume = signed_volumes(model.mesh.points, model.mesh.tetrahedra)
    sums = np.zeros((model.body_count, 37))
    for side in links:
        np.add.at(sums, side, np.column_stack([0.5 * energy, 0.25 * volume[side]]))
    return sums


def _openings(model, bonds, links):
    """Maps (2, n, 3, 3, 6) from motions of both bodies to openings of a bond's three units."""
    corners = model.mesh.points[model.topology.vertices[bonds]]
    arms = (corners - model.centre[side][:, None] for side in links)
    maps = np.stack([sign * levers(each) for sign, each in zip((-1.0, 1.0), arms)])
    vector = area_vectors(model.mesh.points, model.topology.vertices[bonds])
    area = length(vector)
    normal = vector / area[:, None]
    bonded = model.bonds["area"][bonds]
    out = normal[:, :, None] * normal[:, None, :]
    along, across = (model.bond_stiffness[bonds, k][:, None, None] for k in range(2))
    law = along * out + across * (np.eye(3) - out)
    return maps, (bonded[:, None, None] * law)[:, None]


def _given_way(maps, laws, links, opening, bodies):
    """Opening (n, 3, 3, 6) that some bodies add as each goes towards its own balance."""
    count = links.max(initial=-1) + 1
    force, block = np.zeros((count, 6, 6)), np.zeros((count, 6, 6))
    for lever, side in zip(maps, links):
        pulled = product(transposed(lever), laws)
        np.add.at(force, side, product(pulled, opening).sum(axis=1))
        np.add.at(block, side, product(pulled, lever).sum(axis=1))
    motions = np.zeros((count, 6, 6))
    motions[bodies] = -_STEP * product(inverse(block[bodies]), force[bodies])
    return sum(product(lever, motions[side][:, None]) for lever, side in zip(maps, links))


def _bodies_at(tetrahedra, corners, point_count):
    """Bodies that have a point in common with one of some faces or bodies."""
    marks = np.zeros(point_count, dtype=bool)
    marks[corners] = True
    return np.flatnonzero(marks[tetrahedra].any(axis=1))
