"""Materials of the bodies of a scene, and THE rule for bonds between two of them: ``joined``."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cached_property
from types import MappingProxyType
from typing import Any

import numpy as np

from taichi_dem.kit.errors import InputError
from taichi_dem.kit.validation import instance, shown
from taichi_dem.materials.bond_rules import (
    BondRule,
    ByMaterials,
    ContactRule,
    Density,
    bond_geometry,
    evaluated,
    joined_constants,
    per_bond,
)
from taichi_dem.materials.material import (
    REFUSE,
    RULES,
    SPARE,
    Material,
    check_energy,
    kept_energy,
    unchecked,
)
from taichi_dem.mesh.mesh import Mesh, element_sizes
from taichi_dem.mesh.topology import topology_of

#: Most different materials of a scene: tables on the device have a row for each ordered pair.
MOST = 16
_NONE: Mapping[str, Material] = MappingProxyType({})
#: Constants of which a bond or contact between two materials has the lesser one.
_LEAST = ("tensile_strength", "cohesion", "friction", "fracture_energy")


def joined(first: Material, second: Material) -> Material:
    """Constants of a bond, and of a contact, between two materials."""
    # Springs and dashpots in series, strengths the lesser ones; a shared constant keeps its bits.
    least = {name: min(getattr(first, name), getattr(second, name)) for name in _LEAST}
    series = {name: joined_constants(getattr(first, name), getattr(second, name)) for name in RULES}
    density = 0.5 * (first.density + second.density)
    wider = max(
        first, second, key=lambda material: (material.strength_spread, material.strength_volume)
    )
    spread = {name: getattr(wider, name) for name in ("strength_spread", "strength_volume")}
    return unchecked(first, density=density, **least, **series, **spread)


def _of_bonds(name) -> Any:
    """A constant of bonds per area, a number or a rule, as a property."""

    def found(laid):
        if laid.is_one:
            return getattr(laid.materials[0], name)
        rows = tuple(tuple(getattr(pair, name) for pair in row) for row in laid.pairs)
        return ByMaterials(rows, laid.of_body)

    return property(found)


class BodyMaterials:
    """Materials of the bodies of a mesh; NumPy only."""

    def __init__(self, mesh: Mesh, materials: tuple[Material, ...], of_body: np.ndarray):
        self.mesh, self.materials, self.of_body = mesh, materials, of_body

    @property
    def is_one(self) -> bool:
        """Whether all bodies have the same material."""
        return len(self.materials) == 1

    @cached_property
    def pairs(self) -> tuple[tuple[Material, ...], ...]:
        """Constants between materials a and b, entry a, b; contacts have numbers."""
        own = [self._on_mesh(k) for k in range(len(self.materials))]
        return tuple(
            tuple(first if first is second else joined(first, second) for second in own)
            for first in own
        )

    def _on_mesh(self, k):
        """Material k with the numbers that contacts of its bodies have."""
        material, bodies = self.materials[k], self.of_body == k
        numbers: dict[str, Any] = {}
        on_mesh = self.mesh, material.density, bodies
        for name, rule in vars(material).items():
            if isinstance(rule, ContactRule):
                numbers[name] = rule.of_mesh(*on_mesh)
            elif isinstance(rule, BondRule):
                numbers[name] = rule.on_mesh(*on_mesh)
        fitted = replace(material, **numbers) if numbers else material
        return fitted if material.coarse == REFUSE else self._weakened(fitted, bodies)

    def _weakened(self, material, bodies):
        """The material with a strength at which all bonds of some bodies keep their energy."""
        bonds = bond_geometry(self.mesh, topology_of(self.mesh), self.density)
        stiffness = evaluated((material.normal_stiffness,) * 2, bonds)[:, 0]
        stiffness = stiffness[bodies[bonds.bodies].any(axis=1)]
        return kept_energy(material, float(stiffness.min())) if len(stiffness) else material

    @property
    def weakened(self) -> tuple[str, ...]:
        """A sentence for each material whose strength was lowered for large elements."""
        own = [(self.materials[k], row[k], self.of_body == k) for k, row in enumerate(self.pairs)]
        return tuple(
            f"the tensile strength of {given.tensile_strength:.4g} Pa is lowered to "
            f"{material.tensile_strength:.3g} Pa, with which cracks through elements of up to "
            f"{element_sizes(self.mesh)[bodies].max():.3g} m keep the fracture energy of "
            f"{given.fracture_energy:.4g} J/m2"
            for given, material, bodies in own
            if material.tensile_strength < given.tensile_strength
        )

    @property
    def density(self) -> Density:
        """Density [kg/m3] of all bodies, or of each, (body_count,)."""
        if self.is_one:
            return self.materials[0].density
        return np.array([material.density for material in self.materials])[self.of_body]

    normal_stiffness = _of_bonds("normal_stiffness")
    shear_stiffness = _of_bonds("shear_stiffness")
    normal_damping = _of_bonds("normal_damping")
    shear_damping = _of_bonds("shear_damping")

    @property
    def has_bond_damping(self) -> bool:
        """Whether bonds of any material have dashpots."""
        return any(material.has_bond_damping for material in self.materials)

    @property
    def is_elastic(self) -> bool:
        """Whether bonds of all materials follow from moduli, as ``from_elastic`` makes them."""
        return all(isinstance(material.normal_stiffness, BondRule) for material in self.materials)

    @property
    def friction(self) -> float:
        """Largest friction coefficient."""
        return max(material.friction for material in self.materials)

    def largest(self, of: Callable[[Material], Any]) -> Any:
        """Largest value over the contacts of a body; of: one of a pair, for all bodies or each."""
        if self.is_one:
            return of(self.pairs[0][0])
        most = [np.max([of(pair) for pair in row], axis=0) for row in self.pairs]
        each = np.array([np.broadcast_to(value, self.of_body.shape) for value in most])
        return each[self.of_body, np.arange(len(self.of_body))]

    def checked_pairs(self) -> tuple[Material, ...]:
        """Every material and every pair in a bond, with the numbers of its softest bond."""
        # The larger the elements, the softer their bonds, and the more energy these hold at their
        # strength.
        springs = self.normal_stiffness, self.shear_stiffness
        if not any(isinstance(each, BondRule) for each in springs):
            return self.materials
        topology = topology_of(self.mesh)
        if not topology.bond_count:
            return self.materials
        bodies = np.stack([topology.master, topology.slave], axis=1)
        stiffness = per_bond(self.mesh, topology, self.density, springs)
        kinds = self.of_body[bodies]
        pairs = []
        for a, row in enumerate(self.pairs):
            for b, pair in enumerate(row):
                bonds = np.flatnonzero((kinds == (a, b)).all(axis=1))
                if len(bonds):
                    pairs.append(self._softest(pair, bonds, stiffness[bonds], topology, a != b))
        return tuple(pairs)

    def _softest(self, pair, bonds, stiffness, topology, mixed):
        """What joins some bonds with the least of their stiffnesses, its energy checked."""
        place = int(stiffness[:, 0].argmin())
        bond, normal, shear = bonds[place], stiffness[place, 0], stiffness[:, 1].min()
        numbers = {"normal_stiffness": float(normal), "shear_stiffness": float(shear)}
        softest = unchecked(pair, **numbers)
        distance = bond_geometry(self.mesh, topology, self.density).distance[bond]
        where = f" at bond {bond}, whose bodies are {distance:.4g} m apart"
        if mixed:
            where += " and of two materials, with the lesser strength and energy of both"
        check_energy(softest, where, self._remedy(softest))
        return softest

    def _remedy(self, softest):
        """Size of elements, and their number, with which a bond reaches its strength, in words."""
        share = softest.failure_opening / softest.onset_opening / SPARE
        size = share * float(element_sizes(self.mesh).max())
        count = self.mesh.body_count / share**3
        return (
            f": elements of at most {size:.2g} m would do, about {count:.2g} of them, or coarse="
            "'weaken' of Material.from_elastic, which lowers the strength"
        )


#: One material for all bodies, or those of each.
AnyMaterial = Material | BodyMaterials


def body_materials(mesh: Mesh, material: Any, by_group: Any = _NONE) -> BodyMaterials:
    """Materials of the bodies of a mesh."""
    instance("material", material, Material)
    mapped = isinstance(by_group, Mapping)
    if not mapped or not all(isinstance(given, Material) for given in by_group.values()):
        raise InputError(
            f"materials must be a dict of body group to Material, got {shown(by_group)}"
        )
    kinds, of_body = [material], np.zeros(mesh.body_count, dtype=np.int32)
    giver: dict[str, int] = {}
    for name, given in by_group.items():
        bodies = mesh.group_bodies(name)
        if given not in kinds:
            kinds.append(given)
        number = kinds.index(given)
        for other in (other for other, its in giver.items() if its != number):
            both = np.intersect1d(bodies, mesh.body_groups[other])
            if len(both):
                raise InputError(
                    f"materials must give each body one material, but body {both[0]} is in the "
                    f"groups {other} and {name}, which have different ones"
                )
        giver[name], of_body[bodies] = number, number
    if len(kinds) > MOST:
        raise InputError(f"materials must be at most {MOST} different ones, got {len(kinds)}")
    # Only materials that a body has; the default comes first where one is left with it.
    used, place = np.unique(of_body, return_inverse=True)
    return BodyMaterials(mesh, tuple(kinds[k] for k in used), place.reshape(-1).astype(np.int32))
