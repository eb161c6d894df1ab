"""Momentum to round-off and energy to the order of the step, through fracture and contact."""

from dataclasses import replace

import numpy as np
import pytest

from taichi_dem import (
    CONCRETE,
    ImplicitDashpots,
    Multirate,
    Scene,
    Simulation,
    Uniform,
    effects,
)
from taichi_dem.mesh.mesh import checked_mesh
from taichi_dem.mesh.shapes import bar, single
from tests.scenes import brisk_scene
from tests.slow import slow_but
from tests.turns import matrix, quaternion

EPS = np.finfo(float).eps
STILL = np.array([1.0, 0.0, 0.0, 0.0])
#: Largest step [s] and distance [m] of the coarse runs; half of both in the fine ones.
DT0, DISTANCE, STEPS = 1e-8, 2e-7, 3000
METHODS = {
    "held": lambda part: Multirate(DT0 * part, DISTANCE * part),
    "drifted": lambda part: Multirate(DT0 * part, DISTANCE * part, "drifted"),
    "uniform": lambda part: Uniform(DT0 * part, DISTANCE * part),
}


@pytest.fixture(scope="module")
def reports():
    """Reports of the brisk block by method and refinement, each run once."""
    done = {}

    def report(name, part):
        if (name, part) not in done:
            simulation = Simulation(brisk_scene(), METHODS[name](part))
            simulation.advance_to(round(STEPS / part))
            done[name, part] = simulation.report()
        return done[name, part]

    return report


@pytest.mark.parametrize("name", slow_but(METHODS, "uniform", "held"))
def test_momentum_is_kept_through_fracture_and_contact(reports, name):
    """Momentum less the impulse of the gas, linear and angular about the origin.

    Pair impulses cancel bit for bit. What is left is round-off of the sums: a body's momentum is
    added to at each of its updates, with an error of eps of its size and random sign. The share
    of all that was exchanged is then sqrt(updates) eps, at most.
    """
    report = reports(name, 1.0)
    assert report.broken_faces > 30 and report.pair_evaluations > 10000
    bound = EPS * np.sqrt(report.body_updates / report.body_count)
    assert report.linear_momentum_error < bound
    assert report.angular_momentum_error < bound


@pytest.mark.parametrize("name", ["held", pytest.param("drifted", marks=pytest.mark.slow)])
def test_ledger_residual_halves_with_step_and_distance(reports, name):
    """Half the step, at most half the residual, and no less than a quarter of it.

    Dashpots, fracture and contact are of first order in the step, all else is of second. In the
    coarsest runs both are alike and of opposite sign.
    """
    coarse, fine = reports(name, 0.25), reports(name, 0.125)
    assert fine.smallest_step_s < coarse.smallest_step_s
    ratio = fine.energy_balance["residual"] / coarse.energy_balance["residual"]
    assert 0.25 < ratio < 0.55
    assert coarse.energy_residual_fraction < 1e-3


def test_every_term_of_the_ledger_is_in_use(reports):
    """Without any one of them the residual would not have closed above."""
    account = reports("held", 0.5).energy_balance
    residual = abs(account["residual"])
    absent = "support_work", "ground_dashpot"
    idle = [name for name, value in account.items() if name not in absent and value == 0.0]
    assert idle == []
    # Those smaller than the residual are tested on their own (bond law, pair dynamics).
    large = ("kinetic", "bond_strain", "bond_dashpot", "softening", "release", "slip", "load_work")
    assert all(account[name] > residual for name in large)


def test_a_ball_like_body_turns_by_exactly_its_spin():
    """A regular tetrahedron has equal moments: q = exp(w t), velocity and momentum keep their bits.

    Each step rounds the quaternion by a few eps; orientation after n steps is known to 4 n eps.
    """
    simulation = Simulation(Scene(single(), CONCRETE), Uniform(1e-6))
    centre, steps = simulation.model.centre, 2000
    velocity, spin = np.array([[3.0, -2.0, 1.0]]), np.array([[600.0, -700.0, 400.0]])
    simulation.state.set_motion(centre, [STILL], velocity, spin)
    before = simulation.state.motion()
    simulation.advance_to(steps)
    after = simulation.state.motion()
    assert np.array_equal(before["velocity"], after["velocity"])
    assert np.array_equal(before["angular_momentum"], after["angular_momentum"])
    time_s, rate = steps * 1e-6, np.linalg.norm(spin)
    half = 0.5 * rate * time_s
    expected = np.array([np.cos(half), *(np.sin(half) * spin[0] / rate)])
    # Spin is read back from the turned inertia: its rounding turns by 10 eps of the angle.
    error = (4 * steps + 10 * half) * EPS
    assert np.abs(after["orientation"][0] - expected).max() < error
    assert np.abs(after["position"] - centre - velocity * time_s).max() < steps * EPS * 0.01


def precession_error(steps):
    """Error of an axisymmetric body's axis after a quarter turn about its angular momentum."""
    simulation = Simulation(Scene(single(0.05, 0.1), CONCRETE), Uniform(1e-6))
    inertia = simulation.model.body_inertia[0]
    along, across = inertia[0, 0], inertia[1, 1]
    assert abs(inertia - np.diag([along, across, across])).max() < 1e-12 * across
    # The axis goes round the fixed angular momentum at |L| / across.
    time_s = steps * 1e-6
    momentum = across * 0.5 * np.pi / time_s
    direction = np.array([0.6, 0.8, 0.0])
    spin = momentum * direction / np.array([along, across, across])
    still = np.zeros((1, 3))
    simulation.state.set_motion(simulation.model.centre, [STILL], still, [spin])
    simulation.advance_to(steps)
    after = simulation.state.motion()
    axis = after["rotation"][0] @ [1.0, 0.0, 0.0]
    expected = 0.6 * direction + np.cross(direction, [1.0, 0.0, 0.0])
    return np.linalg.norm(axis - expected)


