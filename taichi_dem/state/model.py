"""Constants of a scene as arrays: bodies, bonds and contact spheres."""

import copy
import math
from collections.abc import Callable, Iterable
from functools import cached_property
from typing import Any

import numpy as np

from taichi_dem.elasticity.rates import dashpots_of, springs_of, subset_rates
from taichi_dem.kit.fixed_order import length, product, transposed
from taichi_dem.materials import Material
from taichi_dem.materials.body_materials import AnyMaterial, BodyMaterials, body_materials
from taichi_dem.materials.bond_rules import per_bond
from taichi_dem.materials.material import harmless
from taichi_dem.mesh.mesh import Mesh
from taichi_dem.mesh.tetrahedra import area_vectors, components
from taichi_dem.mesh.topology import (
    ContactSpheres,
    body_properties,
    edge_colours,
    spheres_of_faces,
    topology_of,
)

#: Roles that take one effect, in the order in which effects are listed, bound and reported.
SINGLE = ("bond", "tension", "shear", "dashpot", "friction", "contact")
#: Roles that take any number.
MANY = ("load", "support", "ground")
ROLES = (*SINGLE, *MANY)


def names_of(effects: Iterable[Any]) -> list[str]:
    """Name of each effect in reports, tables and pictures: its kind, and the group it acts on."""
    # Two effects of one kind and group must differ as columns of a table: the later one is
    # numbered.
    names: list[str] = []
    taken = {""}
    for effect in effects:
        word = name = f"{effect.name} {getattr(effect, 'group', '')}".rstrip() * bool(effect.name)
        number = 1
        while name and column_of(name) in taken:
            number += 1
            name = f"{word} {number}"
        names.append(name)
        taken.add(column_of(name))
    return names


def column_of(name: str) -> str:
    """Name of an effect as the first part of that of a column."""
    return name.replace(" ", "_")


