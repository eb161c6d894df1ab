"""Waves and supports in bonded bars."""

import numpy as np
import pytest

from cases.closed_forms import LinearBonds
from taichi_dem import CONCRETE, ImplicitDashpots, Scene, Simulation, Uniform, effects
from taichi_dem.mesh.shapes import bar
from taichi_dem.mesh.topology import faces_of_group
from taichi_dem.state.model import Model
from tests.structures import filled

EPS = np.finfo(float).eps
LENGTH, WIDTH, CELLS = 4.0, 0.1, 40
STEP = 1e-6
#: Relative slowness (k h)^2 / 24 of a pulse of 4e-4 s, 0.76 m long, on cells of 0.1 m.
DISPERSION = (2.0 * np.pi * 0.1 / 0.76) ** 2 / 24.0


def axial_stiffness(model):
    """E A of a bar [N]: held at its left, pulled at its right; strain of the middle half."""
    matrix = LinearBonds(model.mesh, CONCRETE).stiffness
    left, _ = faces_of_group(model.mesh, model.topology, "left")
    right, _ = faces_of_group(model.mesh, model.topology, "right")
    free = np.setdiff1d(np.arange(model.body_count), left)
    dof = (6 * free[:, None] + np.arange(6)).ravel()
    load = np.zeros(6 * model.body_count)
    load[6 * right] = 1.0 / len(right)
    moved = np.zeros(6 * model.body_count)
    moved[dof] = np.linalg.solve(matrix[np.ix_(dof, dof)], load[dof])
    # Six bodies a cell: their mean knows nothing of the pattern inside the cell.
    cell = moved[::6].reshape(-1, 6).mean(axis=1)
    quarter = len(cell) // 4
    slope = (cell[-1 - quarter] - cell[quarter]) / (len(cell) - 1 - 2 * quarter)
    return model.mesh.points[:, 0].max() / len(cell) / slope


@pytest.fixture(scope="module")
def wave_speed():
    """Speed of long waves [m/s] from the statics of the same bar."""
    model = Model(bar(LENGTH, WIDTH, (CELLS, 1, 1)), CONCRETE, [])
    per_length = model.body_mass.sum() / LENGTH
    return np.sqrt(axial_stiffness(model) / per_length)


@pytest.fixture(scope="module")
def pulse(wave_speed):
    """Mean axial velocity of cells 10, 25 and of the end, by time, as a pulse of 0.8 m runs by."""
    load = effects.GasPressure("left", peak=1e4, rise=2e-4, decay_ratio=1.0)
    scene = Scene(bar(LENGTH, WIDTH, (CELLS, 1, 1)), CONCRETE, filled("bonds", load))
    simulation = Simulation(scene, Uniform(STEP))
    model = simulation.model
    end, _ = faces_of_group(model.mesh, model.topology, "right")
    steps = np.arange(0, 2600, 10)
    rows = []
    for step in steps.tolist():
        simulation.advance_to(step)
        velocity = simulation.values(simulation.state.velocity)[:, 0]
        rows.append([*velocity.reshape(-1, 6).mean(axis=1)[[10, 25]], velocity[end].mean()])
    return steps * STEP, np.array(rows)


def test_a_wave_runs_as_fast_as_the_static_stiffness_says(pulse, wave_speed):
    """c = sqrt(E A / (m / l)), E A from the statics of the same bonds.

    Delay between two cells where their records agree best. A chain of cells of length h changes
    speed by (k h)^2 / 24 at the wave number k of the pulse.
    """
    time, velocity = pulse
    fine = np.arange(0.0, time[-1], STEP)
    first, second = (np.interp(fine, time, velocity[:, k]) for k in (0, 1))
    likeness = np.correlate(second, first, mode="full")[len(fine) - 1 :]
    speed = 15 * LENGTH / CELLS / (likeness.argmax() * STEP)
    assert speed == pytest.approx(wave_speed, rel=DISPERSION)


def test_a_free_end_doubles_the_velocity(pulse):
    """Twice the peak in the bar, less dispersion, and less what a depth of h / 4 makes of it.

    The bodies at the end have their centres there: the wave and its echo, half that way apart in
    time, add up to 2 cos(k h / 4).
    """
    _, velocity = pulse
    _, second, end = velocity.max(axis=0)
    assert 2.0 * (1.0 - DISPERSION - 24.0 / 32.0 * DISPERSION) < end / second < 2.0 + 2 * DISPERSION


