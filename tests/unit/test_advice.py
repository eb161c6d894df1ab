"""The advice of a diverged run, followed as it is given, leads to a run that ends well."""

from dataclasses import replace

import numpy as np
import pytest

from ca_damper import Automaton, Batch, Combined, SceneTable, Spheres
from ca_damper import SimulationDiverged as DamperDiverged
from taichi_dem import (
    CONCRETE,
    ImplicitDashpots,
    Multirate,
    Scene,
    Simulation,
    SimulationDiverged,
    StepControl,
    Uniform,
    effects,
)
from taichi_dem.mesh.shapes import bar, pair, placed_together, single
from taichi_dem.simulate import run_simulation
from tests.slow import slow_but

#: How often a run may be advised. A step is at least halved, a stiffness raised tenfold.
OFTEN = 6
METHODS = {
    "uniform": Uniform(1e-6),
    "held": Multirate(1e-6, 1e-5),
    "drifted": Multirate(1e-6, 1e-5, "drifted"),
    "controlled": Multirate(1e-6, 1e-5, control=StepControl(safety=1.0), dashpot="limited"),
    "limited": Uniform(2e-5, dashpot="limited"),
    "implicit": ImplicitDashpots(2e-5),
}
#: They share least code; the others compile engines of their own.
QUICK = ("uniform", "implicit")
ALL = [name if name in QUICK else pytest.param(name, marks=pytest.mark.slow) for name in METHODS]
LAWS = (effects.BondDamping(), effects.SphereContact(), effects.Friction())


def followed(error, scene, method):
    """Scene and method with what a diverged run says to try; each must be a change for good."""
    assert len(error.advice) == 1, str(error)
    ((name, value),) = error.advice.items()
    assert f"try a {name} of {value:.2g}" in str(error)
    if name == "step":
        assert value < method.dt0
        return scene, replace(method, **{"dt" if method.solves else "dt0": value})
    if name == "max_speed":
        assert value > scene.max_speed
        return replace(scene, max_speed=value), method
    assert value > scene.material.contact_stiffness
    return replace(scene, material=replace(scene.material, **{name: value})), method


def run(scene, method, until, velocity):
    simulation = Simulation(scene, method, driver="resident")
    simulation.state.set_motion(simulation.model.centre, None, velocity)
    return run_simulation(simulation, until=until, samples=10, progress=None)


def advised(scene, method, until, velocity=0.0):
    """Result and advice of a run that follows what it is told; it must diverge at first."""
    taken = []
    for _ in range(OFTEN + 1):
        try:
            return run(scene, method, until, np.asarray(velocity)), taken
        except SimulationDiverged as error:
            scene, method = followed(error, scene, method)
            taken += error.advice
    raise AssertionError(f"advised {OFTEN} times in vain, at last {method!r}")


def ends_well(result, taken, *names):
    """It was advised of these at least, and the account explains half of what went through."""
    assert taken and set(names) <= set(taken)
    account = dict(result.report.energy_balance)
    residual = account.pop("residual")
    assert abs(residual) <= 0.5 * sum(map(abs, account.values()))
    assert np.isfinite(result.history["kinetic_J"]).all()


def pressed(**options):
    """A bar under gas pressure on its left end."""
    gas = effects.GasPressure("left", peak=1e5, rise=1e-5)
    return Scene(bar(0.1, 0.05, (2, 1, 1)), CONCRETE, [*LAWS, gas], **options)


@pytest.mark.parametrize("name", slow_but(METHODS, "uniform"))
def test_advised_step_of_a_pressed_bar_ends_well(name):
    """Controlled steps find their limits by themselves, whatever the largest step."""
    until = 2e-4
    if name == "controlled":
        assert np.isfinite(
            run(pressed(), METHODS[name], until, 0.0).report.energy_balance["kinetic"]
        )
        return
    ends_well(*advised(pressed(), METHODS[name], until), "step")


@pytest.mark.parametrize("name", slow_but(METHODS, "uniform"))
def test_advised_bound_of_the_speed_ends_well(name):
    method = replace(METHODS[name], **{"dt" if name == "implicit" else "dt0": 1e-8})
    gas = effects.GasPressure("base", peak=1e5, rise=1e-5)
    scene = Scene(single(), CONCRETE, [*LAWS, gas], max_speed=1.0)
    result, taken = advised(scene, method, 1e-6, [30.0, 0.0, 0.0])
    ends_well(result, taken, "max_speed")
    assert set(taken) == {"max_speed"}


def thrown(stiffness):
    """A body that flies at a pair, whose contacts are so stiff [N/m], and velocities [m/s]."""
    soft = replace(CONCRETE, contact_stiffness=stiffness, contact_damping=0.0)
    mesh = placed_together(
        {"flying": (single(), (-1e-4, 0.0, 0.0)), "pair": (pair(), (0.05, 0, 0))}
    )
    gas = effects.GasPressure("base", peak=1.0, rise=1.0)
    velocity = np.outer(np.arange(mesh.body_count) == 0, [50.0, 0.0, 0.0])
    return Scene(mesh, soft, [*LAWS, gas]), velocity


@pytest.mark.parametrize("name", ALL)
def test_advised_stiffness_ends_well(name):
    """Spheres of 5 mm hold 44 J a body only from 1e6 N/m on: six spheres, k (2 mm)^2 / 2 each."""
    scene, velocity = thrown(1e3)
    method = replace(METHODS[name], **{"dt" if name == "implicit" else "dt0": 2e-7})
    ends_well(*advised(scene, method, 2e-3, velocity), "contact_stiffness")


FILLINGS = {
    "automaton": (Automaton(rules="paper", v_max=0.05), 4e-3, 0.03),
    "place": (Automaton(v_max=0.05), 4e-3, 0.03),
    "spheres": (Spheres(), 1e-4, 0.015),
    "combined": (Combined(), 5e-4, 0.015),
}


@pytest.mark.parametrize("name", FILLINGS)
def test_advised_step_of_the_damper_ends_well(name):
    filling, dt, amplitude = FILLINGS[name]
    steps = []
    for _ in range(OFTEN):
        batch = Batch(filling, SceneTable(30, 1, dt, 6.0, amplitude), mount="base")
        batch.start()
        try:
            cycles = batch.run(2, 1)
            break
        except DamperDiverged as error:
            assert error.advice == {"dt": error.dt_allowed} and error.dt_allowed < dt
            dt = error.dt_allowed
            steps.append(dt)
    assert steps and np.isfinite(cycles.record).all()
    assert batch.report().momentum_error < 1e-7
