"""Momentum to round-off and energy to the order of the step, through fracture and contact.

The same bar turned, shifted and mirrored moves the same. Bodies that sleep are woken.
"""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from taichi_dem import (
    CONCRETE,
    ImplicitDashpots,
    Mesh,
    Multirate,
    Scene,
    Simulation,
    StepControl,
    Uniform,
)
from taichi_dem import effects as listed
from taichi_dem.mesh.mesh import checked_mesh
from taichi_dem.mesh.shapes import bar, single
from taichi_dem.state.timeline import MACRO_TICKS
from tests.scenes import brisk_scene, matrix, quaternion
from tests.structures import filled

EPS = np.finfo(float).eps
#: Largest step [s] and distance [m] of explicit runs; half of both in finer ones.
DT0, DISTANCE = 1e-8, 2e-7
#: Step of solved dashpots [s]; sweeps until they add little to what is measured.
SOLVED = 4e-7
METHODS = {
    "held": lambda part: Multirate(DT0 * part, DISTANCE * part),
    "implicit": lambda part: ImplicitDashpots(SOLVED * part, sweeps=(2, 100), tolerance=1e-5),
}
UNTIL = {"held": 3e-5, "implicit": 4e-5}


@pytest.fixture(scope="module")
def reports():
    """Reports of the brisk block by method and refinement, each run once."""
    done = {}

    def report(name, part):
        if (name, part) not in done:
            method = METHODS[name](part)
            simulation = Simulation(brisk_scene(), method)
            simulation.advance_to(round(UNTIL[name] / method.dt0))
            done[name, part] = simulation.report()
        return done[name, part]

    return report


@pytest.mark.parametrize("name", METHODS)
def test_momentum_is_kept_through_fracture_and_contact(reports, name):
    """Momentum less the impulse of the gas, linear and angular about the origin.

    Pair impulses cancel bit for bit. What is left is round-off of the sums: a body's momentum is
    added to at each of its updates, with an error of eps of its size and random sign. The share
    of all that was exchanged is then sqrt(updates) eps, at most. Visits of sweeps round the
    velocity too, and are few against the updates' own sums.
    """
    report = reports(name, 1.0)
    assert report.broken_faces > 30 and report.pair_evaluations > 10000
    bound = EPS * np.sqrt(report.body_updates / report.body_count)
    assert report.linear_momentum_error < bound
    assert report.angular_momentum_error < bound


def test_ledger_residual_halves_with_step_and_distance(reports):
    """Half the step, at most half the residual, and no less than a quarter of it.

    Dashpots, fracture and contact are of first order in the step, all else is of second. In the
    coarsest runs both are alike and of opposite sign.
    """
    coarse, fine = reports("held", 0.25), reports("held", 0.125)
    assert fine.smallest_step_s < coarse.smallest_step_s
    ratio = fine.energy_balance["residual"] / coarse.energy_balance["residual"]
    assert 0.25 < ratio < 0.55
    assert coarse.energy_residual_fraction < 1e-3


def test_ledger_residual_of_solved_dashpots_falls_with_the_step(reports):
    """Fracture and contact are met up to a step late, and sweeps end within their tolerance.

    Energies are of one time: no half step of power is left, which was SOLVED / UNTIL / 2 of all.
    """
    coarse, fine = reports("implicit", 1.0), reports("implicit", 0.5)
    assert abs(fine.energy_balance["residual"]) < abs(coarse.energy_balance["residual"])
    assert coarse.energy_residual_fraction < 0.25 * 0.5 * SOLVED / UNTIL["implicit"]


def test_every_term_of_the_ledger_is_in_use(reports):
    """Without any one of them the residual would not have closed above."""
    account = reports("held", 0.25).energy_balance
    residual = abs(account["residual"])
    absent = "support_work", "ground_dashpot", "hysteresis"
    idle = [name for name, value in account.items() if name not in absent and value == 0.0]
    assert idle == []
    # Those smaller than the residual, and hysteresis, are tested on their own (bond law, pair
    # dynamics, contact laws).
    large = ("kinetic", "bond_strain", "bond_dashpot", "softening", "release", "slip", "load_work")
    assert all(account[name] > residual for name in large)


