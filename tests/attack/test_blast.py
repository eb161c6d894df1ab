"""Blast: random scenes obey the symmetries and balances of mechanics, and have the same bits."""

import numpy as np
import pytest

from taichi_dem import (
    CONCRETE,
    Checkpoint,
    ImplicitDashpots,
    Multirate,
    Scene,
    Simulation,
    Uniform,
    effects,
    runtime,
    simulate,
)
from taichi_dem.mesh.mesh import checked_mesh
from taichi_dem.mesh.shapes import bar
from tests import arch
from tests.turns import matrix, quaternion

ATTACKS = "blast: symmetry, momentum, restart, threads"

EPS = np.finfo(float).eps
#: Largest coordinate of a mesh [m].
REACH = 1.0


def placed(mesh, change, shift):
    """A mesh turned or mirrored by an orthogonal matrix, and shifted [m]."""
    tetrahedra = mesh.tetrahedra.copy()
    if np.linalg.det(change) < 0.0:
        tetrahedra[:, [2, 3]] = tetrahedra[:, [3, 2]]
    return checked_mesh(mesh.points @ change.T + shift, tetrahedra, mesh.groups)


def drawn_change(rng):
    """A random orthogonal matrix, in every second case one with a mirror."""
    turn = matrix(quaternion(rng.standard_normal(3), rng.uniform(0.0, np.pi)))
    return turn @ np.diag([1.0, 1.0, rng.choice([-1.0, 1.0])])


def drawn_method(rng, distance=1e-5):
    """One of the methods, at a step that small bars of concrete bear."""
    return (
        Uniform(2e-8),
        Multirate(4e-8, distance),
        Multirate(4e-8, distance, "drifted"),
        ImplicitDashpots(2e-7),
    )[rng.integers(4)]


def drawn_contact(rng):
    """Contact of either kind, and friction of either kind."""
    contact = (effects.SphereContact, effects.FaceContact)[rng.integers(2)]
    return contact(), (effects.Friction, effects.StickingFriction)[rng.integers(2)]()


def moved(mesh, method, peak, acceleration, steps):
    """Displacements and velocities after some steps of a damped bar with gas and weight."""
    gas = effects.GasPressure("left", peak=peak, rise=1e-5)
    listed = [effects.BondDamping(), gas, effects.Gravity(acceleration)]
    simulation = Simulation(Scene(mesh, CONCRETE, listed), method)
    simulation.advance_to(steps)
    motion = simulation.state.motion()
    return motion["position"] - simulation.model.centre, motion["velocity"]


def test_a_turned_mirrored_and_shifted_bar_moves_alike(seed):
    """Coordinates of up to 1 m are rounded by eps at every step, and each adds to the displacement.

    Dashpots spread such an error over the bar and damp it. Velocities are known to that error
    times the fastest rate of a spring, 1e6 / s.
    """
    rng = np.random.default_rng(seed)
    mesh = bar(0.2, 0.1, (2, 1, 1))
    change, shift = drawn_change(rng), rng.uniform(-0.5, 0.5, 3)
    peak, weight, steps = 10.0 ** rng.uniform(6, 8), rng.uniform(-50, 50, 3), 300
    method = Uniform(2e-8)
    place, speed = moved(mesh, method, peak, weight, steps)
    turned = placed(mesh, change, shift)
    assert np.abs(turned.points).max() <= REACH
    other = moved(turned, method, peak, change @ weight, steps)
    error = steps * EPS * REACH
    assert np.abs(place).max() > 1e4 * error
    assert np.abs(other[0] @ change - place).max() < error
    assert np.abs(other[1] @ change - speed).max() < 1e6 * error


def flung(rng, method, *more):
    """A bar of which all bodies are thrown apart at random, so that it breaks."""
    listed = [effects.BondDamping(), effects.Softening(), effects.ShearSlip(), *more]
    simulation = Simulation(Scene(bar(0.1, 0.05, (2, 1, 1)), CONCRETE, listed), method)
    count = simulation.model.body_count
    speed = rng.normal(0.0, 10.0 ** rng.uniform(0.0, 1.5), (count, 3))
    simulation.state.set_motion(simulation.model.centre, [[1.0, 0.0, 0.0, 0.0]], speed)
    return simulation


@pytest.mark.slow
def test_momentum_is_kept_while_a_bar_flies_apart(seed):
    """Pair impulses cancel bit for bit; each update rounds a body's momentum by eps of it."""
    rng = np.random.default_rng(seed)
    simulation = flung(rng, drawn_method(rng), *drawn_contact(rng))
    simulation.advance_to(200)
    report = simulation.report()
    assert report.bond_evaluations > 0
    bound = EPS * report.body_updates / report.body_count
    assert report.linear_momentum_error < bound
    assert report.angular_momentum_error < bound


@pytest.mark.slow
def test_a_run_goes_on_from_any_time_to_the_same_bits(seed, tmp_path):
    rng = np.random.default_rng(seed)
    method, last = drawn_method(rng), 24
    gas = effects.GasPressure("left", peak=10.0 ** rng.uniform(7, 10), rise=1e-6)
    scene = Scene(bar(0.1, 0.05, (2, 1, 1)), CONCRETE, [effects.BondDamping(), gas])
    looks = {"method": method, "progress": None, "samples": 6, "frames": 2}
    until = last * method.dt0
    whole = simulate(scene, until=until, **looks)
    path, stop = tmp_path / "run.npz", int(rng.integers(1, last))
    simulate(scene, until=stop * method.dt0, checkpoint=Checkpoint(path), **looks)
    rest = simulate(scene, until=until, resume=path, **looks)
    for name, array in vars(whole.frames[-1]).items():
        assert np.asarray(vars(rest.frames[-1])[name]).tobytes() == np.asarray(array).tobytes()
    for name, column in whole.history.items():
        assert rest.history[name][-1].tobytes() == column[-1].tobytes(), name
    assert rest.report.body_updates == whole.report.body_updates


@pytest.mark.slow
def test_threads_and_drivers_give_the_same_bits(seed):
    """A bar that breaks, by the resident driver, and in parallel on as many threads as drawn."""
    found = []
    for threads in (2, int(np.random.default_rng(seed).integers(1, 6))):
        rng = np.random.default_rng(seed)
        rng.integers(1, 6)
        if runtime.settings() is None or runtime.settings().threads != threads:
            runtime.stop()
            runtime.start(arch.chosen(), threads=threads)
        method, contact = drawn_method(rng), drawn_contact(rng)
        simulation = flung(rng, method, *contact)
        drivers = "resident", "parallel"
        simulation.driver = simulation._driver(drivers[len(found)])
        simulation.advance_to(60)
        motion = simulation.state.motion().values()
        found.append([array.tobytes() for array in motion])
    runtime.stop()
    runtime.start(arch.chosen(), threads=2)
    assert found[0] == found[1]
