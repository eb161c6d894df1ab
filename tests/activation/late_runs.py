"""Runs of late scenes, and what acted in them."""

from functools import cache

import numpy as np

from taichi_dem.kit import runtime
from tests.activation.late_scenes import METHOD, late_scene, scene_of, simulation

#: Role of an effect by its name.
NAMES = {
    "tension": "softening",
    "shear": "shear_slip",
    "dashpot": "bond_damping",
    "contact": "sphere_contact",
    "friction": "friction",
}
#: What must have the same bits.
BITS = (
    "position velocity orientation angular_momentum broken_tick bond_heat contact_heat "
    "load_work load_impulse softening_unit shear_slip"
).split()


class Run:
    """A run of a scene or its twin, or a part of it."""

    def __init__(self, name, word, needed=True, method=METHOD, driver="resident", **options):
        self.late = late_scene(name) if needed else late_scene(name).without()
        self.scene = scene_of(late_scene(name), word, needed, **options)
        self.simulation = simulation(self.late, self.scene, method, driver)
        self.before = None
        if self.late.late > 0.0:
            self.simulation.advance_to(int(self.late.late / method.dt0))
            self.before = acting(self.simulation)
        self.simulation.advance_to(round(self.late.until / method.dt0))
        self.fields = {key: f.to_numpy() for key, f in self.simulation.state.fields().items()}
        self.acting = acting(self.simulation)
        self.report = self.simulation.report(brief=True)

    @property
    def way(self):
        """Largest displacement [m]."""
        return np.abs(self.fields["position"] - self.simulation.model.centre).max()


def acting(simulation):
    """Events of the effects that act, by name; friction by what it took.

    Two faces that are pressed on each other slide by roundings, and rub so much.
    """
    report = simulation.report(brief=True)
    pressed = report.energy_balance["sphere_dashpot"] + report.energy_balance["kinetic"]
    found = {}
    for use in report.effect_activity:
        rounding = use.effect == "friction" and use.energy_J <= 1e-9 * pressed
        if use.is_active and not rounding:
            found[use.effect] = use.events
    return found


def run(name, word="auto", needed=True, **options):
    """A run, made once in each Taichi session: its fields end with the session."""
    return _made_in(runtime.session(), name, word, needed, **options)


@cache
def _made_in(_, name, word, needed, **options):
    return Run(name, word, needed, **options)