def supported(method):
    """A bar driven at its left, on rollers below, fixed and pushed at its right, after 2e-5 s.

    Returns its model, motion and report.
    """
    held = effects.Fixed("right"), effects.Roller("bottom", (0.0, 2.0, 0.0))
    drive = effects.PrescribedMotion("left", (0.3, 0.0, 0.1), frequency=2e4)
    gas = effects.GasPressure("right", peak=1e6, rise=1e-5)
    listed = filled("supports", effects.BondDamping(), *held, drive, gas, group="right")
    simulation = Simulation(Scene(bar(0.3, 0.1, (3, 1, 1)), CONCRETE, listed), method)
    simulation.advance_to(round(2e-5 / method.dt0))
    return simulation.model, simulation.state.motion(), simulation.report()


@pytest.fixture(scope="module")
def held():
    """The supported bar at two steps."""
    return [supported(Uniform(step)) for step in (2e-8, 1e-8)]


def test_supports_hold_what_they_say(held):
    """Fixed: nothing moves. Roller: no velocity and only spin along the normal. Driven: v cos."""
    model, motion, _ = held[0]
    groups = ("right", "bottom", "left")
    bodies = {name: faces_of_group(model.mesh, model.topology, name)[0] for name in groups}
    right = bodies["right"]
    assert np.array_equal(motion["position"][right], model.centre[right])
    assert np.array_equal(motion["spin"][right], np.zeros((len(right), 3)))
    rolling = np.setdiff1d(bodies["bottom"], np.concatenate([right, bodies["left"]]))
    assert len(rolling)
    assert np.array_equal(motion["velocity"][rolling, 1], np.zeros(len(rolling)))
    spin = motion["spin"][rolling]
    assert np.abs(spin[:, 1]).max() > 0.0
    # The kept momentum is that of the turn at the start of the step; the step turns on by w dt.
    assert np.abs(spin[:, [0, 2]]).max() < 2e-8 * np.abs(spin).max() ** 2
    # Velocities are those of the middle of the last step, at cosines of angles of size 2.
    phase = np.cos(2.0 * np.pi * 2e4 * (2e-5 - 1e-8))
    driven = motion["velocity"][bodies["left"]]
    assert np.abs(driven - phase * np.array([0.3, 0.0, 0.1])).max() < 16 * EPS
    # Midpoint sums of a cosine: the way is exact but for (w dt)^2 / 24.
    rate = 2.0 * np.pi * 2e4
    way = np.sin(rate * 2e-5) / rate * np.array([0.3, 0.0, 0.1])
    moved = motion["position"][bodies["left"]] - model.centre[bodies["left"]]
    assert np.abs(moved - way).max() < (rate * 2e-8) ** 2 / 20 * 0.3 / rate + 1000 * EPS * 0.1


def test_work_and_impulse_of_supports_are_booked(held):
    """The energy balance closes at first order, momentum to sqrt(updates) eps.

    What pushes on what is held still does no work.
    """
    coarse, fine = (report for _, _, report in held)
    assert (
        abs(coarse.energy_balance["support_work"]) > 0.0
        and coarse.energy_balance["load_work"] == 0.0
    )
    ratio = fine.energy_balance["residual"] / coarse.energy_balance["residual"]
    # w dt of the driving and of the fastest dashpot, 0.04: second order is that share of it.
    assert ratio == pytest.approx(0.5, abs=0.02)
    assert coarse.energy_residual_fraction < 0.05
    bound = EPS * np.sqrt(fine.substeps)
    assert fine.linear_momentum_error < bound
    assert fine.angular_momentum_error < bound


def test_solved_dashpots_give_way_to_supports_as_explicit_ones_do(held):
    """To 0.1 % of the largest displacement: explicit ones are extrapolated, of first order.

    Solved ones are of second order: the square of w dt = 0.01 of the driving.
    """
    coarse, fine = (motion["position"] for _, motion, _ in held)
    model, motion, report = supported(ImplicitDashpots(1e-7, sweeps=(2, 200), tolerance=1e-9))
    moved = 2.0 * fine - coarse - model.centre
    error = motion["position"] - model.centre - moved
    assert np.abs(error).max() < 1e-3 * np.abs(moved).max()
    assert report.energy_balance["load_work"] == 0.0 < report.energy_balance["support_work"]
    assert max(report.linear_momentum_error, report.angular_momentum_error) < 1e-12