def test_a_rigidly_moved_block_feels_no_force():
    """The whole bar turned by 2 rad, with a rigid velocity: impulses of the bonds are round-off.

    Openings are differences of positions of 0.3 m: 8 eps 0.3 m; velocities of the vertices
    differences of 30 m/s: 8 eps 30 m/s.
    """
    laws = filled("bonds", listed.BondDamping(), listed.Softening(), listed.ShearSlip())
    scene = Scene(bar(0.3, 0.1, (3, 1, 1)), replace(CONCRETE, cohesion=1e5), laws)
    simulation = Simulation(scene, Uniform(2e-8))
    turn = quaternion([2.0, -1.0, 2.0], 2.0)
    place = simulation.model.centre @ matrix(turn).T
    spin = np.array([60.0, -30.0, 40.0])
    velocity = np.cross(spin, place) + np.array([5.0, -3.0, 8.0])
    count = simulation.model.body_count
    simulation.state.set_motion(
        place, np.tile(turn, (count, 1)), velocity, np.tile(spin, (count, 1))
    )
    simulation.start()
    area = 3.0 * simulation.values(simulation.tables.unit_area).max()
    opening, rate = 8 * EPS * 0.3, 8 * EPS * 30.0
    force = area * (CONCRETE.normal_stiffness * opening + CONCRETE.normal_damping * rate)
    impulse = simulation.values(simulation.state.slot)[:, :3] / 2e-8
    assert np.abs(impulse).max() < force
    # A tilt of 1e-6 rad of one body against the others is seen a thousand times over.
    assert CONCRETE.normal_stiffness * 1e-6 * 0.03 * area > 1000 * force


#: A body of three different moments; the first turns by 0.04 rad in a step [s].
POINTS = np.array([[0, 0, 0], [5, 0, 0], [1, 4, 0], [2, 1, 3]]) * 0.01
TURN, SPIN, STEPS, HALVINGS = 1e-6, np.array([3e4, -2e4, 2e4]), 100, 3


def tumbling(method):
    """Equal bodies apart from each other, each at half the spin of the one before."""
    shift = np.arange(HALVINGS + 1)[:, None, None] * [1.0, 0.0, 0.0]
    bodies = np.arange(4 * (HALVINGS + 1)).reshape(-1, 4)
    mesh = Mesh((POINTS + shift).reshape(-1, 3), bodies, {"left": [[0, 1, 2]]})
    scene = Scene(mesh, CONCRETE, filled("bonds"))
    simulation = Simulation(scene, method)
    still = np.tile([1.0, 0.0, 0.0, 0.0], (len(bodies), 1))
    spin = SPIN / 2.0 ** np.arange(HALVINGS + 1)[:, None]
    simulation.state.set_motion(simulation.model.centre, still, spin=spin)
    simulation.start()
    return simulation


def exact_turn(inertia):
    """Orientation after STEPS of the first body, by Euler's equations in a stationary frame."""
    momentum = inertia @ SPIN
    back = np.linalg.inv(inertia)

    def rate(_, flat):
        turn = flat.reshape(3, 3)
        spin = turn @ back @ turn.T @ momentum
        return np.cross(spin, turn.T).T.ravel()

    until = STEPS * TURN
    return solve_ivp(rate, (0.0, until), np.eye(3).ravel(), rtol=1e-12, atol=1e-12).y[:, -1]


@pytest.mark.parametrize("method", [Uniform(TURN), ImplicitDashpots(TURN)], ids=lambda m: m.name)
def test_a_turn_is_of_second_order_and_keeps_angular_momentum_to_the_bit(method):
    """Half the angle a step leaves a quarter of the error, but for a share of the next order."""
    simulation = tumbling(method)
    before = simulation.state.motion()["angular_momentum"]
    inertia = simulation.model.body_inertia[0]
    wanted, errors = Rotation.from_matrix(exact_turn(inertia).reshape(3, 3)), []
    for halving in range(HALVINGS + 1):
        simulation.advance_to(STEPS * 2**halving)
        turned = Rotation.from_matrix(simulation.state.motion()["rotation"][halving])
        errors.append((wanted * turned.inv()).magnitude())
    angle = np.linalg.norm(SPIN) * TURN
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert orders == pytest.approx(2.0, abs=angle)
    assert np.array_equal(simulation.state.motion()["angular_momentum"], before)


#: An improper rotation: it turns and mirrors.
MIRROR = matrix(quaternion([1.0, 2.0, -0.5], 2.0)) @ np.diag([1.0, -1.0, 1.0])
SHIFT, FLIGHT = np.array([0.3, -0.2, 0.5]), 1500


