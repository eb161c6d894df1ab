"""The loop a user calls: build, step, watch, record."""

import time

from taichi_dem import runtime
from taichi_dem.ledger import Ledger
from taichi_dem.model import Model
from taichi_dem.state import State
from taichi_dem.step.advance import Advance
from taichi_dem.step.broad_phase import BroadPhase
from taichi_dem.step.contacts import Contacts
from taichi_dem.step.drivers import DRIVERS, Step
from taichi_dem.step.schedule import Schedule
from taichi_dem.timeline import MACRO_TICKS


class Simulation:
    """A scene brought to the device, ready to step."""

    def __init__(self, scene, method, driver="resident"):
        runtime.generation()
        self.scene, self.method = scene, method
        self.model = Model(scene.mesh, scene.material, scene.effects)
        self.state = State(self.model, scene.max_speed)
        self.contacts = Contacts(self.model, self.state) if self.model.has_contact else None
        self.schedule = Schedule(
            self.model,
            self.state,
            self.contacts,
            method.criterion(),
            method.dt0,
            method.uniform,
            method.neighbour == "drifted",
        )
        self.broad_phase = BroadPhase(self.contacts, self.schedule) if self.contacts else None
        self.advance = Advance(self.model, self.state, self.schedule, self.contacts)
        self.step = Step(self.advance, self.schedule, self.contacts)
        self.driver = DRIVERS[driver](self.step)
        self.primed = False
        self.searches = 0
        self.search_seconds = 0.0

    def prime(self):
        self.step.prime()
        if self.contacts:
            self.search()
        self.ledger = Ledger(self.model, self.state, self.advance, self.contacts)
        self.primed = True

    def search(self):
        t = time.perf_counter()
        self.broad_phase.search()
        self.searches += 1
        self.search_seconds += time.perf_counter() - t

    def advance_to(self, macro_steps):
        if not self.primed:
            self.prime()
        end = macro_steps * MACRO_TICKS
        while self.state.tick[None] < end:
            self.driver.run(end)
            if self.contacts and self.contacts.search_due[None]:
                self.search()
            if self.state.bad_body[None] < self.model.body_count:
                raise RuntimeError("bad body %d" % self.state.bad_body[None])
