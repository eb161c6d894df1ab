"""Data of a run that reports read, from tables that kernels fill, and keep."""

import contextlib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import taichi as ti

from taichi_dem.contact.contacts import Contacts
from taichi_dem.kit import backend
from taichi_dem.kit.allocation import values
from taichi_dem.kit.launch import Launch
from taichi_dem.kit.products import norm
from taichi_dem.kit.types import vec2, vec3
from taichi_dem.laws.contact_contracts import DEEP
from taichi_dem.state.model import Model, sums
from taichi_dem.state.state import PARTS, State
from taichi_dem.step.multirate.half_step import HalfStep
from taichi_dem.step.multirate.schedule import Schedule
from taichi_dem.step.phases import Step

#: Bodies up to which loops over them are serial.
_FEW = 4096
#: Record of a pair in contact: impulse [N s] and moment [N m s] on each body in half a step, heats
#: in it [J], friction and its limit [N], power of friction [W], elastic energy and heats booked
#: [J], step [s], forces times arms [N m].
PAIR = np.dtype(
    [
        *(("on_first", float, 6), ("on_second", float, 6), ("dragged", float), ("rubbed", float)),
        *(("rub", float), ("bound", float), ("rub_power", float), ("strain", float)),
        *(("heat", float, 4), ("spent", float), ("step", float), ("leverage", float, (3, 3))),
    ]
)
#: Record of a bond: its energies [J], mean damage, which parts of its law acted, largest slip of
#: its units [m], and how late they failed.
BOND = np.dtype(
    [
        *(("strain", float), ("dashpot", float), ("slip", float), ("release", float)),
        *(("softening", float), ("damage", float), ("acted", float, PARTS)),
        *(("residual_slip", float), ("reach", float)),
    ]
)


def body_record(drives: int) -> np.dtype:
    """Record of a body: energy and works [J], heats of contacts [J], motion, work of each drive."""
    vectors = ("velocity", "spin", "angular_momentum")
    return np.dtype(
        [
            *(("kinetic", float), ("load_work", float), ("support_work", float)),
            ("contact_heat", float, 4),
            *((name, float, 3) for name in vectors),
            ("works", float, (drives + 1,)),
        ]
    )


