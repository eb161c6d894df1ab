"""Capacity of an engine, its constant tables of a scene as fields, and the bound effects."""

from typing import Any, NamedTuple

import taichi as ti

from taichi_dem.kit.allocation import assign
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.fixed_order import inverse
from taichi_dem.kit.types import real
from taichi_dem.materials.body_materials import MOST
from taichi_dem.state.model import MANY, ROLES, Model

#: One more entry: no list of pairs may be as long as a field of bodies, faces or bonds.
_SPARE = 1
#: Entries of one list, whose indices are counted in 32 bits.
_MOST_ENTRIES = 2**31 - 1


class Capacity(NamedTuple):
    """Room of an engine: bodies, contact spheres on a face, entries of the lists of contact.

    pairs of bodies that are near, contacts: entries of these pairs, neighbours; 0 without contact.
    """

    bodies: int
    face_spheres: int = 0
    pairs: int = 0
    contacts: int = 0
    neighbours: int = 0

    @property
    def faces(self) -> int:
        """Faces of all bodies."""
        return 4 * self.bodies

    @property
    def bonds(self) -> int:
        """Bonds: each takes two of the four faces of a body."""
        return 2 * self.bodies

    @property
    def units(self) -> int:
        """Contact units of all bonds."""
        return 3 * self.bonds

    @property
    def spheres(self) -> int:
        """Contact spheres on all faces."""
        return self.faces * self.face_spheres

    @property
    def pair_entries(self) -> int:
        """Length of a list of pairs."""
        return self.pairs + _SPARE

    @property
    def contact_entries(self) -> int:
        """Length of a list of contacts."""
        return self.contacts + _SPARE

    @property
    def neighbour_entries(self) -> int:
        """Length of a list of neighbours."""
        return self.neighbours + _SPARE

    def check(self) -> None:
        """Raise InputError where a list would have more entries than can be counted."""
        largest = max(9 * self.bonds, self.spheres, 2 * self.pair_entries, self.contact_entries)
        if max(largest, self.neighbour_entries) > _MOST_ENTRIES:
            raise InputError(
                f"lists must have at most {_MOST_ENTRIES} entries, a mesh of {self.bodies} bodies "
                "with its contacts has more: take a smaller mesh"
            )


def capacity_of(model: Model) -> Capacity:
    """Capacity with which a ``Model`` begins; the lists of contact grow (``Simulation``)."""
    if not model.has_contact:
        return Capacity(model.body_count)
    lists = (int(share * model.body_count) for share in model.geometry.at_start)
    return Capacity(model.body_count, model.geometry.face_spheres, *lists)


#: Smallest engine: in it the paper's block can fall to pieces.
LEAST = Capacity(1024, 6, 2**14, 2**16, 2**16)


