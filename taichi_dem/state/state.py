"""Everything that changes in a run; checkpoints hold this and the effects' own state."""

import numpy as np
import taichi as ti
from numpy.typing import ArrayLike

from taichi_dem.kit import backend
from taichi_dem.kit.allocation import assign, values
from taichi_dem.kit.types import mat3, real, vec3
from taichi_dem.materials.body_materials import MOST
from taichi_dem.mesh.topology import Topology
from taichi_dem.physics.bond import bond_motion
from taichi_dem.physics.fracture import coulomb_limit
from taichi_dem.physics.rotation import rotation_matrix
from taichi_dem.physics.rotation_arrays import angular_momenta, rotations, spins
from taichi_dem.physics.sphere_pair import CONTACT, RUBBED
from taichi_dem.state.model import Model
from taichi_dem.state.tables import Tables
from taichi_dem.state.timeline import NEVER

#: Parts of a bond's law, by the bits of ``begins``.
PARTS = 2
#: Tick after all others, for what has not begun.
LATER = 1 << 62
#: Motion of a body that is given, by name.
_GIVEN = ("position", "orientation", "velocity", "spin")


@ti.data_oriented
class Activity:
    """Where the law of a bond acts: since when, and how often it was evaluated."""

    def __init__(self, tables: Tables):
        self.tables, bonds = tables, tables.capacity.bonds
        self.since = ti.Vector.field(PARTS, ti.i64, shape=bonds)
        self.evaluated = ti.field(ti.i64, shape=bonds)
        self.touched = ti.Vector.field(2, ti.i64, shape=tables.capacity.bodies)

    def upload(self, model: Model) -> None:
        """Begin with no bond near a limit; all fields are zero before."""
        assign(self.since, np.full((model.bond_count, PARTS), NEVER))
        assign(self.touched, np.full((model.body_count, 2), LATER))

    @ti.func
    def is_active(self, b, near, tick):
        """Whether the law of bond b must be evaluated; near: bits of parts near a limit now."""
        since = self.since[b]
        active = since[0] >= 0 or since[1] >= 0
        for part in ti.static(range(PARTS)):
            if since[part] < 0 and near & (1 << part) != 0:
                self.since[b][part] = tick
                active = True
        if active:
            self.evaluated[b] = self.evaluated[b] + 1
        return active

    @ti.func
    def note_touch(self, i, bits, tick):
        """Note when contact and friction, given as bits, first act on body i."""
        if bits & ti.i64(CONTACT) != 0:
            ti.atomic_min(self.touched[i][0], tick)
        if bits & ti.i64(RUBBED) != 0:
            ti.atomic_min(self.touched[i][1], tick)


@ti.dataclass
class BodyMotion:
    """A body at the beginning of its step, in world axes; velocity and spin of half a step before.

    since, until: times [s] over which a varying load acts by its mean, without gaps.
    """

    position: vec3
    rotation: mat3
    velocity: vec3
    spin: vec3
    time: real
    step: real
    since: real
    until: real


def unserved_limits(model: Model) -> np.ndarray:
    """Tensile strength, cohesion [Pa] and friction that no effect of a model serves, else inf."""
    served = {effect.role for effect in model.effects if effect.name}
    rows = np.zeros((MOST**2, 3))
    for a, row in enumerate(model.materials.pairs):
        for b, pair in enumerate(row):
            strength = np.inf if served & {"bond", "tension"} else pair.tensile_strength
            slides = (np.inf, 0.0) if served & {"bond", "shear"} else (pair.cohesion, pair.friction)
            rows[MOST * a + b] = strength, *slides
    return rows