@ti.data_oriented
class RecordColumns:
    """Column at which each name of a record begins, in a table of numbers."""

    def __init__(self, record: np.dtype):
        for name, (_, begin, *_title) in (record.fields or {}).items():
            setattr(self, name, begin // 8)


def as_numbers(records: np.ndarray) -> np.ndarray:
    """Records as the table that a kernel fills, (n, columns), in the same memory."""
    return records.view(float).reshape(len(records), -1)


@ti.data_oriented
class Readings:
    """Kernels that read booked terms, or compute others by the laws of the step.

    Arrays that methods fill or return have the counts of the scene.
    """

    def __init__(self, step: Step):
        self.step, self.tables, self.state = step, step.tables, step.state
        self.schedule, self.contacts = step.schedule, step.schedule.contacts
        self.half_step = HalfStep(step)
        # A loop over few bodies takes less time than two threads to be told of it.
        self.body = body_record(len(self.tables.drives))
        self.of_body, self.of_bond, self.of_pair = map(RecordColumns, (self.body, BOND, PAIR))
        self.small = self.tables.capacity.bodies < _FEW and backend.is_cpu()
        self._held: dict[str, Any] | None = None
        self._rooms: dict[str, np.ndarray] = {}
        self._launch_push, self._launch_visit = Launch(self._push), Launch(self._visit)
        self.bond_shares = Launch(self._lower_bond_shares)
        self.contact_shares = Launch(self._note_contact_shares)

    @contextlib.contextmanager
    def held(self) -> Iterator[None]:
        """Read each table once in the block, in which the run stands still; blocks may nest."""
        outer = self._held
        self._held = {} if outer is None else outer
        try:
            yield
        finally:
            self._held = outer

    def once(self, name: str, find: Callable[[], Any]) -> Any:
        """What a function finds, which inside of ``held`` is asked once under a name."""
        held = {} if self._held is None else self._held
        if name not in held:
            held[name] = find()
        return held[name]

    def _room(self, name, count, kind):
        """Zero records for a kernel to fill, in the same memory as before for the same count."""
        if name not in self._rooms or len(self._rooms[name]) != count:
            self._rooms[name] = np.zeros(count, dtype=kind)
        self._rooms[name].fill(0)
        return self._rooms[name]

    def contacts_now(self) -> np.ndarray:
        """Records of the contacts of every pair, see ``PAIR``."""
        return self._contacts()[0].copy()

    def near_bodies(self) -> np.ndarray:
        """Bodies of every pair, in the order of ``contacts_now``, (pairs, 2)."""
        if self.contacts is None:
            return np.zeros((0, 2), dtype=np.int32)
        store = self.contacts.store
        return values(store.body, values(store.near_slot, slice(int(values(store.near_count)))))

    def contact_wrenches(self) -> np.ndarray:
        """Force [N] and moment about its centre [N m] of the contacts on every body, (n, 6)."""
        table, count = self._contacts()[0], int(values(self.tables.body_count))
        bodies, per_second = self.near_bodies(), 2.0 / table["step"][:, None]
        first, second = per_second * table["on_first"], per_second * table["on_second"]
        return sums(bodies[:, 0], first, count) + sums(bodies[:, 1], second, count)

    def _contacts(self):
        """The same, and impulses [N s] and moments [N m s] of each body in half a step, (n, 6)."""
        return self.once("contacts", self._pushes)

    def _pushes(self):
        pushed = self._room("pushed", int(values(self.tables.body_count)), (float, 6))
        count = int(values(self.contacts.store.near_count)) if self.contacts is not None else 0
        table = self._room("contacts", count, PAIR)
        if count:
            self._launch_push(as_numbers(table), pushed)
        return table, pushed

    @ti.kernel
    def _push(
        self,
        table: ti.types.ndarray(dtype=ti.f64, ndim=2),
        pushed: ti.types.ndarray(dtype=ti.f64, ndim=2),
    ):
        """Impulse [N s], moment [N m s] of each pair's contacts on both bodies in half a step."""
        ti.loop_config(serialize=ti.static(self.small))
        for a in range(self.contacts.store.near_count[None]):
            p = self.contacts.store.near_slot[a]
            forces, half, at = self.step.forces_now(p), self.half_step.pair_step(p), self.of_pair
            for k in ti.static(range(3)):
                table[a, at.on_first + k] = -half * forces.force[k]
                table[a, at.on_first + 3 + k] = half * forces.moment_i[k]
                table[a, at.on_second + k] = half * forces.force[k]
                table[a, at.on_second + 3 + k] = half * forces.moment_j[k]
            for k in ti.static(range(4)):
                table[a, at.heat + k] = self.contacts.store.heat[p][k]
            table[a, at.spent] = forces.spent
            table[a, at.dragged], table[a, at.rubbed] = half * forces.dragged, half * forces.rubbed
            table[a, at.rub], table[a, at.bound] = forces.rub, forces.bound
            table[a, at.rub_power], table[a, at.strain] = forces.rubbed, forces.stored
            table[a, at.step] = 2.0 * half
            for r, c in ti.static(ti.ndrange(3, 3)):
                table[a, at.leverage + 3 * r + c] = forces.leverage[r, c]
        ti.loop_config(serialize=ti.static(self.small))
        for i in range(self.tables.body_count[None]):
            # In the order of the pairs, so that no thread changes a bit.
            forces = self._sum_of_pairs(self.contacts.store, table, i)
            for k in ti.static(range(6)):
                pushed[i, k] = forces[k]

    @ti.func
    def _sum_of_pairs(self, store: ti.template(), table: ti.template(), i):
        """Impulse and moment of the contacts of body i with all others."""
        total = ti.Vector.zero(ti.f64, 6)
        for a in range(store.first_of[i], store.first_of[i + 1]):
            for k in ti.static(range(6)):
                total[k] += table[a, self.of_pair.on_first + k]
        for s in range(store.second_start[i], store.second_start[i + 1]):
            for k in ti.static(range(6)):
                total[k] += table[store.place_of(store.second_slot[s]), self.of_pair.on_second + k]
        return total

    def bodies(self) -> np.ndarray:
        """Kinetic energy, work of loads, supports, contact heats, ground's heat [J], (n, 8)."""
        table, grounds = self._present(), len(self.tables.loads) + 1
        given = (table[name] for name in ("kinetic", "load_work", "support_work", "contact_heat"))
        return np.column_stack([*given, 0.0 - table["works"][:, grounds:].sum(axis=1)])

    def motion(self) -> np.ndarray:
        """Velocity, spin and angular momentum of every body at the time of its position, (n, 9)."""
        table = self._present()
        return np.hstack([table[name] for name in ("velocity", "spin", "angular_momentum")])

    def works(self) -> np.ndarray:
        """Work of each load, of all supports, of each ground, on every body [J], (n, accounts)."""
        return self._present()["works"].copy()

    def step_back(self) -> None:
        """Set the velocities, which are given at time zero, half a step back."""
        self._visited(1)

    def _present(self):
        return self.once("bodies and bonds", self._visited)[0]

    def _bonds(self):
        return self.once("bodies and bonds", self._visited)[1]

    def _visited(self, back=0):
        """Tables of bodies and of bonds."""
        pushed, bond_count = self._contacts()[1], int(values(self.tables.bond_count))
        bodies = self._room("bodies", len(pushed), self.body)
        # A kernel takes no empty table.
        bonds = self._room("bonds", max(1, bond_count), BOND)
        self._launch_visit(pushed, back, as_numbers(bodies), as_numbers(bonds))
        return bodies, bonds[:bond_count]

    @ti.kernel
    def _visit(
        self,
        pushed: ti.types.ndarray(dtype=ti.f64, ndim=2),
        back: ti.i32,
        table: ti.types.ndarray(dtype=ti.f64, ndim=2),
        bonds: ti.types.ndarray(dtype=ti.f64, ndim=2),
    ):
        """Fill in all that is read of bodies, at the present, and of bonds, or set bodies back."""
        ti.loop_config(serialize=ti.static(self.small))
        for i in range(self.tables.body_count[None]):
            linear, angular = vec3(0.0), vec3(0.0)
            for k in ti.static(range(3)):
                linear[k], angular[k] = pushed[i, k], pushed[i, 3 + k]
            velocity, momentum, works = self.half_step.visit(i, linear, angular, back)
            spin = self.step.loads.spin(i, momentum)
            moving = self.tables.mass[i] * velocity.norm_sqr()
            at = self.of_body
            table[i, at.kinetic] = 0.5 * (moving + momentum.dot(spin))
            for k in ti.static(range(3)):
                table[i, at.velocity + k], table[i, at.spin + k] = velocity[k], spin[k]
                table[i, at.angular_momentum + k] = momentum[k]
            if ti.static(self.tables.has_contact):
                for k in ti.static(range(4)):
                    table[i, at.contact_heat + k] = self.state.contact_heat[i][k]
            for e in ti.static(range(len(self.tables.drives) + 1)):
                table[i, at.works + e] = self.state.load_work[i][e] + works[e]
            for e in ti.static(range(len(self.tables.loads))):
                table[i, at.load_work] = table[i, at.load_work] + table[i, at.works + e]
            table[i, at.support_work] = table[i, at.works + ti.static(len(self.tables.loads))]
        ti.loop_config(serialize=ti.static(self.small))
        for b in range(self.tables.bond_count[None]):
            self._visit_bond(bonds, b)

    def bonds(self) -> np.ndarray:
        """Strain, dashpot, slip, release and softening energy of every bond [J], (n, 5)."""
        return np.column_stack([self._bonds()[name] for name in BOND.names[:5]])

    def damage(self) -> np.ndarray:
        """Mean damage of the units of every bond, 1 once it is released, (n,)."""
        return self._bonds()["damage"].copy()

    def active_bonds(self) -> np.ndarray:
        """Whether each part of its law has changed a unit of every bond, (n, 2)."""
        return self._bonds()["acted"] > 0.0

    def residual_slip(self) -> np.ndarray:
        """Largest residual slip of the units of every bond that holds [m], (n,)."""
        return self._bonds()["residual_slip"].copy()

    def reach(self) -> np.ndarray:
        """Largest jump of a unit of every bond as it failed, over that at which it had to, (n,)."""
        return self._bonds()["reach"].copy()

    @ti.func
    def _visit_bond(self, table: ti.template(), b):
        # Each place is written once: to add to it takes longer, and what a kernel does not write
        # into an array that it does not read is not zero on a card.
        energy, drag, spent, damage, slip, reach = 0.0, 0.0, 0.0, 1.0, 0.0, 0.0
        stiffness, m = self.tables.bond_stiffness[b], self.tables.bond_pair[b]
        heat, acted = vec2(0.0), ti.cast(0, ti.i32)
        if ti.static(self.step.bonds.has_dashpot):
            drag = self.state.bond_drag[b]
        if ti.static(not self.tables.bond.is_null):
            heat = self.state.bond_heat[b]
        for q in range(3):
            u = 3 * b + q
            spent += self.tables.unit_area[b] * self.tables.bond.spent(m, u, stiffness)
            acted |= ti.cast(self.tables.bond.acted(m, u, stiffness), ti.i32)
            reach = ti.max(reach, self.tables.bond.reach(m, u))
        if self.state.broken_tick[b] < 0:
            motion = self.state.bond_motion(b)
            energy, damage = self.step.bonds.energy(b, motion), 0.0
            if ti.static(self.step.bonds.has_dashpot and self.step.staggered):
                drag += self.half_step.bond_drag(b, motion)
            for q in range(3):
                u = 3 * b + q
                damage += self.tables.bond.damage(m, u, stiffness) / 3.0
                slip = ti.max(slip, norm(self.tables.bond.residual_slip(m, u)))
        at = self.of_bond
        table[b, at.strain], table[b, at.dashpot] = energy, drag
        table[b, at.slip], table[b, at.release] = heat[0], heat[1]
        table[b, at.softening], table[b, at.damage] = spent, damage
        table[b, at.residual_slip], table[b, at.reach] = slip, reach
        for part in ti.static(range(PARTS)):
            table[b, at.acted + part] = ti.cast((acted >> part) & 1, ti.f64)

    def pairs(self) -> np.ndarray:
        """Strain, and heats that the first body has not taken, of every pair [J], (pairs, 5)."""
        table, _ = self._contacts()
        sums = np.column_stack([table["strain"], table["heat"]])
        sums[:, 1] += table["dragged"]
        sums[:, 2] += table["rubbed"]
        # What the law has taken since the last step took note of it.
        sums[:, 4] += table["spent"]
        return sums

    def momentum(self) -> np.ndarray:
        """Momentum of every body; impulses of loads and supports, their sums and sizes, (n, 14)."""
        state, here = self.state, slice(int(values(self.tables.body_count)))
        names = "velocity", "angular_momentum", "position", "load_impulse", "impulse_sizes"
        velocity, spun, place, given, sizes = (values(getattr(state, n), here) for n in names)
        # Numbers of a run that has diverged may be beyond all.
        with np.errstate(over="ignore", invalid="ignore"):
            linear = values(self.tables.mass, here)[:, None] * velocity
            angular = spun + np.cross(place, linear)
        return np.column_stack([linear, angular, given, sizes])

    @ti.kernel
    def left_out(self, table: ti.types.ndarray(dtype=ti.f64, ndim=2)):
        """Bound of impulse [N s] and energy [J] that each bond has left out while it slept."""
        for b in range(self.tables.bond_count[None]):
            slots = self.tables.bond_slots[b]
            schedule = self.schedule
            left_out = schedule.sleeping.left_out[b]
            if not schedule.sleeping.both_awake(slots[0] >> 2, slots[1] >> 2):
                left_out = schedule.sleeping.left_out_now(b, schedule.seconds(1), False)
            table[b, 0], table[b, 1] = left_out[0], left_out[1]

    @ti.kernel
    def _lower_bond_shares(self, share: ti.types.ndarray(dtype=ti.f64, ndim=1)):
        """Lower each bond's entry to the share of its dashpots that the present steps leave."""
        for b in range(self.tables.bond_count[None]):
            if self.state.broken_tick[b] < 0:
                share[b] = ti.min(share[b], self.step.bonds.share(b))

    @ti.kernel
    def _note_contact_shares(
        self,
        share: ti.types.ndarray(dtype=ti.f64, ndim=1),
        taken: ti.types.ndarray(dtype=ti.f64, ndim=1),
    ):
        """Note how far the steps of touching bodies limit their contact dashpots."""
        ti.loop_config(serialize=ti.static(self.small))
        for a in range(self.contacts.store.near_count[None]):
            p = self.contacts.store.near_slot[a]
            count = self.contacts.touching(p)
            if count > 0:
                i, j = self.contacts.store.body[p][0], self.contacts.store.body[p][1]
                if ti.static(self.step.bonds.limited):
                    ti.atomic_min(share[i], self.step.pairs.share(i, j))
                else:
                    law, geometry = self.contacts.law, self.contacts.geometry
                    numbers, deep = law.row(self.tables.pair(i, j)), DEEP * self.tables.extent[i]
                    area = geometry.largest_area(i, j)
                    rate = count * law.damping_at(numbers, deep)
                    rate *= area * geometry.weight(i, j, area)
                    rate *= 1.0 / self.tables.mass[i] + 1.0 / self.tables.mass[j]
                    ti.atomic_max(taken[i], rate * self.schedule.pair_step(i, j))


@dataclass
class Run:
    """What a report reads of a simulation; contacts is None without contact.

    Its parts are replaced where a simulation moves to an engine with more room.
    """

    model: Model
    state: State
    schedule: Schedule
    step: Step
    readings: Readings
    contacts: Contacts | None


class Kept:
    """What is followed over a run: a checkpoint holds its attributes of the names ``kept``."""

    kept: ClassVar[tuple[str, ...]] = ()

    def saved(self) -> dict[str, np.ndarray]:
        """Data for a checkpoint, arrays by name."""
        return {name: np.array(getattr(self, name)) for name in self.kept}

    def resume(self, saved: Mapping[str, np.ndarray]) -> None:
        """Restore the data that ``saved`` returned."""
        for name in self.kept:
            setattr(self, name, saved[name].copy()[()])
