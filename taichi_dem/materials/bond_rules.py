"""Constants of bonds and contacts from moduli and the size of the bodies (NumPy only)."""

from __future__ import annotations

import copy
import math
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from taichi_dem.kit.display import by_fields
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.fixed_order import dot, length
from taichi_dem.kit.validation import plain_fields, positive
from taichi_dem.mesh.mesh import Mesh, volumes
from taichi_dem.mesh.tetrahedra import all_faces, area_vectors
from taichi_dem.mesh.topology import Density, Topology, body_properties

#: Contact spheres that share the stiffness of a face: those of five divisions.
FACE_SPHERES = 6


@dataclass(frozen=True, eq=False)
class BondGeometry:
    """Sizes of bonds, arrays (bond_count,); distance: of the centres along the normal [m].

    pair_mass: m1 m2 / (m1 + m2) [kg]. master_share: share of the distance that lies in the master.
    """

    distance: np.ndarray
    area: np.ndarray
    pair_mass: np.ndarray
    master_share: np.ndarray
    bodies: np.ndarray


def bond_geometry(mesh: Mesh, topology: Topology, density: Density) -> BondGeometry:
    """Sizes of all bonds of a mesh; density [kg/m3]: of all bodies, or of each, (body_count,)."""
    mass, centre, _ = body_properties(mesh, density)
    vector = area_vectors(mesh.points, topology.vertices)
    area = length(vector)
    master, slave = topology.master, topology.slave
    distance = dot(centre[slave] - centre[master], vector) / area
    pair_mass = mass[master] * mass[slave] / (mass[master] + mass[slave])
    behind = dot(mesh.points[topology.vertices[:, 0]] - centre[master], vector) / area
    bodies = np.stack([master, slave], axis=1)
    return BondGeometry(distance, area, pair_mass, behind / distance, bodies)


def mirrored(mesh: Mesh, density: float, bodies: np.ndarray) -> BondGeometry:
    """Sizes of bonds of some bodies (n,), truth values, each with its mirror image at each face."""
    faces = all_faces(mesh.tetrahedra[bodies])
    area = length(area_vectors(mesh.points, faces)).reshape(-1, 4)
    volume = volumes(mesh)[bodies, None]
    # The centre is a quarter of the altitude 3 V / A away from a face.
    distance, mass = 2.0 * 0.75 * volume / area, 0.5 * density * volume + 0.0 * area
    return BondGeometry(distance, area, mass, 0.5 + 0.0 * area, np.zeros((0, 2), dtype=int))


class Rule:
    """Base of rules: a constant that depends on the sizes of the bodies.

    Derived classes are dataclasses. Raises InputError unless all their fields are positive numbers.
    """

    def __post_init__(self):
        plain_fields(self)
        for name, value in vars(self).items():
            positive(name, value)

    __repr__ = by_fields

    def __float__(self) -> float:
        raise InputError(
            f"this needs a material of constants per area, got {self}, which depends on the mesh"
        )


class BondRule(Rule):
    """Base of rules for a constant that each bond has of its own."""

    typical: ClassVar[float] = math.nan

    def on_mesh(self, mesh: Mesh, density: float, bodies: np.ndarray) -> BondRule:
        """The same rule with its typical value for some bodies of a mesh, (n,) truth values."""
        fitted = copy.copy(self)
        value = np.median(self.per_bond(mirrored(mesh, density, bodies)))
        object.__setattr__(fitted, "typical", float(value))
        return fitted

    def per_bond(self, bonds: BondGeometry) -> np.ndarray:
        """The constant of every bond, per area, (bond_count,)."""
        raise NotImplementedError


class ContactRule(Rule):
    """Base of rules for a constant of sphere contacts, one number for all bodies of a material."""

    def of_mesh(self, mesh: Mesh, density: float, bodies: np.ndarray) -> float:
        """The constant for some bodies of a mesh, (n,) truth values; density [kg/m3]."""
        raise NotImplementedError


@dataclass(frozen=True, repr=False)
class ModulusOverDistance(BondRule):
    """Stiffness of a bond per area [Pa/m]: a modulus [Pa] over the distance of the two bodies."""

    modulus: float

    def per_bond(self, bonds: BondGeometry) -> np.ndarray:
        """Stiffness of every bond per area [Pa/m], (bond_count,)."""
        return self.modulus / bonds.distance


@dataclass(frozen=True, repr=False)
class ShareOfCritical(BondRule):
    """Dashpot of a bond per area [Pa s/m], as a share of the critical one between its two bodies.

    2 ratio sqrt(k m / A), k = modulus / distance, mass m = m1 m2 / (m1 + m2), area A.
    """

    ratio: float
    modulus: float

    def per_bond(self, bonds: BondGeometry) -> np.ndarray:
        """Dashpot of every bond per area [Pa s/m], (bond_count,)."""
        stiffness = self.modulus / bonds.distance
        return 2.0 * self.ratio * np.sqrt(stiffness * bonds.pair_mass / bonds.area)


