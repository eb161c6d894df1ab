"""The dashpots of all bonds as a linear system in NumPy: the kernels solve it."""

import itertools

import numpy as np
import pytest

from taichi_dem import CONCRETE, ImplicitDashpots, Scene, Simulation, effects
from taichi_dem.kit.allocation import values
from taichi_dem.kit.lanes import by_lane
from taichi_dem.mesh.shapes import bar
from taichi_dem.mesh.topology import edge_colours

STEP = 4e-7


def applied(matrices, vectors):
    """Products of n matrices with n vectors."""
    return np.einsum("nij,nj->ni", matrices, vectors)


class DashpotSystem:
    """Matrices of the bonds that hold in a simulation by ``ImplicitDashpots``, started.

    A bond answers its twist (velocity and spin of one body against the other), (n, 6), with a
    wrench impulse; both bodies give way to it. motion: velocity and spin, (bodies, 6).

    bodies: two of each bond, (2, n). onto: Jacobians from the twists of both to that of the bond,
    (2, n, 6, 6). gives: twist of a body per wrench impulse, (bodies, 6, 6). mobility: what both
    bodies of each bond give way by. law: inverse of the bonds' own blocks. last: twists answered.
    """

    def __init__(self, simulation):
        solver, model = simulation.step.solver, simulation.model
        bonds, count = solver.bonds, model.body_count
        names = ("masters", "slaves", "branch", "last")
        masters, slaves, branch, last = (by_lane(values(getattr(bonds, name))) for name in names)
        holds = masters != solver.velocities.spare
        self.bodies, self.last = np.stack([masters[holds], slaves[holds]]), last[holds]
        self.colours = edge_colours(self.bodies.T, count)
        self.onto = np.tile(np.eye(6), (2, holds.sum(), 1, 1))
        self.onto[0] *= -1.0
        # Columns of [r]x are r x e.
        self.onto[0, :, :3, 3:] = np.cross(branch[holds, None, :], np.eye(3)).swapaxes(1, 2)
        self.gives = np.zeros((count, 6, 6))
        self.gives[:, :3, :3] = (1.0 / model.body_mass)[:, None, None] * np.eye(3)
        self.gives[:, 3:, 3:] = values(solver.velocities.turn, slice(count))
        self.mobility = [
            onto @ self.gives[body] @ onto.swapaxes(1, 2)
            for onto, body in zip(self.onto, self.bodies)
        ]
        a, b, c = (
            np.stack([by_lane(values(row)) for row in rows], axis=1)
            for rows in (bonds.a, bonds.b, bonds.c)
        )
        block = np.block([[a, b], [b.swapaxes(1, 2), c]])
        self.law = np.linalg.inv(block[holds]) - sum(self.mobility)

    def twists(self, motion, some=slice(None)):
        """Twists of the bonds, or of some, at the bodies' motion."""
        return sum(applied(k[some], motion[body[some]]) for k, body in zip(self.onto, self.bodies))

    def pull(self, motion, impulse, some=slice(None)):
        """Let the bonds, or some, give their bodies wrench impulses; changes motion."""
        for onto, body in zip(self.onto, self.bodies):
            push = applied(onto[some].swapaxes(1, 2), impulse)
            np.subtract.at(motion, body[some], applied(self.gives[body[some]], push))

    def gauss_seidel(self, motion, twist):
        """Motion after each sweep by colours; twist: that the impulses so far have answered."""
        solved = np.linalg.inv(self.law + sum(self.mobility))
        motion, twist = motion.copy(), twist.copy()
        groups = [np.flatnonzero(self.colours == c) for c in range(1 + self.colours.max())]
        while True:
            for some in groups:
                step = applied(solved[some], self.twists(motion, some) - twist[some])
                self.pull(motion, step, some)
                twist[some] = self.twists(motion, some)
            yield motion


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
    motion = simulation.values(simulation.step.solver.velocities.twist)[
        : simulation.model.body_count
    ]
    swept = after(system.gauss_seidel(motion, system.last), 0)
    assert np.abs(swept - motion).max() < 2e-5 * np.abs(motion).max()
    unsolved = after(system.gauss_seidel(motion, 0.5 * system.last), 0)
    assert np.abs(unsolved - motion).max() > 0.1 * np.abs(motion).max()
