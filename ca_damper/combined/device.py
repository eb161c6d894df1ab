"""The combined filling and its step: a flight of all grains, or short steps of spheres.

Both are steps of one leapfrog, whose velocities belong to the times between steps and whose
positions run half a step ahead. Another length of step shifts the positions along the velocities,
which changes neither momentum nor energy, so that grains pass from one way to the other exactly.
In short steps the container is foreseen from its motion at the beginning and its recoil, as the
structure moves it at the end of the whole step only.
"""

from dataclasses import dataclass
from typing import Any, ClassVar

import taichi as ti

from ca_damper.filling import Action, Fillings, Motion, Structure
from ca_damper.scenes.scene_fields import SceneFields
from ca_damper.spheres.bodies import vec2
from ca_damper.spheres.dynamics import DeviceSpheres
from ca_damper.spheres.effect_activity import FLIGHTS
from ca_damper.spheres.options import Spheres
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.validation import whole

# Steps that a flight must be clear of contacts: itself, and half of one, by which positions lead.
_CLEAR = 1.5


@ti.data_oriented
class DeviceCombined(DeviceSpheres):
    """The grains of all scenes of a table; see ``ca_damper.filling``.

    substeps: short steps of a step. substep: short steps and flights since the reset.
    """

    def __init__(self, options: Any, table: SceneFields):
        super().__init__(options, table)
        self.substeps, self.substep = table.field(ti.i32), table.field(ti.i32)

    def load(self, fillings: Fillings) -> None:
        """Take over the numbers of the grains of each scene."""
        super().load(fillings)
        fillings.write(self.substeps, lambda one: one.substeps)

    @ti.func
    def reset(self, s):
        """Place the grains of scene s, at rest."""
        self.place(s)
        self.substep[s] = 0

    @ti.func
    def advance(self, s, step, motion):
        """Advance the grains by a step; returns the impulse of their impacts on the container."""
        dt, impulse = self.table.dt[s], 0.0
        if step == 0:
            self.board(s, motion)
        if self._is_clear(s, dt, motion):
            self._fly(s, dt, motion)
            self.effect_activity.step[s] = step
            self.effect_activity.note(s, FLIGHTS)
        else:
            impulse = self._take_short_steps(s, step, dt, motion)
        return Action(impulse, 0.0)

    @ti.func
    def _is_clear(self, s, dt, motion):
        """Whether nothing can touch in a step; never before the first one."""
        bodies, search = self.bodies, self.search
        lead, clear = bodies.lead[s], False
        if lead > 0.0:
            floor = motion.x + lead * (motion.v + 0.5 * lead * motion.a)
            low, high = bodies.reach_of_walls(s, floor)
            least, most = 0.5 / lead * search.least[s], 0.5 / lead * search.most[s]
            time, pull = _CLEAR * dt, ti.abs(bodies.body[s].pull)
            walls = ti.abs(motion.v) + time * ti.abs(motion.a)
            fall = time * (vec2(0.0, walls) + time * pull)
            fastest = ti.max(ti.abs(least), ti.abs(most)).max()
            ahead = vec2(time * (most - least).norm(), time * fastest + fall.norm())
            if (ahead < search.cells.grid[s].skin).all():
                search.refresh(s, low, high, ahead)
                clear = search.is_clear(s, time, low, high, fall)
            else:
                search.refresh(s, low, high, vec2(0.0))
            # The way that is noted next is that of a shift: a share of the way in 1 s.
            search.note_motion(s, least, most)
        return clear

    @ti.func
    def _shift(self, s, lead):
        """Have positions run another time [s] ahead of the velocities."""
        bodies, search = self.bodies, self.search
        by = lead - bodies.lead[s]
        if bodies.lead[s] > 0.0:
            search.shifted(s, by)
        else:
            search.forget(s)
        bodies.advance_lead(s, lead)
        return by

    @ti.func
    def _fly(self, s, dt, motion):
        """Take all grains over a step in which none of them touches anything."""
        bodies, search = self.bodies, self.search
        self._shift(s, 0.5 * dt)
        back, fore = search.least[s], search.most[s]
        self.move(s, dt)
        self.history.reset(s)
        search.note_motion(s, search.least[s] + back, search.most[s] + fore)
        bodies.floor[s] = motion.x + dt * (motion.v + 0.5 * dt * motion.a)
        self.speed[s] = motion.v + dt * motion.a
        self.substep[s] = self.substep[s] + 1

    @ti.func
    def _take_short_steps(self, s, step, full, motion):
        """Take the grains over a step by short ones; returns the impulse of all [N s]."""
        count, total = self.substeps[s], 0.0
        dt = full / count
        since = dt + self._shift(s, 0.5 * dt)
        x, v = motion.x, motion.v
        for _ in range(count):
            now = Motion(x, v, motion.a)
            numbers = step, self.substep[s]
            impulse = self.step(s, numbers, dt, since, now)
            gain = dt * motion.a + impulse * self.table.recoil[s]
            x, v, total = x + dt * (v + 0.5 * gain), v + gain, total + impulse
            self.substep[s], since = self.substep[s] + 1, dt
        return total


@dataclass(frozen=True)
class Combined(Spheres):
    """Spheres with short steps during contacts, and long steps while all of them fly.

    A step is as long as one of the automaton. If bounds of all speeds exclude a contact, the grains
    fly through it at once; else they take ``substeps`` steps of spheres. The impulse on the
    container is the sum of both. All other parameters are those of ``Spheres``.

    Parameters
    ----------
    substeps : int, default 5
        Steps of spheres in a step with contacts, from 1 to 1000.

    Raises
    ------
    InputError
        A value is out of its range, or ``search`` is not ``"cells"``.
    """

    substeps: int = 5

    label: ClassVar[str] = "combined"
    default_dt: ClassVar[float] = 1e-4

    def __post_init__(self) -> None:
        super().__post_init__()
        whole("substeps", self.substeps, 1, 1000)
        if self.search != "cells":
            raise InputError(
                "search must be 'cells' where grains fly in long steps, which its lists allow, "
                f"got {self.search!r}"
            )

    @property
    def effects(self) -> tuple[str, ...]:
        """Effects that are computed, in words for the report."""
        return (*super().effects, "long flights")

    def safe_step(self) -> float:
        """Step [s] whose short ones resolve the contact of spheres that fell through the box."""
        return self.substeps * super().safe_step()

    @property
    def structure(self) -> Structure:
        """As that of the spheres; substeps is a number."""
        same = super().structure
        return Structure(("combined", same.key), same.sizes)

    def bind(self, table: SceneFields) -> DeviceCombined:
        """The grains on the device, for all scenes of a table."""
        return DeviceCombined(self, table)