@dataclass(frozen=True, repr=False)
class FaceStiffness(ContactRule):
    """Stiffness of one sphere contact [N/m]: as stiff as a bond where a face's six spheres touch.

    The median over all faces of modulus area / (6 distance), twice that of face and body's centre.
    """

    modulus: float

    def of_mesh(self, mesh: Mesh, density: float, bodies: np.ndarray) -> float:
        """Stiffness of a contact of two bodies [N/m]."""
        bonds = mirrored(mesh, density, bodies)
        return float(np.median(self.modulus * bonds.area / bonds.distance)) / FACE_SPHERES


@dataclass(frozen=True, repr=False)
class ContactShareOfCritical(ContactRule):
    """Dashpot of one sphere contact [N s/m], as a share of the critical one."""

    ratio: float
    modulus: float

    def of_mesh(self, mesh: Mesh, density: float, bodies: np.ndarray) -> float:
        """Dashpot of a contact of two bodies [N s/m]."""
        stiffness = FaceStiffness(self.modulus).of_mesh(mesh, density, bodies)
        mass = 0.5 * density * float(np.median(volumes(mesh)[bodies]))
        return 2.0 * self.ratio * math.sqrt(stiffness * mass)


#: A number that holds for all bonds or contacts, or a rule.
Constant = float | Rule


@dataclass(frozen=True, repr=False)
class InSeries(BondRule):
    """Constant of a bond between two materials per area: both parts of its distance in series.

    A rule's part opens by its share of the distance over its k, a constant per area's by 1 / (2 k).
    """

    first: Constant
    second: Constant

    def __post_init__(self):
        """Both constants are those of a checked material."""

    def per_bond(self, bonds: BondGeometry) -> np.ndarray:
        """The constant of every bond per area, (bond_count,)."""
        first, second = (_of_bonds(each, bonds) for each in (self.first, self.second))
        share = bonds.master_share if isinstance(self.first, BondRule) else 0.5
        other = 1.0 - bonds.master_share if isinstance(self.second, BondRule) else 0.5
        return first * second / (share * second + other * first)


@dataclass(frozen=True, repr=False, eq=False)
class ByMaterials(BondRule):
    """Constant of a bond per area, by entry (a, b) of ``constants`` for materials a and b."""

    constants: tuple[tuple[Constant, ...], ...]
    of_body: np.ndarray

    def __post_init__(self):
        """All constants are those of a checked material."""

    def per_bond(self, bonds: BondGeometry) -> np.ndarray:
        """The constant of every bond per area, (bond_count,)."""
        kinds, values = self.of_body[bonds.bodies], np.zeros(len(bonds.area))
        for a, row in enumerate(self.constants):
            for b, constant in enumerate(row):
                chosen = (kinds == (a, b)).all(axis=1)
                if chosen.any():
                    values[chosen] = _of_bonds(constant, bonds)[chosen]
        return values


def joined_constants(first: Constant, second: Constant) -> Constant:
    """Constant of a bond or contact between two materials: one that both share stays to the bit."""
    if first == second:
        return first
    if isinstance(first, Rule) or isinstance(second, Rule):
        return InSeries(first, second)
    return 2.0 * first * second / (first + second)


def typical_of(constant: Constant) -> float:
    """A constant of bonds per area as one number, of a rule its typical one."""
    if isinstance(constant, InSeries):
        first, second = typical_of(constant.first), typical_of(constant.second)
        return 2.0 * first * second / (first + second)
    number: Any = constant.typical if isinstance(constant, BondRule) else constant
    return float(number)


def per_bond(
    mesh: Mesh, topology: Topology, density: Density, constants: tuple[Constant, Constant]
) -> np.ndarray:
    """Normal and tangential constant of every bond per area, (bond_count, 2)."""
    if not any(isinstance(constant, BondRule) for constant in constants):
        return np.tile(np.array(constants, dtype=float), (topology.bond_count, 1))
    return evaluated(constants, bond_geometry(mesh, topology, density))


def evaluated(constants: tuple[Constant, Constant], bonds: BondGeometry) -> np.ndarray:
    """Two constants, numbers or rules, for bonds of given sizes, (n, 2)."""
    return np.stack([_of_bonds(constant, bonds) for constant in constants], axis=1)


def _of_bonds(constant, bonds):
    """A constant, a number or a rule, of every bond, (n,)."""
    if isinstance(constant, BondRule):
        return constant.per_bond(bonds)
    return np.full(len(bonds.area), float(constant))
