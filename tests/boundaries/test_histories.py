"""Pressures and velocities over time: values, impulse, work and displacement in closed form.

A load gives its whole impulse at any step.
"""

import warnings

import numpy as np
import pytest
import taichi as ti

from taichi_dem import (
    CONCRETE,
    ImplicitDashpots,
    Multirate,
    Scene,
    Simulation,
    StepControl,
    Uniform,
    effects,
    simulate,
)
from taichi_dem.kit.allocation import FieldTree, assign
from taichi_dem.loads.history import History
from taichi_dem.mesh.mesh import checked_mesh
from taichi_dem.mesh.shapes import pair, placed_together
from taichi_dem.mesh.tetrahedra import area_vectors
from tests.structures import POST, filled

EPS = np.finfo(float).eps
STEP = 1e-6
PAIR = placed_together({"pair": (pair(), (0.0, 0.0, 0.0))} | POST)


@ti.data_oriented
class Probe:
    """A history on the device."""

    def __init__(self):
        with FieldTree():
            self.history = History()

    @ti.kernel
    def sample(
        self,
        since: ti.types.ndarray(dtype=ti.f64),
        until: ti.types.ndarray(dtype=ti.f64),
        found: ti.types.ndarray(dtype=ti.f64),
    ):
        """Means between some times."""
        for k in range(since.shape[0]):
            found[k] = self.history.mean(since[k], until[k])

    def means(self, since, until):
        """The same, as an array."""
        found = np.zeros(len(since))
        self.sample(since, until, found)
        return found


@pytest.fixture(scope="module")
def probe(taichi_session):
    """One for all counts."""
    return Probe()


@pytest.mark.parametrize("count", [1, 7])
def test_values_are_linear_between_the_points_and_constant_beyond(probe, count):
    """Values at a time, and means over short and long times by the trapezoidal rule in pieces."""
    draw = np.random.default_rng(count)
    times, values = np.cumsum(draw.uniform(0.1, 2.0, count)), draw.normal(size=count)
    asked = np.concatenate([times, draw.uniform(-1.0, times[-1] + 1.0, 200), [0.0, 1e9]])
    probe.history.upload(tuple(times), tuple(values))
    assert np.abs(probe.means(asked, asked) - np.interp(asked, times, values)).max() < 1e-12
    since = draw.uniform(-1.0, times[-1] + 1.0, 50)
    until = since + 10.0 ** draw.uniform(-9.0, 2.0, 50)
    for mean, begin, end in zip(probe.means(since, until), since, until):
        inside = times[(times > begin) & (times < end)]
        t = np.array([0.0, *(inside - begin), end - begin])
        v = np.interp([begin, *inside, end], times, values)
        area = (0.5 * (v[1:] + v[:-1]) * np.diff(t)).sum()
        assert mean == pytest.approx(area / (end - begin), abs=1e-11)


@pytest.mark.parametrize("method", [Uniform(STEP), ImplicitDashpots(STEP)], ids=lambda m: m.name)
def test_a_velocity_that_rises_moves_its_bodies_by_its_integral(method):
    """Positions are a midpoint sum of velocities: exact between points on the grid."""
    rising = [0.0, 10e-6, 30e-6], [0.0, 1.0, -1.0]
    drive = effects.PrescribedMotion("left", (2.0, 0.0, 1.0), history=rising)
    laws = filled("supports", drive, group="post_base")
    simulation = Simulation(Scene(PAIR, CONCRETE, laws), method)
    for steps in (7, 20, 28):
        simulation.advance_to(steps)
        t = steps * STEP
        way = t * t / 20e-6 if t < 10e-6 else 5e-6 + (t - 1e-5) - (t - 1e-5) ** 2 / 20e-6
        gone = simulation.motion()["position"][0] - simulation.model.centre[0]
        assert np.abs(gone - np.array([2.0, 0.0, 1.0]) * way).max() < 1e-15
    account = simulation.energy_balance.account()
    assert abs(account["residual"]) < 0.01 * abs(account["support_work"])


@pytest.mark.parametrize(("share", "told"), [(0.5, True), (2.0, False)])
def test_a_load_that_changes_within_less_than_a_step_is_told_before_and_after(share, told):
    """By name and group, with its time and the step."""
    pulse = effects.Pressure("left", [0.0, 1.0, 0.0], [0.0, share * STEP, 9.0 * STEP])
    scene = Scene(PAIR, CONCRETE, filled("supports", pulse, group="post_base"))
    said = f"pressure left changes within {share * STEP:g}"
    with warnings.catch_warnings(record=True) as heard:
        warnings.simplefilter("always")
        report = simulate(scene, method=Uniform(STEP), until=STEP, progress=None).report
    for sentences in ([str(one.message) for one in heard], report.needs):
        assert any(said in sentence for sentence in sentences) == told