def test_free_precession_is_met_at_second_order():
    """Axisymmetric body: |L| / I_across about L, analytic; half the step, a quarter of the error.

    In a step the body turns by p = pi / 2 / 400 = 4e-3: each errs by p^3 at most, all by p^2 pi/2.
    """
    coarse, fine = precession_error(400), precession_error(800)
    assert coarse < 0.5 * np.pi * (0.5 * np.pi / 400) ** 2
    assert fine / coarse == pytest.approx(0.25, abs=0.5 * np.pi / 400)


@pytest.fixture(scope="module")
def damped_bar():
    """A bar of 18 bodies with dashpots, softening and early slip, as a builder."""
    material = replace(CONCRETE, cohesion=1e5)

    def build():
        listed = [effects.BondDamping(), effects.Softening(), effects.ShearSlip()]
        return Simulation(Scene(bar(0.3, 0.1, (3, 1, 1)), material, listed), Uniform(2e-8))

    return build


def test_a_rigidly_moved_block_feels_no_force(damped_bar):
    """The whole bar turned by 2 rad, with a rigid velocity: impulses of the bonds are round-off.

    Openings are differences of positions of 0.3 m: 8 eps 0.3 m; velocities of the vertices
    differences of 30 m/s: 8 eps 30 m/s.
    """
    simulation = damped_bar()
    turn = quaternion([2.0, -1.0, 2.0], 2.0)
    rotation = matrix(turn)
    place = simulation.model.centre @ rotation.T
    spin = np.array([60.0, -30.0, 40.0])
    velocity = np.cross(spin, place) + np.array([5.0, -3.0, 8.0])
    count = simulation.model.body_count
    simulation.state.set_motion(
        place, np.tile(turn, (count, 1)), velocity, np.tile(spin, (count, 1))
    )
    simulation.start()
    area = 3.0 * simulation.tables.unit_area.to_numpy().max()
    opening, rate = 8 * EPS * 0.3, 8 * EPS * 30.0
    force = area * (CONCRETE.normal_stiffness * opening + CONCRETE.normal_damping * rate)
    impulse = simulation.state.slot.to_numpy()[:, :3] / 2e-8
    assert np.abs(impulse).max() < force
    # A tilt of 1e-6 rad of one body against the others is seen a thousand times over.
    assert CONCRETE.normal_stiffness * 1e-6 * 0.03 * area > 1000 * force


def test_a_strained_block_in_free_flight_keeps_its_momentum(damped_bar):
    """Random strains, slips and spins at the start: bonds work, the whole flies on.

    Bound as above: sqrt(updates) eps of what the bodies carry.
    """
    simulation, steps = damped_bar(), 1000
    random = np.random.default_rng(1)
    count = simulation.model.body_count
    place = simulation.model.centre + 1e-5 * random.standard_normal((count, 3))
    velocity = np.array([7.0, 0.0, -3.0]) + random.standard_normal((count, 3))
    spin = 50.0 * random.standard_normal((count, 3))
    simulation.state.set_motion(place, np.tile(STILL, (count, 1)), velocity, spin)
    simulation.advance_to(steps)
    report = simulation.report()
    assert report.energy_balance["slip"] > 0.0 and report.energy_balance["bond_strain"] > 0.0
    bound = EPS * np.sqrt(steps)
    assert report.linear_momentum_error < bound
    assert report.angular_momentum_error < bound


def test_an_uneven_body_keeps_its_angular_momentum_while_it_tumbles():
    """Three different moments: L keeps its bits, the spin does not; energy drifts with the step.

    The step turns the body by w dt = 1e-3 rad about a fixed axis, while its spin axis moves on by
    that share: the energy error after an angle a is below a w dt.
    """
    points = np.array([[0, 0, 0], [0.1, 0, 0], [0.02, 0.05, 0], [0.01, 0.01, 0.03]])
    mesh = checked_mesh(points, [[0, 1, 2, 3]], {})
    simulation = Simulation(Scene(mesh, CONCRETE), Uniform(1e-6))
    spin = np.array([[400.0, 700.0, -600.0]])
    simulation.state.set_motion(simulation.model.centre, [STILL], np.zeros((1, 3)), spin)
    simulation.start()
    first, energy = simulation.state.motion(), simulation.energy_balance.account()["kinetic"]
    simulation.advance_to(1000)
    last = simulation.state.motion()
    assert np.array_equal(first["angular_momentum"], last["angular_momentum"])
    assert np.abs(last["spin"] - spin).max() > 100.0
    assert simulation.energy_balance.account()["kinetic"] == pytest.approx(energy, rel=1e-3)


def test_momentum_that_a_support_takes_from_a_load_is_no_error():
    """Gas and support leave nothing but rounding: n eps of all that they gave each other."""
    acting = [effects.GasPressure("sides", rise=1e-5, decay_ratio=2.75), effects.Fixed("base")]
    simulation = Simulation(Scene(single(), CONCRETE, acting), ImplicitDashpots(1e-6))
    simulation.advance_to(1000)
    # Relative to a millionth of it.
    assert max(simulation.energy_balance.momentum_errors()) < 1000 * EPS / 1e-6
