"""A free body that tumbles: its step turns it to second order, and keeps its momentum."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from taichi_dem import CONCRETE, ImplicitDashpots, Mesh, Scene, Simulation, Uniform

POINTS = np.array([[0, 0, 0], [5, 0, 0], [1, 4, 0], [2, 1, 3]]) * 0.01
STEP = 1e-6
#: The first body turns by 0.04 rad a step; each next at half the speed, and twice as long.
SPIN = np.array([3e4, -2e4, 2e4])
STEPS = 100
HALVINGS = 3


def made(method):
    """Equal bodies apart from each other, each at half the spin of the one before."""
    shift = np.arange(HALVINGS + 1)[:, None, None] * [1.0, 0.0, 0.0]
    bodies = np.arange(4 * (HALVINGS + 1)).reshape(-1, 4)
    scene = Scene(Mesh((POINTS + shift).reshape(-1, 3), bodies, {}), CONCRETE)
    simulation = Simulation(scene, method)
    still = np.tile([1.0, 0.0, 0.0, 0.0], (len(bodies), 1))
    spin = SPIN / 2.0 ** np.arange(HALVINGS + 1)[:, None]
    simulation.state.set_motion(simulation.model.centre, still, spin=spin)
    simulation.start()
    return simulation


def exact(inertia):
    """Orientation after STEPS of the first body, by Euler's equations in a stationary frame."""
    momentum = inertia @ SPIN
    back = np.linalg.inv(inertia)

    def rate(_, flat):
        turn = flat.reshape(3, 3)
        spin = turn @ back @ turn.T @ momentum
        return np.cross(spin, turn.T).T.ravel()

    until = STEPS * STEP
    return solve_ivp(rate, (0.0, until), np.eye(3).ravel(), rtol=1e-12, atol=1e-12).y[:, -1]


@pytest.mark.parametrize("method", [Uniform(STEP), ImplicitDashpots(STEP)], ids=lambda m: m.name)
def test_a_turn_is_of_second_order_and_keeps_angular_momentum_to_the_bit(method):
    """Half the angle a step leaves a quarter of the error, but for a share of the next order."""
    simulation = made(method)
    inertia = simulation.model.body_inertia[0]
    before = simulation.state.motion()["angular_momentum"]
    wanted, errors = Rotation.from_matrix(exact(inertia).reshape(3, 3)), []
    for halving in range(HALVINGS + 1):
        simulation.advance_to(STEPS * 2**halving)
        turned = Rotation.from_matrix(simulation.state.motion()["rotation"][halving])
        errors.append((wanted * turned.inv()).magnitude())
    angle = np.linalg.norm(SPIN) * STEP
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert orders == pytest.approx(2.0, abs=angle)
    assert np.array_equal(simulation.state.motion()["angular_momentum"], before)
