"""Waves leave through a quiet boundary; its dashpots are exact, stable at any step, and booked."""

from dataclasses import replace

import numpy as np
import pytest

from cases.closed_forms import carried
from cases.meshes import with_moved_nodes
from taichi_dem import CONCRETE, ImplicitDashpots, Scene, Simulation, Uniform, effects, simulate
from taichi_dem.elasticity.rates import wave_moduli
from taichi_dem.mesh.shapes import bar, placed_together, single
from taichi_dem.state.model import Model
from tests.structures import POST, filled

#: Concrete whose bonds have no dashpots, so that no wave fades.
UNDAMPED = replace(CONCRETE, normal_damping=0.0, shear_damping=0.0)
#: Groups of a bar's sides, and the directions that they cannot move in for plane waves along x.
SIDES = {"bottom": (0, 1, 0), "top": (0, 1, 0), "back": (0, 0, 1), "front": (0, 0, 1)}
QUIET = (effects.QuietBoundary("left"), effects.QuietBoundary("right"))


def perturbed(mesh, share, seed):
    """Nodes moved by up to a share of the shortest edge along each axis, outer ones in plane."""
    corners = mesh.points[mesh.tetrahedra]
    edges = corners[:, [0, 0, 0, 1, 1, 2]] - corners[:, [1, 2, 3, 2, 3, 3]]
    return with_moved_nodes(mesh, share * np.linalg.norm(edges, axis=2).min(), seed)


def plane_bar(boxes, across=2, share=0.0, seed=1):
    """A bar of 1 m of cubic boxes, across by across of them, with nodes moved by a share."""
    mesh = bar(1.0, across / boxes, (boxes, across, across))
    return perturbed(mesh, share, seed) if share else mesh


def rollers():
    """Supports of the sides, for plane waves."""
    return [effects.Roller(name, normal) for name, normal in SIDES.items()]


def with_pulse(mesh, listed, method=None, way=(1.0, 0.0, 0.0), width=0.1):
    """A simulation that begins with velocities exp(-((x - 1/2) / width)^2) [m/s] along a way.

    Half of the energy goes to either end.
    """
    simulation = Simulation(Scene(mesh, UNDAMPED, listed), method or Uniform(2e-7))
    x = simulation.model.centre[:, 0]
    velocity = np.exp(-(((x - 0.5) / width) ** 2))[:, None] * np.array(way)
    simulation.state.set_motion(simulation.model.centre, velocity=velocity)
    simulation.start()
    return simulation


def advanced(simulation, time_s):
    """Go on to a time [s]; the account."""
    simulation.advance_to(round(time_s / simulation.method.dt0))
    return simulation.energy_balance.account()


def share_left(simulation, time_s):
    """Share of the energy at the start that the bodies hold at a time [s]."""
    account = advanced(simulation, time_s)
    return (account["kinetic"] + account["bond_strain"]) / simulation.energy_balance.start_energy


TWIST = np.array([1e-6, -2e-6, 5e-7, 2e-5, 1e-5, -3e-5])


def braked_body(speeds, method, steps):
    """Twists of a single body on a quiet boundary after some steps, and the matrices M and C."""
    mesh = placed_together({"body": (single(), (0.0, 0.0, 0.0))} | POST)
    quiet = effects.QuietBoundary("body_base", *speeds)
    scene = Scene(mesh, CONCRETE, filled("supports", quiet, group="post_base"))
    simulation = Simulation(scene, method)
    model = simulation.model
    moves = np.array([[1.0], [0.0]])
    simulation.state.set_motion(model.centre, velocity=moves * TWIST[:3], spin=moves * TWIST[3:])
    simulation.start()
    simulation.advance_to(steps)
    motion = simulation.motion()
    mass = np.zeros((6, 6))
    mass[:3, :3], mass[3:, 3:] = model.body_mass[0] * np.eye(3), model.body_inertia[0]
    corners = model.mesh.points[model.mesh.groups["body_base"][0]]
    vector = 0.5 * np.cross(corners[1] - corners[0], corners[2] - corners[0])
    area = np.linalg.norm(vector)
    out = np.outer(vector, vector) / area**2
    law = CONCRETE.density * (speeds[0] * out + speeds[1] * (np.eye(3) - out))
    levers = [carried(corner - model.centre[0]) for corner in corners]
    block = sum(area / 3.0 * lever.T @ law @ lever for lever in levers)
    return np.append(motion["velocity"][0], motion["spin"][0]), mass, block, simulation


