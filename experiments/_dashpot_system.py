"""The dashpots of all bonds of a running simulation as one linear system, and ways to sweep it.

In NumPy, to check the kernels' solution and to compare ways that they do not have. A bond answers
its twist (velocity and spin of one body against the other) with a wrench impulse; both bodies give
way to it.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np

from taichi_dem.kit.allocation import values
from taichi_dem.kit.lanes import by_lane
from taichi_dem.mesh.topology import edge_colours

#: All bonds.
ALL = slice(None)


def cross_matrices(vectors: np.ndarray) -> np.ndarray:
    """Matrices [r]x with [r]x w = r x w, (n, 3, 3), of vectors (n, 3)."""
    made = np.zeros((len(vectors), 3, 3))
    for row, column, part, sign in ((0, 1, 2, -1), (0, 2, 1, 1), (1, 2, 0, -1)):
        made[:, row, column] = sign * vectors[:, part]
        made[:, column, row] = -made[:, row, column]
    return made


def applied(matrices: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """Products of n matrices with n vectors."""
    return np.einsum("nij,nj->ni", matrices, vectors)


def read_blocks(bonds: Any) -> dict[str, np.ndarray]:
    """Arrays by place: masters, slaves (n,), branch (n, 3), last (n, 6), block (n, 6, 6)."""
    names = ("masters", "slaves", "branch", "last")
    found = {name: by_lane(values(getattr(bonds, name))) for name in names}
    a, b, c = (
        np.stack([by_lane(values(row)) for row in rows], axis=1)
        for rows in (bonds.a, bonds.b, bonds.c)
    )
    return {**found, "block": np.block([[a, b], [b.swapaxes(1, 2), c]])}


class DashpotSystem:
    """Matrices of the bonds that hold in a simulation by ``ImplicitDashpots``, started.

    motion in all methods: velocity and spin of the bodies, (bodies, 6) [m/s, rad/s]; twist: of the
    bonds, (n, 6).

    bodies: two of each bond, (2, n). onto: Jacobians from the twists of both to that of the bond,
    (2, n, 6, 6). gives: twist of a body per wrench impulse, (bodies, 6, 6) [1/kg, ...]. law:
    inverse of the bonds' own blocks. colours: of the bonds.
    """

    def __init__(self, simulation: Any):
        solver, model = simulation.advance.solver, simulation.model
        read = read_blocks(solver.bonds)
        holds = read["masters"] != solver.velocities.spare
        self.bodies = np.stack([read["masters"][holds], read["slaves"][holds]])
        self.colours = edge_colours(self.bodies.T, model.body_count)
        self.onto = self._jacobians(read["branch"][holds])
        self.last, solved = read["last"][holds], read["block"][holds]
        turn = values(solver.velocities.turn, slice(model.body_count))
        self.gives = np.zeros((model.body_count, 6, 6))
        self.gives[:, :3, :3] = (1.0 / model.body_mass)[:, None, None] * np.eye(3)
        self.gives[:, 3:, 3:] = turn
        self.law = np.linalg.inv(solved) - sum(self._mobilities())

    @staticmethod
    def _jacobians(branch):
        made = np.zeros((2, len(branch), 6, 6))
        made[0] = -np.eye(6)
        made[0, :, :3, 3:] = cross_matrices(branch)
        made[1] = np.eye(6)
        return made

    def _mobilities(self):
        """What both bodies of each bond give way by, (n, 6, 6) each."""
        return [
            onto @ self.gives[body] @ onto.swapaxes(1, 2)
            for onto, body in zip(self.onto, self.bodies)
        ]

    def twists(self, motion: np.ndarray, some: Any = ALL) -> np.ndarray:
        """Twists of the bonds, or of some, at the bodies' motion (bodies, 6) [m/s, rad/s]."""
        first, second = (
            applied(onto[some], motion[body[some]]) for onto, body in zip(self.onto, self.bodies)
        )
        return first + second

    def pull(self, motion: np.ndarray, impulse: np.ndarray, some: Any = ALL) -> None:
        """Let the bonds, or some, give their bodies wrench impulses; changes motion."""
        for onto, body in zip(self.onto, self.bodies):
            push = applied(onto[some].swapaxes(1, 2), impulse)
            np.subtract.at(motion, body[some], applied(self.gives[body[some]], push))

    def gauss_seidel(self, motion: np.ndarray, twist: np.ndarray) -> Iterator[np.ndarray]:
        """Motion after each sweep by colours; twist: that the impulses so far have answered."""
        solved = np.linalg.inv(self.law + sum(self._mobilities()))
        motion, twist = motion.copy(), twist.copy()
        groups = [np.flatnonzero(self.colours == c) for c in range(1 + self.colours.max())]
        while True:
            for some in groups:
                step = applied(solved[some], self.twists(motion, some) - twist[some])
                self.pull(motion, step, some)
                twist[some] = self.twists(motion, some)
            yield motion

    def jacobi(
        self, motion: np.ndarray, twist: np.ndarray, momentum: bool = False
    ) -> Iterator[np.ndarray]:
        """The same with all bonds at once, the mass of a body split among its bonds.

        momentum: Nesterov's, begun anew when it leads away (Macklin and others, 2014; Mazhar and
        others, 2015).
        """
        shares = np.bincount(self.bodies.ravel(), minlength=len(self.gives))
        split = sum(
            shares[body][:, None, None] * part
            for body, part in zip(self.bodies, self._mobilities())
        )
        solved = np.linalg.inv(self.law + split)
        impulse = before = np.zeros_like(twist)
        pace = 1.0
        while True:
            ahead = impulse
            if momentum:
                faster = 0.5 * (1.0 + np.sqrt(1.0 + 4.0 * pace * pace))
                ahead = impulse + (pace - 1.0) / faster * (impulse - before)
                pace = faster
            there = motion.copy()
            self.pull(there, ahead)
            step = applied(solved, self.twists(there) - twist - applied(self.law, ahead))
            before, impulse = impulse, ahead + step
            if np.sum(step * (impulse - before)) < 0.0:
                pace = 1.0
            found = motion.copy()
            self.pull(found, impulse)
            yield found
