"""A law of a user's own, by whatever name, acts and is accounted for like one of the package."""

import numpy as np
import taichi as ti

from taichi_dem import (
    CONCRETE,
    Scene,
    Simulation,
    Uniform,
    effects,
    step_report,
)
from taichi_dem.laws.base import Effect
from taichi_dem.mesh.shapes import bar, single


@ti.data_oriented
class AirDrag(Effect):
    """Force against the velocity: -rate m v."""

    role = "load"
    name = "air_drag"

    def __init__(self, rate):
        self.rate = rate

    def numbers(self, material):
        """Damping rate [1/s]."""
        return (self.rate,)

    @ti.func
    def acts_on(self, i):
        """Every body."""
        return 1

    @ti.func
    def wrench(self, i, motion):
        """Against the velocity of the centre; none about it."""
        return -self.law[0] * self.tables.mass[i] * motion.velocity, 0.0 * motion.spin


def test_air_drag_is_a_load_of_one_class():
    """v_n = v_0 (1 + rate dt / 2) (1 - rate dt)^n to round-off, half a step before the positions.

    The force is taken at the beginning of a step, and a run begins half a step back.
    """
    rate, steps, speed = 30.0, 50, np.array([2.0, -1.0, 0.5])
    simulation = Simulation(Scene(single(), CONCRETE, [AirDrag(rate)]), Uniform(1e-4))
    simulation.state.set_motion(simulation.model.centre, [[1.0, 0.0, 0.0, 0.0]], [speed])
    simulation.advance_to(steps)
    velocity = simulation.state.motion()["velocity"][0]
    expected = speed * (1.0 + 0.5 * rate * 1e-4) * (1.0 - rate * 1e-4) ** steps
    np.testing.assert_allclose(velocity, expected, rtol=4 * steps * np.finfo(float).eps)
    account = simulation.energy_balance.account()
    assert abs(account["residual"]) < 1e-12 * simulation.energy_balance.start_energy


def renamed(effect):
    """The same law under another name, a class of the user's own."""
    return type("Own", (type(effect),), {"name": "own"})(*vars(effect).get("arguments", ()))


def test_laws_by_other_names_lose_no_criterion_of_the_step_report():
    listed = [effects.BondDamping(), effects.SphereContact(), effects.Friction()]
    mesh = bar(0.2, 0.1, (2, 1, 1))
    known = step_report(Scene(mesh, CONCRETE, listed))
    own = step_report(Scene(mesh, CONCRETE, [renamed(effect) for effect in listed]))
    assert list(own.limits) == list(known.limits) and len(own.limits) == 4
    assert all(np.array_equal(own.limits[name], known.limits[name]) for name in known.limits)