@ti.data_oriented
class Tables:
    """Device side of a ``Model``, which kernels only read; body frames are world axes at the start.

    bond_slots: faces of a bond as 4 * body + local face, master first; bond_frame: rows normal, xi,
    eta in the master's body frame; vertex_master (face frame), vertex_slave (body frame) [m]: an
    entry a contact unit. neighbour, face_bond: behind local face f of a body, entry 4 * body + f,
    or -1. bond_pair: row of a bond's materials in the table of a law. extent: within which
    all of a body lies that can touch [m]. on_demand: laws are evaluated only where they act.
    """

    constant_fields = (
        *("body_count", "bond_count", "mass", "mass_inverse", "radius", "extent", "inertia"),
        *("inertia_inverse", "bond_slots", "bond_frame", "bond_stiffness", "unit_area"),
        *("vertex_master", "vertex_slave", "neighbour", "face_bond", "material"),
        *("face_spheres", "bond_pair"),
    )

    # Bound effects by role; null objects where the scene lists none, contact is None then.
    bond: Any
    dashpot: Any
    friction: Any
    contact: Any
    geometry: Any

    def __init__(self, capacity: Capacity, on_demand: bool = False):
        self.capacity, self.on_demand = capacity, on_demand
        self.body_count, self.bond_count = (ti.field(ti.i32, shape=()) for _ in range(2))
        self._declare_bodies(capacity.bodies)
        self._declare_bonds(capacity)

    def take(self, by_role: dict[str, list[Any]], bond: object, geometry: object) -> None:
        """Take the effects bound to the tables, by role, law of bonds and geometry of contact."""
        self.bond, self.geometry = bond, geometry
        self.dashpot, self.friction = by_role["dashpot"][0], by_role["friction"][0]
        self.contact = by_role["contact"][0] if by_role["contact"] else None
        self.loads, self.supports, self.ground = (tuple(by_role[role]) for role in MANY)
        self.effects = tuple(effect for role in ROLES for effect in by_role[role])
        self.has_contact = self.contact is not None
        if self.has_contact:
            self.effects = (*self.effects, geometry)
            self.face_spheres = ti.field(ti.i32, shape=())
            self.extent = ti.field(real, shape=self.capacity.bodies)

    @property
    def drives(self) -> tuple[tuple[Any, int, int, int], ...]:
        """Loads and ground with the row of their impulse, account of work, and bit of activity."""
        loads, held = len(self.loads), len(self.supports)
        drives = [(effect, e, e, e) for e, effect in enumerate(self.loads)]
        for row, effect in enumerate(self.ground, loads):
            drives.append((effect, row, 1 + row, held + row))
        return tuple(drives)

    def _declare_bodies(self, n):
        self.mass, self.mass_inverse, self.radius = (ti.field(real, shape=n) for _ in range(3))
        self.material = ti.field(ti.i32, shape=n)
        self.inertia = ti.Matrix.field(3, 3, real, shape=n)
        self.inertia_inverse = ti.Matrix.field(3, 3, real, shape=n)

    def _declare_bonds(self, capacity):
        bonds, units = capacity.bonds, capacity.units
        self.bond_slots = ti.Vector.field(2, ti.i32, shape=bonds)
        self.bond_frame = ti.Matrix.field(3, 3, real, shape=bonds)
        self.bond_stiffness = ti.Vector.field(2, real, shape=bonds)
        self.unit_area = ti.field(real, shape=bonds)
        self.bond_pair = ti.field(ti.i32, shape=bonds)
        self.vertex_master = ti.Vector.field(3, real, shape=units)
        self.vertex_slave = ti.Vector.field(3, real, shape=units)
        self.neighbour = ti.field(ti.i32, shape=capacity.faces)
        self.face_bond = ti.field(ti.i32, shape=capacity.faces)

    def upload(self, model: Model) -> None:
        """Take over a model; all fields are zero before."""
        assign(self.body_count, model.body_count)
        assign(self.bond_count, model.bond_count)
        assign(self.mass, model.body_mass)
        assign(self.mass_inverse, 1.0 / model.body_mass)
        assign(self.radius, model.body_radius)
        assign(self.inertia, model.body_inertia)
        assign(self.inertia_inverse, inverse(model.body_inertia))
        self._load_bonds(model)
        of_body, top = model.materials.of_body, model.topology
        assign(self.material, of_body)
        assign(self.bond_pair, MOST * of_body[top.master] + of_body[top.slave])
        if self.has_contact:
            assign(self.face_spheres, model.geometry.face_spheres)
            assign(self.extent, model.geometry.extents(model))
        for effect in self.effects:
            effect.upload_scene(model)

    @ti.func
    def pair(self, i, j):
        """Pair of materials of two bodies: the row of its numbers in the table of a law."""
        return MOST * self.material[i] + self.material[j]

    def matched(self, model: Model) -> list[tuple[Any, Any]]:
        """Pairs of an effect bound here and the corresponding one of a model; no null objects."""
        bound = {role: iter([e for e in self.effects if e.role == role]) for role in ROLES}
        pairs = [(next(bound[given.role]), given) for given in model.effects]
        return [*pairs, *([(self.geometry, model.geometry)] if self.has_contact else [])]

    def _load_bonds(self, model):
        bonds = model.bonds
        assign(self.neighbour, model.neighbours.reshape(-1))
        assign(self.face_bond, model.topology.body_bond.reshape(-1))
        assign(self.bond_slots, bonds["slots"])
        assign(self.bond_frame, bonds["frame"])
        assign(self.bond_stiffness, model.bond_stiffness)
        assign(self.unit_area, bonds["area"])
        on_master = bonds["on_master"]
        if model.stress is not None:
            # Bodies that have not moved are then apart by what makes the stress at the start.
            on_master = on_master - model.start_openings[:, None]
        assign(self.vertex_master, on_master.reshape(-1, 3))
        assign(self.vertex_slave, bonds["on_slave"].reshape(-1, 3))
