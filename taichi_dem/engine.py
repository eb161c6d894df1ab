"""The engine of a blast: all fields and kernels of one structure, which runs any scene of it."""

from collections.abc import Iterable
from typing import Any

import numpy as np
import taichi as ti

from taichi_dem.contact.contacts import Contacts
from taichi_dem.contact.search import BroadPhase
from taichi_dem.kit.allocation import values
from taichi_dem.kit.engine_pool import Engine, EnginePool
from taichi_dem.laws.base import Effect, bound
from taichi_dem.laws.bond import Separable
from taichi_dem.laws.contracts import PARTS_OF_BOND
from taichi_dem.laws.roles import ABSENT
from taichi_dem.methods import Method, structure_of
from taichi_dem.report.forces import Forces
from taichi_dem.report.readings import Readings
from taichi_dem.state.model import ROLES, Model
from taichi_dem.state.state import State
from taichi_dem.state.tables import LEAST, Capacity, Tables
from taichi_dem.step.drivers import DRIVERS
from taichi_dem.step.explicit import ExplicitStep
from taichi_dem.step.multirate.schedule import Schedule
from taichi_dem.step.solved import SolvedStep


class Structure:
    """Compiled structure of a scene and a method: classes of effects, kind of method.

    Scenes of equal structures share kernels.
    """

    def __init__(self, effects: Iterable[Effect], method: Method, on_demand: bool = False):
        self.effects, self.method, self.on_demand = tuple(effects), method, on_demand
        self.geometry = next((e.geometry for e in self.effects if e.role == "contact"), None)
        kinds = tuple(map(type, (*self.effects, self.geometry)))
        # Supports that turn have fields of their own.
        turning = tuple(bool(getattr(effect, "turns", False)) for effect in self.effects)
        self.key = kinds, structure_of(method), on_demand, turning

    def __eq__(self, other):
        return self.key == other.key

    def __hash__(self):
        return hash(self.key)


class BlastEngine(Engine):
    """Tables, state, contact search, schedule, step and drivers of one structure."""

    advice = "take a smaller mesh"
    counted = "bodies"

    def declare(self) -> None:
        """Build all parts; Taichi allocates their fields afterwards, all at once."""
        capacity = Capacity(*self.capacity)
        capacity.check()
        method = self.structure.method
        self.tables = Tables(capacity, self.structure.on_demand)
        geometry = self.structure.geometry
        if geometry is not None:
            geometry = bound(geometry, self.tables)
        self.tables.take(*_bound_by_role(self.structure.effects, self.tables), geometry)
        self.state = State(self.tables)
        self.contacts = Contacts(self.tables, self.state) if self.tables.has_contact else None
        self.schedule = Schedule(self.tables, self.state, self.contacts, method)
        search = None
        if self.contacts is not None:
            listeners = self.schedule.pair_phases(), self.schedule.limits
            search = BroadPhase(self.contacts, *listeners)
        self.broad_phase = search
        # A method may have a step of its own (docs/add_a_time_integrator.md).
        chosen: Any = getattr(method, "step", ExplicitStep)
        kind: Any = SolvedStep if method.solves else chosen
        self.step = kind(self.schedule, search)
        self.step.arrange()
        self.drivers = {name: driver(self.step) for name, driver in DRIVERS.items()}
        self.readings = Readings(self.step)
        self.forces = Forces(self.readings)
        self.recording_compiled = False

    def upload(self, model: Model, method: Method, max_speed: float, sleep: float = 0.0) -> None:
        """Take over a scene, at rest and at time zero; max_speed [m/s], sleep: see ``Scene``."""
        self.clear()
        self.lengths = self._lengths(model)
        for effect, given in self.tables.matched(model):
            effect.stand_for(given)
        self.tables.upload(model)
        self.state.upload(model, max_speed)
        if self.contacts is not None:
            self.contacts.upload(model, method)
            self.broad_phase.upload(model, method)
        self.schedule.upload(model, method, sleep)
        if self.step.solver is not None:
            self.step.solver.upload(model, method)

    def _lengths(self, model):
        """Entries that a scene uses by those that a field has."""
        room, n = Capacity(*self.capacity), model.body_count
        lengths = {room.bodies: n, room.faces: 4 * n}
        lengths.update({room.bonds: model.bond_count, room.units: 3 * model.bond_count})
        if model.has_contact:
            lengths[room.spheres] = 4 * n * model.geometry.face_spheres
        return lengths

    def accepts(self, model: Model) -> bool:
        """Whether effect parameters compiled into kernels have the values of the scene."""
        return all(effect.accepts(given) for effect, given in self.tables.matched(model))

    def values(self, field: ti.Field) -> np.ndarray:
        """Copy of the entries of a field that the scene uses."""
        length = self.lengths.get(field.shape[0]) if field.shape else None
        return values(field) if length is None else values(field, slice(length))


def _bound_by_role(effects, tables):
    """Bound copies of effects by role, null objects where none is listed; the law of bonds."""
    listed = {role: [e for e in effects if e.role == role] for role in ROLES}
    for role, absent in ABSENT.items():
        if not listed[role] and not (listed["bond"] and role in PARTS_OF_BOND):
            listed[role] = [absent()]
    by_role = {role: [bound(effect, tables) for effect in listed[role]] for role in ROLES}
    if by_role["bond"]:
        return by_role, by_role["bond"][0]
    return by_role, Separable(by_role["tension"][0], by_role["shear"][0])


#: Engines of the session.
ENGINES = EnginePool(BlastEngine, LEAST)