def moved(change, shift):
    """A bar under gas pressure after FLIGHT steps; displacements and velocities turned back.

    change: orthogonal matrix. Slip, softening and dashpots all act.
    """
    straight = bar(0.3, 0.1, (3, 1, 1))
    points = straight.points @ change.T + shift
    tetrahedra = straight.tetrahedra.copy()
    if np.linalg.det(change) < 0.0:
        tetrahedra[:, [2, 3]] = tetrahedra[:, [3, 2]]
    mesh = checked_mesh(points, tetrahedra, straight.groups)
    gas = listed.GasPressure("left", peak=60e6, rise=1e-5)
    laws = listed.BondDamping(), listed.Softening(), listed.ShearSlip()
    weak = replace(CONCRETE, cohesion=1e5, friction=0.0)
    simulation = Simulation(Scene(mesh, weak, filled("bonds", *laws, gas)), Uniform(2e-8))
    simulation.advance_to(FLIGHT)
    motion = simulation.state.motion()
    displacement = (motion["position"] - simulation.model.centre) @ change
    return displacement, motion["velocity"] @ change, simulation.report(), simulation.state.broken()


def test_motion_turns_shifts_and_mirrors_with_the_mesh():
    """Positions of 1 m are rounded by eps at every step: displacements differ by FLIGHT eps.

    Through the dashpots a displacement error spreads over the block and is damped, not amplified;
    velocities are known to the same displacement error times the fastest spring rate, here
    1e6 / s. Softening, slip and fracture branch on comparisons; none lies within the error.
    """
    displacement, velocity, report, broken = moved(np.eye(3), 0.0 * SHIFT)
    found, rate, _, released = moved(MIRROR, SHIFT)
    assert report.energy_balance["slip"] > 0.0
    error = FLIGHT * EPS
    assert np.abs(displacement).max() > 1e8 * error
    assert np.abs(found - displacement).max() < error
    assert np.abs(rate - velocity).max() < error * 1e6
    assert np.array_equal(broken, released)


SPEED, EDGE, GAP = 20.0, 0.03, 3e-5


def target():
    """A bar at rest, and a small body whose one sphere will meet the one of the bar's face."""
    block, fragment = bar(0.1, 0.05, (2, 1, 1)), single(EDGE)
    aim = block.points[block.group_faces("left")[0]].mean(axis=0)
    points = np.vstack([block.points, fragment.points + np.array([-GAP, aim[1], aim[2]])])
    tetrahedra = np.vstack([block.tetrahedra, fragment.tetrahedra + len(block.points)])
    return checked_mesh(points, tetrahedra, {"hole": block.group_faces("right")})


def hit():
    """A block with steps of its bodies' own, and the fragment that flies at it."""
    touch = listed.SphereContact(3, outer_faces=True), listed.Friction()
    laws = filled("paper", listed.BondDamping(), *touch, group="hole")
    method = Multirate(1e-6, 1e-6, control=StepControl(), dashpot="limited")
    simulation = Simulation(Scene(target(), CONCRETE, laws), method)
    velocity = np.zeros((simulation.model.body_count, 3))
    velocity[-1, 0] = SPEED
    simulation.state.set_motion(simulation.model.centre, velocity=velocity)
    return simulation


def test_energy_never_grows_when_a_fast_fragment_hits_a_sleeping_block():
    """Dashpots and friction only take; round-off of a sum of a dozen terms is left."""
    simulation = hit()
    energy = [1.0]
    for step in range(1, 11):
        simulation.advance_to(step)
        account = simulation.energy_balance.account()
        stored = account["kinetic"] + account["bond_strain"] + account["sphere_strain"]
        energy.append(stored / simulation.energy_balance.start_energy)
    assert energy[-1] < 0.5 and np.diff(energy).max() < 1e-13
    assert simulation.schedule.limits.woken[None] > 0
    assert max(simulation.energy_balance.momentum_errors()) < 1e-13


def test_neighbours_differ_by_more_than_the_level_limit_only_until_they_wake():
    """The hit refines one body of the block; in each substep the next ring of neighbours wakes."""
    simulation = hit()
    simulation.advance_to(1)
    top, longest, lasts = simulation.model.topology, 0, 0
    for _ in range(400):
        simulation.driver.few(2 * MACRO_TICKS, 1)
        level = simulation.values(simulation.state.level)
        far = np.abs(level[top.master] - level[top.slave]).max() > 2
        lasts = lasts + 1 if far else 0
        longest = max(longest, lasts)
    assert 0 < longest < simulation.model.body_count


@pytest.fixture(scope="module")
def woken():
    """The paper's block under a brisk pulse with all of the control, until bonds have broken."""
    method = Multirate(1.6e-7, 2e-6, control=StepControl(), dashpot="limited")
    simulation = Simulation(brisk_scene(), method)
    simulation.advance_to(180)
    return simulation


def test_waking_keeps_momentum_and_the_account(woken):
    report = woken.report()
    assert report.broken_faces > 30 and woken.schedule.limits.woken[None] > 100
    assert max(report.linear_momentum_error, report.angular_momentum_error) < 1e-13
    assert report.energy_residual_fraction < 0.01