class Model:
    """Constant arrays of a scene and its effects by role; NumPy only (Konno et al., section 2).

    material: the first of the bodies' materials, with the numbers that its contacts have in the
    mesh. body_mass [kg], centre [m], body_inertia [kg m^2], body_radius [m] of the ball around a
    body. stress: at the start, a matrix (3, 3) [Pa], or None. strength: of each bond over the
    material's, (bond_count,), or None for one of all: a law sees it as a share of the area that
    bears the whole stiffness, so that strengths and energies have the factor and openings none.
    """

    def __init__(
        self,
        mesh: Mesh,
        material: AnyMaterial,
        effects: Iterable[Any],
        stress: np.ndarray | None = None,
        strength: np.ndarray | None = None,
    ):
        self.stress, self.strength = stress, strength
        if not isinstance(material, BodyMaterials):
            material = body_materials(mesh, material)
        self.mesh, self.materials = mesh, material
        self.material = self.materials.pairs[0][0]
        self.topology = topology_of(mesh)
        self.body_count, self.bond_count = mesh.body_count, self.topology.bond_count
        self.body_mass, self.centre, self.body_inertia = body_properties(
            mesh, self.materials.density
        )
        corners = mesh.points[mesh.tetrahedra] - self.centre[:, None]
        self.body_radius = length(corners).max(axis=1)
        self.by_role = {role: [e for e in effects if e.role == role] for role in ROLES}
        self.loads, self.supports, self.ground = (tuple(self.by_role[role]) for role in MANY)
        self.contact: Any = next(iter(self.by_role["contact"]), None)
        self.has_contact = self.contact is not None
        self.geometry: Any = self.contact.geometry if self.has_contact else None
        self.holes: dict[str, Any] = {}

    def harmless(self) -> "Model":
        """A copy with the materials with which silent effects never act."""
        copied = copy.copy(self)
        laid = self.materials
        changed = tuple(map(harmless, laid.materials))
        copied.materials = BodyMaterials(laid.mesh, changed, laid.of_body)
        copied.material = copied.materials.pairs[0][0]
        return copied

    def of_bonds(self, value: Callable[[Material], float]) -> Any:
        """A number of what joins the bodies of each bond, an array (n,), or one for all."""
        if self.materials.is_one:
            return value(self.material)
        table = np.array([[value(pair) for pair in row] for row in self.materials.pairs])
        kinds, top = self.materials.of_body, self.topology
        return table[kinds[top.master], kinds[top.slave]]

    @property
    def effects(self) -> tuple:
        """All effects in the order of roles; those of one role in that of the scene."""
        return tuple(effect for role in ROLES for effect in self.by_role[role])

    @cached_property
    def spheres(self) -> ContactSpheres:
        """``ContactSpheres`` of every face; with contact only."""
        return spheres_of_faces(self.mesh, self.centre, self.geometry.divisions)

    @cached_property
    def dashpot_rates(self) -> np.ndarray:
        """Rate of the dashpots of every body for each subset of its bonds [1/s], (n, 16)."""
        silent = any(effect.is_silent for effect in self.by_role["dashpot"])
        acting = self.harmless() if silent else self
        return self._subset_rates(dashpots_of(acting.materials))

    @cached_property
    def spring_rates(self) -> np.ndarray:
        """Squared angular frequency of the springs of every body likewise [1/s2], (n, 16)."""
        return self._subset_rates(springs_of(self.materials))

    def _subset_rates(self, coefficients):
        return subset_rates(self.mesh, self.topology, self.materials.density, coefficients)

    @cached_property
    def neighbours(self) -> np.ndarray:
        """Body behind each local face of every body, -1 where it is outer, (body_count, 4)."""
        top = self.topology
        both = np.append(top.master + top.slave, 0)[top.body_bond]
        return np.where(top.body_bond < 0, -1, both - np.arange(self.body_count)[:, None])

    def pieces(self, broken: np.ndarray) -> np.ndarray:
        """First body of each body's piece, which unbroken bonds keep together, (body_count,)."""
        ends = np.column_stack([self.topology.master, self.topology.slave])
        return components(self.body_count, ends[~broken])

    @cached_property
    def bond_colours(self) -> np.ndarray:
        """Colour of every bond, (n,): bonds of one colour share no body."""
        links = np.stack([self.topology.master, self.topology.slave], axis=1)
        return edge_colours(links, self.body_count)

    @cached_property
    def bonds(self) -> dict[str, np.ndarray]:
        """Arrays of all bonds by name."""
        top, points = self.topology, self.mesh.points
        slots = np.stack([4 * top.master + top.master_face, 4 * top.slave + top.slave_face], axis=1)
        corners = points[top.vertices]
        area = area_vectors(points, top.vertices)
        size = length(area)
        xi = corners[:, 1] - corners[:, 0]
        xi /= length(xi)[:, None]
        normal = area / size[:, None]
        frame = np.stack([normal, xi, np.cross(normal, xi)], axis=1)
        from_master = corners - self.centre[top.master][:, None]
        unit_area = size / 3.0 * top.bonded_share
        return {
            "slots": slots.astype(np.int32),
            "frame": frame,
            "area": unit_area if self.strength is None else unit_area * self.strength,
            "on_master": product(from_master, transposed(frame)),
            "on_slave": corners - self.centre[top.slave][:, None],
        }

    @property
    def bond_stiffness(self) -> np.ndarray:
        """Normal and shear stiffness of every bond per bearing area [Pa/m], (bond_count, 2)."""
        return self._per_bond(springs_of(self.materials))

    @property
    def bond_damping(self) -> np.ndarray:
        """Normal and shear dashpot of every bond per area [Pa s/m], (bond_count, 2)."""
        return self._per_bond(dashpots_of(self.materials))

    @property
    def start_tractions(self) -> np.ndarray:
        """Tractions of the stress at the start in the face frame [Pa], (bond_count, 3).

        Those of the bonded area, which bears the whole face.
        """
        frame, top = self.bonds["frame"], self.topology
        pull = product(frame, (frame[:, 0] @ self.stress)[:, :, None])[:, :, 0]
        share = top.bonded_share if self.strength is None else top.bonded_share * self.strength
        return pull / share[:, None]

    @property
    def start_openings(self) -> np.ndarray:
        """Openings of all bonds that make these tractions [m], (bond_count, 3)."""
        return self.start_tractions / self.bond_stiffness[:, [0, 1, 1]]

    def _per_bond(self, constants):
        numbers = per_bond(self.mesh, self.topology, self.materials.density, constants)
        return numbers if self.strength is None else numbers / self.strength[:, None]


def sums(group: np.ndarray, of_members: np.ndarray, count: int = 0) -> np.ndarray:
    """Sums over groups of an array of each member; group: number of that of each member."""
    flat = of_members.reshape(len(of_members), math.prod(of_members.shape[1:]))
    columns = [np.bincount(group, column, count) for column in flat.T]
    # Of no members NumPy makes whole numbers.
    return np.stack(columns, axis=1).reshape(-1, *of_members.shape[1:]).astype(np.float64)


def centres(group: np.ndarray, body_mass: np.ndarray, position: np.ndarray) -> np.ndarray:
    """Centres of mass of groups of bodies [m], (groups, 3); position (body_count, 3) [m]."""
    return sums(group, body_mass[:, None] * position) / sums(group, body_mass)[:, None]
