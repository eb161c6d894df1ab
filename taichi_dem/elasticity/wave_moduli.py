"""Stiffness of bonded bodies against waves, from their bonds and where these are (NumPy only)."""

from typing import Any

import numpy as np

from taichi_dem.elasticity.rates import levers
from taichi_dem.kit.fixed_order import dot, inverse, length, product, transposed
from taichi_dem.mesh.tetrahedra import area_vectors, signed_volumes, unit_normals

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


def wave_moduli(model: Any, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Moduli of waves that meet faces at right angles, two arrays (n,) [Pa].

    model: arrays of a scene, a ``Model``. faces: points of the faces, (n, 3). The first is that of
    compression, M = rho c_p^2, the second that of shear, G = rho c_s^2, a mean over its directions.
    Twice the energy per volume of the bodies around a face (two rings, half of each bond's) is M
    for the strain n n and G for (n t + t n) / 2, n the normal of the face and t its tangents.
    Bodies follow the strain (the mean-field estimate, as of R. J. Bathurst and L. Rothenburg, J.
    Appl. Mech. 55, 1988, 17-23), and then each gives way, where it has four bonds, by 0.7 of what
    would bring it to rest among its neighbours. That is a bound from above; of random tetrahedra it
    is 5 to 25 % above the modulus of a large block. NaN for a face without bonds around it.
    """
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


def _modulus(stiffness, normal, way):
    """Twice the energy per volume [Pa] of the strain (n w + w n) / 2."""
    outer = normal[:, :, None] * way[:, None, :]
    strain = np.stack([0.5 * (outer + transposed(outer))[:, a, b] for a, b in PAIRS], axis=1)
    strain[:, 3:] *= 2.0
    return dot(strain, product(stiffness, strain[:, :, None])[:, :, 0])


def _tangents(normal):
    """Two unit vectors at right angles to each normal, arrays (n, 3)."""
    axis = np.eye(3)[np.argmin(np.abs(normal), axis=1)]
    first = np.cross(normal, axis)
    first = first / length(first)[:, None]
    return first, np.cross(normal, first)


def _body_sums(model, bodies):
    """Twice the energy of each body by pairs of unit strains [J], and its volume, (n, 37).

    Half of that of its bonds, and a quarter of its volume for each; zero but for some bodies and
    their neighbours.
    """
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
    """Maps (2, n, 3, 3, 6) from the motion of both bodies to the opening of a bond's three units.

    And the laws of the units, (n, 1, 3, 3) [N/m].
    """
    corners = model.mesh.points[model.topology.vertices[bonds]]
    arms = (corners - model.centre[side][:, None] for side in links)
    maps = np.stack([sign * levers(each) for sign, each in zip((-1.0, 1.0), arms)])
    vector = area_vectors(model.mesh.points, model.topology.vertices[bonds])
    area = length(vector)
    normal = vector / area[:, None]
    bonded = area / 3.0 * model.topology.bonded_share[bonds]
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
    way = np.zeros((count, 6, 6))
    way[bodies] = -_STEP * product(inverse(block[bodies]), force[bodies])
    return sum(product(lever, way[side][:, None]) for lever, side in zip(maps, links))


def _bodies_at(tetrahedra, corners, point_count):
    """Bodies that have a point in common with one of some faces or bodies."""
    marks = np.zeros(point_count, dtype=bool)
    marks[corners] = True
    return np.flatnonzero(marks[tetrahedra].any(axis=1))