@ti.data_oriented
class State:
    """Motion of the bodies, pending impulses, fracture and the energy account, in SI units.

    A body's motion is that of its own last tick. angular_momentum in world axes; spin follows.
    lag: time [s] by which what a body has taken of each load is behind its position. slot: impulse
    and moment about the centre that face f of body i has gathered since, entry 4 i + f.
    bond_drag, bond_heat: energy taken from each bond by dashpots, by slip and release [J].
    load_work: a component a load, one for all supports, one a ground; impulse_sizes: sums of sizes.
    bad_body: lowest body out of bounds, else body_count. limits: of each pair of materials, whose
    excess in a bond is noted in passed, unbounded where an effect serves them.
    """

    scratch_fields = ("cut_short",)

    def __init__(self, tables: Tables):
        n, bonds = tables.capacity.bodies, tables.capacity.bonds
        self.tables = tables
        self.activity = Activity(tables) if tables.on_demand else None
        self.orientation = ti.Vector.field(4, real, shape=n)
        self.position, self.velocity = (ti.Vector.field(3, real, shape=n) for _ in range(2))
        self.spin, self.angular_momentum = (ti.Vector.field(3, real, shape=n) for _ in range(2))
        self.level, self.bound = (ti.field(ti.i32, shape=n) for _ in range(2))
        self.last_tick = ti.field(ti.i64, shape=n)
        if tables.loads:
            self.lag = ti.Vector.field(len(tables.loads), real, shape=n)
        self.slot = ti.Vector.field(6, real, shape=tables.capacity.faces)
        self.broken_tick = ti.field(ti.i64, shape=bonds)
        if tables.dashpot.name:
            self.bond_drag = ti.field(real, shape=bonds)
        if not tables.bond.is_null:
            self.bond_heat = ti.Vector.field(2, real, shape=bonds)
        if tables.has_contact:
            self.exposed_tick = ti.field(ti.i64, shape=tables.capacity.faces)
            self.contact_heat = ti.Vector.field(4, real, shape=n)
            self.injected_tick = ti.field(ti.i64, shape=())
        self.active_effects = ti.field(ti.i64, shape=n)
        self.limits = ti.Vector.field(3, real, shape=MOST**2)
        self.passed = ti.Vector.field(2, ti.i64, shape=bonds)
        accounts = len(tables.loads) + 1 + len(tables.ground)
        self.load_work = ti.Vector.field(accounts, real, shape=n)
        self.load_impulse = ti.Vector.field(6, real, shape=n)
        self.impulse_sizes = ti.Vector.field(2, real, shape=n)
        self.tick = ti.field(ti.i64, shape=())
        self.bad_body = ti.field(ti.i32, shape=())
        if backend.most_rounds():
            self.cut_short = ti.field(ti.i32, shape=())
        self.max_speed2 = ti.field(real, shape=())

    def upload(self, model: Model, max_speed: float) -> None:
        """Put the bodies where the mesh has them, at rest; all fields are zero before."""
        n = model.body_count
        if self.tables.has_contact:
            assign(self.exposed_tick, np.full(4 * n, NEVER))
        assign(self.max_speed2, max_speed**2)
        assign(self.broken_tick, np.full(model.bond_count, NEVER))
        assign(self.bad_body, n)
        assign(self.passed, np.full((model.bond_count, 2), NEVER))
        assign(self.limits, unserved_limits(model))
        if self.activity is not None:
            self.activity.upload(model)
        self.set_motion(model.centre)

    def set_motion(
        self,
        position: ArrayLike,
        orientation: ArrayLike | None = None,
        velocity: ArrayLike | None = None,
        spin: ArrayLike | None = None,
    ) -> None:
        """Set the motion of all bodies, arrays of a row each or one row for all."""
        given = (position, orientation, velocity, spin)
        rest = ([0.0] * 3, [1.0, 0.0, 0.0, 0.0], [0.0] * 3, [0.0] * 3)
        whole = [np.tile(still, (self.body_count, 1)) for still in rest]
        for rows, part in zip(whole, given):
            if part is not None:
                rows[:] = part
        inertia = values(self.tables.inertia, slice(self.body_count))
        momenta = angular_momenta(whole[1], whole[3], inertia)
        for name, part in zip((*_GIVEN, "angular_momentum"), (*whole, momenta)):
            assign(getattr(self, name), part)

    @ti.func
    def note_active(self, i, bits):
        """Note that effects, given as bits, have changed the motion of body i."""
        # Seldom news: a comparison spares the atomic operation, which parallel pairs need.
        if self.active_effects[i] & bits != bits:
            ti.atomic_or(self.active_effects[i], bits)
            if ti.static(self.tables.on_demand):
                self.activity.note_touch(i, bits, self.tick[None])

    @ti.func
    def note_passed(self, m, b, pull, shear2):
        """Note that a bond exceeds a limit that no listed effect serves."""
        limits = self.limits[m]
        if pull > limits[0]:
            self._note_first(b, 0)
        bound = coulomb_limit(limits[1], limits[2], -pull)
        if shear2 > bound * bound:
            self._note_first(b, 1)

    @ti.func
    def _note_first(self, b, limit: ti.template()):
        if self.passed[b][limit] < 0:
            self.passed[b][limit] = self.tick[None]

    @ti.func
    def rotation(self, i):
        """Matrix that turns coordinates of body i into world coordinates."""
        return rotation_matrix(self.orientation[i])

    @ti.func
    def body_motion(self, i, time, step, since, until):
        """Present motion of body i, for loads in a step [s] from a time: ``BodyMotion``."""
        return BodyMotion(
            position=self.position[i],
            rotation=self.rotation(i),
            velocity=self.velocity[i],
            spin=self.spin[i],
            time=time,
            step=step,
            since=since,
            until=until,
        )

    @ti.func
    def bond_motion(self, b):
        """Relative motion of the bodies of a bond now, a ``BondMotion``."""
        slots = self.tables.bond_slots[b]
        i, j = slots[0] >> 2, slots[1] >> 2
        return bond_motion(
            self.tables.bond_frame[b],
            self.position[j] - self.position[i],
            self.rotation(i),
            self.rotation(j),
            self.velocity[j] - self.velocity[i],
            self.spin[i],
            self.spin[j],
        )

    @property
    def body_count(self) -> int:
        """Bodies of the scene."""
        return int(values(self.tables.body_count))

    def broken(self) -> np.ndarray:
        """Whether each bond has been released, (bond_count,)."""
        bonds = slice(int(values(self.tables.bond_count)))
        return values(self.broken_tick, bonds) != NEVER

    def expose(self, topology: Topology, outer: bool) -> None:
        """Put contact spheres on faces without a bond from the start."""
        marks, chosen = values(self.exposed_tick), topology.is_open | outer
        marks[4 * topology.outer_body[chosen] + topology.outer_face[chosen]] = 0
        assign(self.exposed_tick, marks)

    @ti.func
    def check_loops(self, rounds):
        """Note where the device ends the loops of this thread; rounds: a number of at least 1."""
        if ti.static(backend.most_rounds() > 0):
            if backend.loops_have_ended(rounds):
                self.cut_short[None] = 1

    def motion(self) -> dict[str, np.ndarray]:
        """Arrays of the bodies' motion by name."""
        stored = self.stored()
        # The stored spin is that of the orientation before the last turn.
        inverse = values(self.tables.inertia_inverse, slice(self.body_count))
        stored["spin"] = spins(stored["orientation"], inverse, stored["angular_momentum"])
        return stored

    def stored(self) -> dict[str, np.ndarray]:
        """The same arrays with the spin that the fields have, that before the last turn."""
        here = slice(self.body_count)
        names = (*_GIVEN, "angular_momentum", "level")
        arrays = {name: values(getattr(self, name), here) for name in names}
        return {**arrays, "rotation": rotations(arrays["orientation"])}

    def fields(self) -> dict[str, ti.Field]:
        """Every field that changes, and those of the bound effects, by name."""
        owners = [("", self), *((f"{effect.name}_", effect) for effect in self.tables.effects)]
        return {
            prefix + name: field
            for prefix, owner in owners
            for name, field in vars(owner).items()
            if isinstance(field, ti.Field)
        }