@pytest.mark.parametrize("method", [Uniform(2e-6), ImplicitDashpots(2e-6)], ids=lambda m: m.name)
def test_a_body_alone_slows_down_by_the_trapezoidal_rule(method):
    """(M + dt C / 2) u' = (M - dt C / 2) u, and half a step at either end: u is what is recorded.

    Recorded is the mean of before and after: u_n = (1 + Z)^-1 (1 - Z) u_n-1, Z = M^-1 C dt / 2.
    Turning couples at second order in the spin alone, 3e-5 x 2e-5 s here: 1e-8 of the twist.
    """
    found, mass, block, simulation = braked_body((4000.0, 2500.0), method, 20)
    half = np.linalg.solve(mass, block) * 1e-6
    once = np.linalg.solve(np.eye(6) + half, np.eye(6) - half)
    assert np.abs(found - np.linalg.matrix_power(once, 20) @ TWIST).max() < 1e-7 * 3e-5
    account = simulation.energy_balance.account()
    assert abs(account["residual"]) < 1e-13 * simulation.energy_balance.start_energy
    assert account["ground_dashpot"] > 0.1 * simulation.energy_balance.start_energy
    assert max(simulation.energy_balance.momentum_errors()) < 1e-12


def test_the_error_of_a_step_is_of_second_order():
    """Against exp(-M^-1 C t): a quarter at half the step, within the next order's 15 %."""
    errors = []
    for step, steps in ((4e-6, 10), (2e-6, 20)):
        found, mass, block = braked_body((1000.0, 600.0), Uniform(step), steps)[:3]
        values, vectors = np.linalg.eig(np.linalg.solve(mass, block))
        exact = (vectors * np.exp(-4e-5 * values)) @ np.linalg.solve(vectors, TWIST)
        errors.append(np.abs(found - exact).max())
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.15)


@pytest.mark.parametrize(("boxes", "share"), [(20, 0.0), (30, 0.25)])
def test_a_plane_wave_leaves_no_more_than_5_percent_of_its_energy(boxes, share):
    """After 1.2 of the time in which a wave runs through the bar, all of it has met an end once.

    Expected: the impedance is right within 15 % (``wave_moduli``), which reflects 0.6 %; waves as
    short as a few elements, of which a Gaussian of 0.1 m has fewer the finer the mesh, come late.
    """
    simulation = with_pulse(plane_bar(boxes, 2, share), [*rollers(), *QUIET])
    model = simulation.model
    moduli, _ = wave_moduli(model, model.mesh.groups["right"])
    speed = np.sqrt(moduli.mean() / model.material.density)
    left = share_left(simulation, 1.2 / speed)
    assert left < 0.05


def test_a_shear_wave_leaves_too():
    """Polarised along y, with rollers along z alone and free sides: a bar two boxes thick bends.

    So the block is one of sides that move along y together: rollers hold x and z.
    """
    sides = [effects.Roller(name, (1, 0, 0)) for name in ("bottom", "top")]
    sides += [effects.Roller(name, (0, 0, 1)) for name in ("back", "front")]
    simulation = with_pulse(plane_bar(30), [*sides, *QUIET], way=(0.0, 1.0, 0.0))
    model = simulation.model
    _, moduli = wave_moduli(model, model.mesh.groups["right"])
    left = share_left(simulation, 1.4 / np.sqrt(moduli.mean() / model.material.density))
    assert left < 0.05


def test_no_dashpot_is_too_stiff_for_a_step():
    """A hundred thousand times the wave's impedance holds the ends as if they were fixed.

    The energy never grows, as the trapezoidal rule takes some in every step, beside the ripple of
    a leapfrog near its limit: (w dt)^2 / 4 of it at most.
    """
    stiff = [effects.QuietBoundary(group, 1e8, 1e8) for group in ("left", "right")]
    simulation = with_pulse(plane_bar(8), [*rollers(), *stiff], Uniform(2e-6))
    for step in range(20, 420, 20):
        account = advanced(simulation, step * 2e-6)
        held = account["kinetic"] + account["bond_strain"]
        assert held < 1.25 * simulation.energy_balance.start_energy
    assert np.isfinite(simulation.motion()["velocity"]).all()
    assert max(simulation.energy_balance.momentum_errors()) < 1e-10


def test_the_record_tells_what_each_boundary_takes():
    """Of a pulse near the left end, half of it first; columns add up to what both have taken."""
    mesh = plane_bar(20)
    moduli, _ = wave_moduli(Model(mesh, UNDAMPED, []), mesh.groups["right"])
    speed = np.sqrt(moduli.mean() / UNDAMPED.density)
    x = mesh.points[mesh.tetrahedra].mean(axis=1)[:, 0]
    moves = np.exp(-(((x - 0.3) / 0.1) ** 2))[:, None] * np.array([1.0, 0.0, 0.0])
    scene = Scene(mesh, UNDAMPED, [*rollers(), *QUIET], velocity=moves)
    result = simulate(scene, method=Uniform(2e-7), until=1.0 / speed, samples=2)
    names = [*result.report.effects][-2:]
    assert names == ["quiet_boundary left", "quiet_boundary right"]
    assert {*names} <= {*result.effects["effect"]}
    left, right = (result.series[f"quiet_boundary_{side}_J"] for side in ("left", "right"))
    assert left + right == pytest.approx(result.series["ground_dashpot_J"], rel=1e-12, abs=1e-12)
    energy = result.series["kinetic_J"][0]
    # Half way through the bar, and all the way.
    assert right[1] < 1e-3 * energy < 0.4 * energy < left[1]
    assert right[2] > 0.4 * energy
