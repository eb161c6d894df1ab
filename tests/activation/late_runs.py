"""Runs of late scenes, and what acted in them."""

from functools import cache

import numpy as np

from tests.activation.late_scenes import METHOD, late_scene, scene_of, simulation

#: Role of an effect by its name.
NAMES = {
    "tension": "softening",
    "shear": "shear_slip",
    "dashpot": "bond_damping",
    "contact": "body_contact",
    "friction": "sticking_friction",
}
#: What must have the same bits.
BITS = (
    "position velocity orientation angular_momentum broken_tick bond_heat contact_heat "
    "load_work load_impulse softening_unit shear_slip_slip"
).split()


class Run:
    """What is left of a run of a scene or its twin, whose engine goes on to others.

    before: what acted before the effect may. since: of each bond and part of its law; evaluated: of
    each bond. misses: what the audit of sleep found.
    """

    def __init__(self, name, word, needed=True, method=METHOD, driver="resident", **options):
        self.late = late_scene(name) if needed else late_scene(name).without()
        self.scene = scene_of(late_scene(name), word, needed, **options)
        made = simulation(self.late, self.scene, method, driver)
        self.before = None
        if self.late.late > 0.0:
            made.advance_to(int(self.late.late / method.dt0))
            self.before = acting(made)
        made.advance_to(round(self.late.until / method.dt0))
        self.fields = {key: made.values(field) for key, field in made.state.fields().items()}
        self.acting, self.report = acting(made), made.report(brief=True)
        self.moved = self.fields["position"] - made.model.centre
        self.start_energy, self.evaluations = made.energy_balance.start_energy, made.evaluations()
        if word == "auto":
            activity = made.state.activity
            self.since, self.evaluated = map(made.values, (activity.since, activity.evaluated))
            self.misses = int(made.values(made.step.audit.misses))

    @property
    def way(self):
        """Largest displacement [m]."""
        return np.abs(self.moved).max()


def acting(simulation):
    """Events of the effects that act, by name; friction by what it took.

    Two faces that are pressed on each other slide by roundings, and rub so much.
    """
    report = simulation.report(brief=True)
    pressed = report.energy_balance["sphere_dashpot"] + report.energy_balance["kinetic"]
    found = {}
    for use in report.effect_activity:
        rounding = use.effect == NAMES["friction"] and use.energy_J <= 1e-9 * pressed
        if use.is_active and not rounding:
            found[use.effect] = use.events
    return found


@cache
def run(name, word="auto", needed=True, **options):
    """A run, made once."""
    return Run(name, word, needed, **options)
