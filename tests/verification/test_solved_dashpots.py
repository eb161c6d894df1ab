"""Dashpots solved together: exact recurrence, momentum, energy, and the same bits."""

import numpy as np
import pytest

from taichi_dem import CONCRETE, ImplicitDashpots, Scene, Simulation, Uniform, effects
from taichi_dem.mesh_shapes import bar, pair
from tests.scenes import brisk_scene

EPS = np.finfo(float).eps
STILL = [1.0, 0.0, 0.0, 0.0]
#: Tight enough that the sweeps add nothing to what is measured.
TIGHT = {"sweeps": (2, 200), "tolerance": 1e-12}


def parting(method):
    """A mirror-symmetric bonded pair whose bodies move apart along the normal."""
    simulation = Simulation(Scene(pair(), CONCRETE, [effects.BondDamping()]), method)
    velocity = 1e-3 * np.array([[-0.5, 0.0, 0.0], [0.5, 0.0, 0.0]])
    simulation.state.place(simulation.model.centre, np.tile(STILL, (2, 1)), velocity)
    return simulation


def coefficients(simulation):
    """Mass of a body [kg], damping [N s/m] and stiffness [N/m] of its bond."""
    area = 3.0 * simulation.model.unit_area[0]
    mass = simulation.model.body_mass[0]
    return mass, CONCRETE.normal_damping * area, CONCRETE.normal_stiffness * area


@pytest.mark.parametrize("theta", [0.5, 0.7, 1.0])
def test_overdamped_pair_follows_the_schemes_recurrence(theta):
    """v' = v - (2 dt / m) (k u + c (theta v' + (1 - theta) v)), u' = u + dt v'.

    The step is four times what explicit dashpots bear. The normal mode is one equation, so a
    visit solves it: what is left is round-off, of positions 0.02 m from the origin.
    """
    dt, steps = 6e-6, 40
    simulation = parting(ImplicitDashpots(dt, theta=theta, **TIGHT))
    mass, damping, stiffness = coefficients(simulation)
    assert dt > 4.0 * mass / damping
    opening, speed = 0.0, 1e-3
    for _ in range(steps):
        kept = mass - 2.0 * dt * damping * (1.0 - theta)
        speed = (kept * speed - 2.0 * dt * stiffness * opening) / (
            mass + 2.0 * dt * damping * theta
        )
        opening += dt * speed
    simulation.advance_to(steps)
    place, rest = simulation.state.position, np.diff(simulation.model.centre[:, 0])[0]
    found = place[1][0] - place[0][0] - rest
    assert abs(found - opening) < steps * 4 * 0.02 * EPS


@pytest.fixture(scope="module")
def brisk():
    """The brisk block to 3e-5 s, past many breaks and contacts."""
    simulation = Simulation(brisk_scene(), ImplicitDashpots(2e-7))
    simulation.advance_to(150)
    return simulation


def test_momentum_is_kept_through_fracture_and_contact(brisk):
    """As in the explicit methods: sqrt(updates) eps of all that was exchanged."""
    report = brisk.report()
    assert report.broken_faces > 30 and report.pair_evaluations > 1000
    bound = EPS * np.sqrt(report.body_updates / report.body_count * 20)
    assert report.linear_momentum_error < bound
    assert report.angular_momentum_error < bound


def test_ledger_closes_to_the_power_of_half_a_step(brisk):
    """Strain is that of positions half a step after the velocities: power of the gas times dt / 2.

    The mean power is the work over the time; it grows, and twice the mean bounds it here.
    """
    report = brisk.report()
    bound = 2.0 * 0.5 * 2e-7 / report.until_s
    assert report.ledger_residual_fraction < bound


FIELDS = ("position", "velocity", "orientation", "angular_momentum", "broken_tick", "bond_heat")


def bits(simulation):
    """Bits of what a run says about bodies and bonds."""
    return {name: simulation.state.fields()[name].to_numpy().tobytes() for name in FIELDS}


@pytest.mark.parametrize(
    ("driver", "options"), [("parallel", {}), ("resident", {"skin": 2e-4}), ("resident", {})]
)
def test_driver_skin_and_rerun_change_no_bit(brisk, driver, options):
    """Colours leave the order within them open, and are those of what touches, whatever is near."""
    other = Simulation(brisk_scene(**options), ImplicitDashpots(2e-7), driver)
    other.advance_to(150)
    assert other.report().broken_faces > 30
    assert bits(other) == bits(brisk)


def test_a_free_bar_agrees_with_tiny_explicit_steps():
    """A stretched damped bar let go: displacements to 0.1 % of the largest, at 50 times the step.

    Second order: (w dt)^2 / 24 of the fastest spring, 2e-6 s, is 7e-4; the explicit reference is of
    first order in its dashpots, dt k / c, 1e-4.
    """
    scene = Scene(bar(0.4, 0.1, (4, 1, 1)), CONCRETE, [effects.BondDamping()])
    moved = []
    for method, steps in ((ImplicitDashpots(2.5e-7, **TIGHT), 400), (Uniform(5e-9), 20000)):
        simulation = Simulation(scene, method)
        place = simulation.model.centre.copy()
        place[:, 0] *= 1.0 + 1e-5
        simulation.state.place(place, np.tile(STILL, (len(place), 1)))
        simulation.advance_to(steps)
        moved.append(simulation.state.motion()["position"] - simulation.model.centre)
    assert np.abs(moved[0] - moved[1]).max() < 1e-3 * np.abs(moved[1]).max()


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"dt": 0.0}, ("dt", "0")),
        ({"dt": float("nan")}, ("dt", "nan")),
        ({"sweeps": 3}, ("sweeps", "3", "from 1 to 1000")),
        ({"sweeps": (5, 2)}, ("sweeps", "(5, 2)")),
        ({"sweeps": (0, 2)}, ("sweeps", "(0, 2)")),
        ({"tolerance": -1.0}, ("tolerance", "-1")),
        ({"theta": 0.4}, ("theta", "0.5 to 1", "0.4")),
        ({"theta": 1.1}, ("theta", "0.5 to 1", "1.1")),
        ({"refresh": 0.0}, ("refresh", "0")),
    ],
)
def test_bad_option_is_one_sentence(options, words):
    with pytest.raises(ValueError) as caught:
        ImplicitDashpots(**options)
    for word in words:
        assert word in str(caught.value)
