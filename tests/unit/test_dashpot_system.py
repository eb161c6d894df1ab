"""The dashpots of all bonds as a linear system in NumPy: the kernels solve it."""

import itertools

import numpy as np
import pytest

from blast_sweeps import DashpotSystem
from taichi_dem import CONCRETE, ImplicitDashpots, Scene, Simulation, effects
from taichi_dem.mesh.shapes import bar

STEP = 4e-7


@pytest.fixture(scope="module")
def simulation():
    """A damped bar in motion after a step, its dashpots solved to round-off.

    With theta = 1 the twists that the dashpots answered are those at the end of the step.
    """
    scene = Scene(bar(0.1, 0.05, (3, 2, 2)), CONCRETE, [effects.BondDamping()])
    made = Simulation(scene, ImplicitDashpots(STEP, theta=1.0, sweeps=(2, 500), tolerance=1e-14))
    centre = made.model.centre
    speeds = np.random.default_rng(1).normal(size=(2, *centre.shape))
    made.state.set_motion(centre, np.tile([1.0, 0.0, 0.0, 0.0], (len(centre), 1)), *speeds)
    made.start()
    made.advance_to(1)
    return made


def after(sweeps, count):
    return next(itertools.islice(sweeps, count, None))


def test_what_the_kernels_have_solved_is_a_solution(simulation):
    """A sweep from the kernels' velocities, with the twists that they answered, changes nothing.

    Nothing but what a step turns the branches: of them, and of spins near 50 / s, 2e-5.
    """
    system = DashpotSystem(simulation)
    motion = simulation.values(simulation.advance.solver.velocities.twist)[
        : simulation.model.body_count
    ]
    swept = after(system.gauss_seidel(motion, system.last), 0)
    assert np.abs(swept - motion).max() < 2e-5 * np.abs(motion).max()
    unsolved = after(system.gauss_seidel(motion, 0.5 * system.last), 0)
    assert np.abs(unsolved - motion).max() > 0.1 * np.abs(motion).max()
