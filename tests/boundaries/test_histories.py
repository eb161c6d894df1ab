"""Pressures and velocities over time: values, impulse, work and displacement in closed form."""

import numpy as np
import pytest
import taichi as ti

from taichi_dem import CONCRETE, ImplicitDashpots, InputError, Scene, Simulation, Uniform, effects
from taichi_dem.effects.history import MOST_POINTS, History
from taichi_dem.mesh.face_groups import with_inner_group
from taichi_dem.mesh.shapes import bar, pair, single
from taichi_dem.mesh.tetrahedra import area_vectors

STEP = 1e-6


@ti.data_oriented
class Probe:
    """A history on the device."""

    def __init__(self):
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


@pytest.mark.parametrize("count", [1, 2, 3, 7, MOST_POINTS])
def test_values_are_linear_between_the_points_and_constant_beyond(count):
    """Values at a time, and means over short and long times by the trapezoidal rule in pieces."""
    draw = np.random.default_rng(count)
    times, values = np.cumsum(draw.uniform(0.1, 2.0, count)), draw.normal(size=count)
    asked = np.concatenate([times, draw.uniform(-1.0, times[-1] + 1.0, 200), [0.0, 1e9]])
    probe = Probe()
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


def moved(mesh, listed, steps, method=None, **options):
    """A simulation after some steps, and its account."""
    simulation = Simulation(Scene(mesh, CONCRETE, listed, **options), method or Uniform(STEP))
    simulation.start()
    simulation.advance_to(steps)
    return simulation, simulation.energy_balance.account()


def pushed_by(simulation):
    """Velocity of body 0 along the inward normal of its base, over area / mass."""
    mesh = simulation.model.mesh
    vector = area_vectors(mesh.points, mesh.groups["base"])[0]
    velocity = simulation.motion()["velocity"][0]
    along = -velocity @ vector / (vector @ vector)
    assert np.abs(velocity + along * vector).max() < 1e-12 * np.abs(velocity).max()
    return along * simulation.model.body_mass[0]


HISTORIES = {
    "constant": (effects.Pressure("base", 3e5), 3e5 * 40e-6),
    "triangle": (effects.Pressure.triangle("base", 2e6, 10e-6, 20e-6), 0.5 * 2e6 * 30e-6),
    "at once": (effects.Pressure.triangle("base", 2e6, 0.0, 20e-6), 0.5 * 2e6 * 20e-6),
    "pull": (effects.Pressure("base", [0.0, -1e6], [10e-6, 30e-6]), -1e6 * 20e-6),
}


@pytest.mark.parametrize("name", HISTORIES)
def test_the_impulse_of_a_pressure_is_its_integral(name):
    """Recorded velocities are a trapezoidal sum of forces, exact between points on the grid.

    The work is the kinetic energy: the base's centre is in line with the body's.
    """
    load, integral = HISTORIES[name]
    simulation, account = moved(single(), [load], 40)
    assert pushed_by(simulation) == pytest.approx(integral, rel=1e-9)
    assert account["load_work"] == pytest.approx(account["kinetic"], rel=1e-9)
    assert max(simulation.energy_balance.momentum_errors()) < 1e-12


def test_both_sides_of_an_open_notch_are_pushed_apart():
    """Each body gets p A t; together nothing."""
    mesh = with_inner_group(pair(), "notch", lambda x: x[:, 0] < 1.0)
    simulation, _ = moved(mesh, [effects.Pressure("notch", 1e5)], 20, unbonded=["notch"])
    velocity, mass = simulation.motion()["velocity"], simulation.model.body_mass
    area = np.linalg.norm(area_vectors(mesh.points, mesh.groups["notch"])[0])
    assert np.abs(velocity[:, 0] * mass - [-1e5 * area * 2e-5, 1e5 * area * 2e-5]).max() < 1e-9


RAMPS = {
    "ramp": ({"ramp": 20e-6}, lambda t: np.where(t < 20e-6, t * t / 40e-6, t - 10e-6)),
    "history": (
        {"history": ([0.0, 10e-6, 30e-6], [0.0, 1.0, -1.0])},
        lambda t: np.where(t < 10e-6, t * t / 20e-6, 5e-6 + (t - 1e-5) - (t - 1e-5) ** 2 / 20e-6),
    ),
}


