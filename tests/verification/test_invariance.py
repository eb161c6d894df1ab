"""The same block turned, shifted or mirrored moves the same; the step converges at its order."""

from dataclasses import replace

import numpy as np
import pytest

from taichi_dem import CONCRETE, Scene, Simulation, Uniform, effects
from taichi_dem.mesh.mesh import checked_mesh
from taichi_dem.mesh.shapes import bar
from tests.turns import matrix, quaternion

EPS = np.finfo(float).eps
STEP, STEPS = 2e-8, 1500
TURN = matrix(quaternion([1.0, 2.0, -0.5], 2.0))
MIRROR = np.diag([1.0, -1.0, 1.0])
SHIFT = np.array([0.3, -0.2, 0.5])


def moved(change, shift):
    """A bar under gas pressure after STEPS steps; mesh, displacements and velocities turned back.

    change: orthogonal matrix. Slip, softening and dashpots all act.
    """
    straight = bar(0.3, 0.1, (3, 1, 1))
    points = straight.points @ change.T + shift
    tetrahedra = straight.tetrahedra.copy()
    if np.linalg.det(change) < 0.0:
        tetrahedra[:, [2, 3]] = tetrahedra[:, [3, 2]]
    mesh = checked_mesh(points, tetrahedra, straight.groups)
    listed = [effects.BondDamping(), effects.Softening(), effects.ShearSlip()]
    listed.append(effects.GasPressure("left", peak=60e6, rise=1e-5))
    weak = replace(CONCRETE, cohesion=1e5, friction=0.0)
    simulation = Simulation(Scene(mesh, weak, listed), Uniform(STEP))
    simulation.advance_to(STEPS)
    motion = simulation.state.motion()
    displacement = (motion["position"] - simulation.model.centre) @ change
    return displacement, motion["velocity"] @ change, simulation


@pytest.fixture(scope="module")
def straight():
    """The bar as it is built."""
    return moved(np.eye(3), np.zeros(3))


@pytest.mark.parametrize(
    ("change", "shift"),
    [(TURN, 0 * SHIFT), (np.eye(3), SHIFT), (MIRROR, 0 * SHIFT)],
    ids=["turned", "shifted", "mirrored"],
)
def test_motion_turns_shifts_and_mirrors_with_the_mesh(straight, change, shift):
    """Positions of 1 m are rounded by eps at every step: displacements differ by STEPS eps.

    Through the dashpots a displacement error spreads over the block and is damped, not amplified;
    velocities are known to the same displacement error times the fastest spring rate, here
    1e6 / s. Softening, slip and fracture branch on comparisons; none lies within the error.
    """
    displacement, velocity, reference = straight
    found, rate, simulation = moved(change, shift)
    assert reference.report().energy_balance["slip"] > 0.0
    error = STEPS * EPS
    assert np.abs(displacement).max() > 1e8 * error
    assert np.abs(found - displacement).max() < error
    assert np.abs(rate - velocity).max() < error * 1e6
    broken = reference.state.broken_tick.to_numpy() >= 0
    assert np.array_equal(broken, simulation.state.broken_tick.to_numpy() >= 0)


def test_the_explicit_step_is_first_order():
    """Errors against step: three runs give the order without knowing the answer.

    (u(4h) - u(2h)) / (u(2h) - u(h)) = 2 (1 + O(h rate)), h rate below 0.05 here.
    """
    found = []
    for halvings in range(3):
        step = 8e-8 / 2**halvings
        listed = [effects.BondDamping(), effects.GasPressure("left", peak=1e6, rise=1e-5)]
        scene = Scene(bar(0.3, 0.1, (3, 1, 1)), CONCRETE, listed)
        simulation = Simulation(scene, Uniform(step))
        simulation.advance_to(250 * 2**halvings)
        found.append(simulation.state.motion()["position"] - simulation.model.centre)
    first, second = (np.linalg.norm(found[k + 1] - found[k]) for k in range(2))
    assert np.log2(first / second) == pytest.approx(1.0, abs=0.1)
