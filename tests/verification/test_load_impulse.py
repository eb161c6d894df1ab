"""A load gives its whole impulse at any step."""

import numpy as np
import pytest

from taichi_dem import (
    CONCRETE,
    ImplicitDashpots,
    Multirate,
    Scene,
    Simulation,
    StepControl,
    Uniform,
    effects,
)
from taichi_dem.kit.allocation import assign
from taichi_dem.mesh.mesh import checked_mesh
from taichi_dem.mesh.tetrahedra import area_vectors
from tests.structures import filled

EPS = np.finfo(float).eps
STEP, STEPS = 7e-7, 40
POINTS = np.array([[0, 0, 0], [0.06, 0.01, 0], [0.01, 0.05, 0], [0.02, 0.01, 0.055]])
MESH = checked_mesh(POINTS, [[0, 1, 2, 3]], {"face": [[1, 2, 3]]})
METHODS = {
    "uniform": Uniform(STEP),
    "solved": ImplicitDashpots(STEP),
    "controlled": Multirate(STEP, 1e-8, control=StepControl()),
}


def pulses():
    """Triangles of 20 ns that push and pull, wherever they fall in steps: times [s] and values."""
    begins = np.arange(2, STEPS - 2, 3) + np.random.default_rng(5).random(12)
    times = (STEP * begins[:, None] + [0.0, 1e-8, 2e-8]).ravel()
    signs = np.where(np.arange(len(begins)) % 3 == 1, -1.0, 0.75)
    return times, (signs[:, None] * [0.0, 1e9, 0.0]).ravel()


def body(loads, method):
    """A free body that does not turn, so that the force keeps its direction."""
    made = Simulation(Scene(MESH, CONCRETE, loads), method)
    assign(made.tables.inertia_inverse, 0.0)
    return made


def pushes(loads, method):
    """Impulse on the body over the area of its face, after each largest step; and its levels."""
    simulation = body(loads, method)
    push = -area_vectors(MESH.points, MESH.groups["face"])[0]
    mass, found, levels = simulation.model.body_mass[0], [], set()
    for step in range(1, STEPS + 1):
        simulation.advance_to(step)
        velocity = simulation.values(simulation.state.velocity)[0]
        found.append(mass * velocity @ push / (push @ push))
        levels.add(int(simulation.values(simulation.state.level)[0]))
    account = simulation.energy_balance.account()
    assert account["load_work"] == pytest.approx(account["kinetic"], rel=1e3 * EPS)
    return np.array(found), levels


def plateau():
    """A pressure that sets in and ends within steps, and stays over many: times [s] and values."""
    return STEP * np.array([1.3, 1.4, 20.3, 20.6]), np.array([0.0, 1e7, 1e7, 0.0])


@pytest.mark.parametrize("history", [pulses, plateau])
@pytest.mark.parametrize("name", METHODS)
def test_no_pulse_is_lost(name, history):
    """The impulse is the area of the history, also where it changes the steps of the body.

    Each step rounds a difference of times to their own rounding.
    """
    times, values = history()
    found, levels = pushes([effects.Pressure("face", values, times)], METHODS[name])
    areas = 0.5 * (values[1:] + values[:-1]) * np.diff(times)
    rounding = 4.0 * len(areas) * times[-1] / np.diff(times).min() * EPS * np.abs(areas).sum()
    assert abs(found[-1] - areas.sum()) < rounding
    if name == "controlled":
        assert len(levels) > 2


@pytest.mark.parametrize("rise", [0.11 * STEP, 6.3 * STEP])
def test_the_gas_gives_the_integral_of_its_pulse_up_to_half_a_step_after_each(rise):
    """By the integrals of a squared cosine and a cosine, for a pulse within a step and over many.

    The last impulse is that of the step that begins before the present: its interval ends half a
    step before.
    """
    peak, ratio, start = 1e9, 2.75, 1.3 * STEP
    gas = effects.GasPressure("face", peak, rise, ratio, start)
    found, _ = pushes(filled("bonds", gas), METHODS["uniform"])
    s = ((np.arange(STEPS) + 0.5) * STEP - start) / rise
    up, down = np.clip(s, 0.0, 1.0), np.clip(s - 1.0, 0.0, ratio)
    wanted = 0.5 * up - np.sin(np.pi * up) / (2.0 * np.pi)
    wanted += 2.0 * ratio / np.pi * np.sin(0.5 * np.pi * down / ratio)
    assert np.abs(found - peak * rise * wanted).max() < 16 * STEPS * EPS * found.max()
