"""Pressures and velocities over time: values, impulse, work and displacement in closed form."""

import warnings

import numpy as np
import pytest
import taichi as ti

from taichi_dem import CONCRETE, ImplicitDashpots, Scene, Simulation, Uniform, effects, simulate
from taichi_dem.kit.allocation import FieldTree
from taichi_dem.loads.history import History
from taichi_dem.mesh.shapes import pair

STEP = 1e-6


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
    probe.history.load(tuple(times), tuple(values))
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
    simulation = Simulation(Scene(pair(), CONCRETE, [drive]), method)
    simulation.start()
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
    scene, said = Scene(pair(), CONCRETE, [pulse]), f"pressure left changes within {share * STEP:g}"
    with warnings.catch_warnings(record=True) as heard:
        warnings.simplefilter("always")
        report = simulate(scene, method=Uniform(STEP), until=STEP, progress=None).report
    for sentences in ([str(one.message) for one in heard], report.needs):
        assert any(said in sentence for sentence in sentences) == told