@pytest.mark.parametrize("name", RAMPS)
@pytest.mark.parametrize("method", [Uniform(STEP), ImplicitDashpots(STEP)])
def test_a_velocity_that_rises_moves_its_bodies_by_its_integral(name, method):
    """Positions are a midpoint sum of velocities: exact between points on the grid."""
    options, way = RAMPS[name]
    drive = effects.PrescribedMotion("left", (2.0, 0.0, 1.0), **options)
    simulation = Simulation(Scene(pair(), CONCRETE, [drive]), method)
    simulation.start()
    for steps in (7, 20, 28):
        simulation.advance_to(steps)
        gone = simulation.motion()["position"][0] - simulation.model.centre[0]
        assert np.abs(gone - np.array([2.0, 0.0, 1.0]) * way(steps * STEP)).max() < 1e-15
    account = simulation.energy_balance.account()
    given = account["support_work"]
    assert abs(account["residual"]) < 0.01 * abs(given)


@pytest.mark.parametrize(
    ("options", "low", "high"),
    [
        ({}, 0.0, np.inf),
        ({"ramp": 1e-3}, 0.0, np.inf),
        ({"history": ([0, 1, 2], [0, 1, 0])}, 0.0, 2.0),
        ({"history": ([0, 1, 2, 3], [0, 1, 0, -1])}, -np.inf, 2.0),
        ({"frequency": 1.0 / (2.0 * np.pi)}, -2.0, 2.0),
        ({"frequency": 1.0 / (2.0 * np.pi), "ramp": 1.0}, -4.0, 4.0),
    ],
)
def test_the_travel_of_a_motion_bounds_its_displacement(options, low, high):
    """By integrals of 2 m/s; with a sine by (largest share + variation) / angular frequency."""
    drive = effects.PrescribedMotion("left", (2.0, 0.0, -2.0), **options)
    (x0, y0, z0), (x1, y1, z1) = drive.travel()
    assert (x0, x1) == pytest.approx((low, high))
    assert (y0, y1) == (0.0, 0.0) and (z0, z1) == pytest.approx((-high, -low))


def test_motions_of_other_histories_must_not_share_bodies():

    mesh, one = bar(0.1, 0.1, (1, 1, 1)), (1.0, 0.0, 0.0)
    two = [effects.PrescribedMotion(name, one, ramp=t) for name, t in (("left", 1.0), ("top", 2.0))]
    with pytest.raises(InputError, match="must not share bodies"):
        Simulation(Scene(mesh, CONCRETE, two), Uniform(STEP))
    same = [effects.PrescribedMotion(name, one, ramp=1.0) for name in ("left", "top")]
    Simulation(Scene(mesh, CONCRETE, same), Uniform(STEP))


@pytest.mark.slow
def test_plane_strain_by_rollers_on_two_faces():
    """Bodies on both faces keep their z to the bit, and the block contracts more along y.

    By nu / (1 - nu) instead of nu of the elongation, as it cannot contract along z.
    """
    mesh, thinner = bar(0.2, 0.1, (4, 2, 2)), []
    drive = effects.PrescribedMotion("right", (0.1, 0.0, 0.0), ramp=4e-4)
    for plane in (True, False):
        held = [effects.Roller("left", (1, 0, 0)), drive, effects.BondDamping()]
        sides = [effects.Roller(name, (0, 0, 1)) for name in ("back", "front")]
        kept = sides if plane else [effects.Roller("left", (1, 0, 0))] * 2
        simulation, _ = moved(mesh, [*held, *kept], 400, ImplicitDashpots(STEP))
        gone = simulation.motion()["position"] - simulation.model.centre
        rows = np.abs(simulation.model.centre[:, 0] - 0.1) < 0.03
        y = simulation.model.centre[rows, 1] - 0.05
        thinner.append(-(gone[rows, 1] * y).sum() / (y * y).sum())
        if plane:
            on = np.isin(mesh.tetrahedra, np.unique([mesh.groups["back"], mesh.groups["front"]]))
            faces = on.sum(axis=1) >= 3
            assert faces.any() and np.all(gone[faces, 2] == 0.0)
    assert thinner[0] > 1.02 * thinner[1] > 0.0
