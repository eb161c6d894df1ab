"""The same block turned, shifted and mirrored moves the same."""

from dataclasses import replace

import numpy as np

from taichi_dem import CONCRETE, Scene, Simulation, Uniform, effects
from taichi_dem.mesh.mesh import checked_mesh
from taichi_dem.mesh.shapes import bar
from tests.turns import matrix, quaternion

EPS = np.finfo(float).eps
STEP, STEPS = 2e-8, 1500
#: An improper rotation: it turns and mirrors.
TURN = matrix(quaternion([1.0, 2.0, -0.5], 2.0)) @ np.diag([1.0, -1.0, 1.0])
SHIFT = np.array([0.3, -0.2, 0.5])


def moved(change, shift):
    """A bar under gas pressure after STEPS steps; displacements and velocities turned back.

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
    return displacement, motion["velocity"] @ change, simulation.report(), simulation.state.broken()


def test_motion_turns_shifts_and_mirrors_with_the_mesh():
    """Positions of 1 m are rounded by eps at every step: displacements differ by STEPS eps.

    Through the dashpots a displacement error spreads over the block and is damped, not amplified;
    velocities are known to the same displacement error times the fastest spring rate, here
    1e6 / s. Softening, slip and fracture branch on comparisons; none lies within the error.
    """
    displacement, velocity, report, broken = moved(np.eye(3), 0.0 * SHIFT)
    found, rate, _, released = moved(TURN, SHIFT)
    assert report.energy_balance["slip"] > 0.0
    error = STEPS * EPS
    assert np.abs(displacement).max() > 1e8 * error
    assert np.abs(found - displacement).max() < error
    assert np.abs(rate - velocity).max() < error * 1e6
    assert np.array_equal(broken, released)