#: A free body, its step [s] and their number.
SHORT, COUNT = 7e-7, 40
POINTS = np.array([[0, 0, 0], [0.06, 0.01, 0], [0.01, 0.05, 0], [0.02, 0.01, 0.055]])
BODY = checked_mesh(POINTS, [[0, 1, 2, 3]], {"face": [[1, 2, 3]]})
MESH = placed_together({"body": (BODY, (0.0, 0.0, 0.0))} | POST)
METHODS = {
    "uniform": Uniform(SHORT),
    "solved": ImplicitDashpots(SHORT),
    "controlled": Multirate(SHORT, 1e-8, control=StepControl()),
}


def pulses():
    """Triangles of 20 ns that push and pull, wherever they fall in steps: times [s] and values."""
    begins = np.arange(2, COUNT - 2, 3) + np.random.default_rng(5).random(12)
    times = (SHORT * begins[:, None] + [0.0, 1e-8, 2e-8]).ravel()
    signs = np.where(np.arange(len(begins)) % 3 == 1, -1.0, 0.75)
    return times, (signs[:, None] * [0.0, 1e9, 0.0]).ravel()


def pushes(load, method):
    """Impulse on the body over the area of its face, after each largest step; and its levels.

    It does not turn, so that the force keeps its direction.
    """
    loads = filled("supports", load, group="post_base")
    simulation = Simulation(Scene(MESH, CONCRETE, loads), method)
    assign(simulation.tables.inertia_inverse, 0.0)
    push = -area_vectors(MESH.points, MESH.groups["face"])[0]
    mass, found, levels = simulation.model.body_mass[0], [], set()
    for step in range(1, COUNT + 1):
        simulation.advance_to(step)
        velocity = simulation.values(simulation.state.velocity)[0]
        found.append(mass * velocity @ push / (push @ push))
        levels.add(int(simulation.values(simulation.state.level)[0]))
    account = simulation.energy_balance.account()
    assert account["load_work"] == pytest.approx(account["kinetic"], rel=1e3 * EPS)
    return np.array(found), levels


def plateau():
    """A pressure that sets in and ends within steps, and stays over many: times [s] and values."""
    return SHORT * np.array([1.3, 1.4, 20.3, 20.6]), np.array([0.0, 1e7, 1e7, 0.0])


@pytest.mark.parametrize("history", [pulses, plateau])
@pytest.mark.parametrize("name", METHODS)
def test_no_pulse_is_lost(name, history):
    """The impulse is the area of the history, also where it changes the steps of the body.

    Each step rounds a difference of times to their own rounding.
    """
    times, values = history()
    found, levels = pushes(effects.Pressure("face", values, times), METHODS[name])
    areas = 0.5 * (values[1:] + values[:-1]) * np.diff(times)
    rounding = 4.0 * len(areas) * times[-1] / np.diff(times).min() * EPS * np.abs(areas).sum()
    assert abs(found[-1] - areas.sum()) < rounding
    if name == "controlled":
        assert len(levels) > 2


@pytest.mark.parametrize("rise", [0.11 * SHORT, 6.3 * SHORT])
def test_the_gas_gives_the_integral_of_its_pulse_up_to_half_a_step_after_each(rise):
    """By the integrals of a squared cosine and a cosine, for a pulse within a step and over many.

    The last impulse is that of the step that begins before the present: its interval ends half a
    step before.
    """
    peak, ratio, start = 1e9, 2.75, 1.3 * SHORT
    gas = effects.GasPressure("face", peak, rise, ratio, start)
    found, _ = pushes(gas, METHODS["uniform"])
    s = ((np.arange(COUNT) + 0.5) * SHORT - start) / rise
    up, down = np.clip(s, 0.0, 1.0), np.clip(s - 1.0, 0.0, ratio)
    wanted = 0.5 * up - np.sin(np.pi * up) / (2.0 * np.pi)
    wanted += 2.0 * ratio / np.pi * np.sin(0.5 * np.pi * down / ratio)
    assert np.abs(found - peak * rise * wanted).max() < 16 * COUNT * EPS * found.max()
