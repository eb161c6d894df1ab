"""The clock of a run: ticks and seconds, the step of each level, and what decides about levels."""

from typing import Any

import numpy as np
import taichi as ti

from taichi_dem.contact.contacts import Contacts
from taichi_dem.kit.allocation import assign, values
from taichi_dem.kit.types import real
from taichi_dem.methods import Method
from taichi_dem.stability.body_limits import StabilityLimits
from taichi_dem.state.model import Model
from taichi_dem.state.state import State
from taichi_dem.state.tables import Tables
from taichi_dem.state.timeline import MACRO_TICKS, MAX_LEVEL
from taichi_dem.step.sleeping import Sleeping


@ti.data_oriented
class Clock:
    """Time of a run, and the kind of its steps.

    uniform: all bodies share the finest level wanted. finest: finest level present. low: coarsest
    level active now. limits: the ``StabilityLimits`` of the bodies, None where the rule needs none.
    controlled: whether they choose steps. every_bond_acts: whether each that holds does in every
    substep: its impulse then replaces the last one instead of being added to it.
    evaluations: substeps, bodies advanced, bonds and pairs evaluated, those that one step for all
    would have evaluated in the same substeps, and bonds whose laws were called.
    """

    def __init__(self, tables: Tables, state: State, contacts: Contacts | None, method: Method):
        self.tables, self.state, self.contacts = tables, state, contacts
        self.store, self.has_contact = getattr(contacts, "store", None), contacts is not None
        self.has_limits = method.control is not None or method.dashpot == "limited"
        self.limits: Any = None
        if self.has_limits:
            self.limits = StabilityLimits(tables, state, contacts, method)
        self.sleeps = tables.on_demand
        self.sleeping = Sleeping(tables, state) if self.sleeps else None
        self.controlled, self.uniform = method.control is not None, method.uniform
        self.every_bond_acts = self.uniform and not self.controlled and not self.sleeps
        self.step_seconds = ti.field(real, shape=MAX_LEVEL + 1)
        self.low, self.finest = (ti.field(ti.i32, shape=()) for _ in range(2))
        self.evaluations = ti.field(ti.i64, shape=6)

    def upload(self, model: Model, method: Method, sleep: float) -> None:
        """Upload the steps of a method; sleep: see ``Scene``."""
        assign(self.step_seconds, method.dt0 / 2.0 ** np.arange(MAX_LEVEL + 1))
        if self.has_limits:
            self.limits.upload(model, method)
        if self.sleeping is not None:
            self.sleeping.upload(model, sleep)

    @property
    def dt0(self) -> float:
        """Largest step [s]."""
        return float(values(self.step_seconds)[0])

    @property
    def tick_seconds(self) -> float:
        """Seconds of a tick."""
        return self.dt0 / MACRO_TICKS

    @property
    def time_s(self) -> float:
        """Present time [s]."""
        return int(values(self.state.tick)) * self.tick_seconds

    @ti.func
    def pair_step(self, i, j):
        """Time [s] until a pair of bodies is evaluated again: the smaller of their steps."""
        return self.step_seconds[ti.max(self.state.level[i], self.state.level[j])]

    @ti.func
    def own_step(self, i):
        """Step of body i [s]."""
        return self.step_seconds[self.state.level[i]]

    @ti.func
    def elapsed(self, i):
        """Seconds since body i was last advanced."""
        return self.seconds(self.state.tick[None] - self.state.last_tick[i])

    @ti.func
    def seconds(self, tick):
        """Time of a tick [s]."""
        return ti.cast(tick, real) * self.step_seconds[MAX_LEVEL]
