"""Which way of sweeping solves the dashpots of all bonds in the fewest sweeps?

At several times of the paper's blast, all velocities are disturbed by 5 % of the largest, as
springs and loads do in a step. The dashpots are then solved from the impulses of the last step:
bond by bond in the order of their colours (Gauss-Seidel, as in ``ImplicitDashpots``), or all at
once with split masses (Jacobi), without and with momentum. Expect Gauss-Seidel to need at most half
of the sweeps, as a bond uses the new velocities of its neighbours. Bonds of one colour share no
body, so they can run in parallel with the same bits. Jacobi's only advantage is fewer launches on a
GPU: one a sweep instead of five.

    python experiments/blast_sweeps.py

The error is the largest of a body's velocity against the exact solution, over the largest speed.
Writes sweeps.png, sweeps.csv and summary.json to results/blast_sweeps/.
"""

import itertools
import sys
from functools import partial

import numpy as np
import pandas as pd

from _blast import blast_parser, paper_scene
from taichi_dem import At, ImplicitDashpots, Simulation
from taichi_dem.kit import study
from taichi_dem.kit.allocation import values
from taichi_dem.kit.lanes import by_lane
from taichi_dem.kit.plot_style import BROWN, GREY, STYLES, VIOLET, picture
from taichi_dem.mesh.topology import edge_colours
from taichi_dem.simulate import run_simulation

NAME = "blast_sweeps"
SETTINGS = {"times": ((2e-5, 1e-4, 2e-4, 4e-4), (5e-6, 2e-5))}
#: Way -> (words, colour, dashes); the first is that of the method with solved dashpots.
WAYS = {
    "gauss_seidel": ("Gauss-Seidel by colours", STYLES["implicit"].colour, "-"),
    "jacobi": ("Jacobi, split masses", BROWN, "--"),
    "momentum": ("Jacobi with momentum", VIOLET, "-."),
}
TOLERANCES = (0.05, 0.01, 1e-3)
KICK, SWEEPS, ALL = 0.05, 30, slice(None)
options_parser = partial(blast_parser, NAME, __doc__, (), settings=SETTINGS)


def applied(matrices, vectors):
    """Products of n matrices with n vectors."""
    return np.einsum("nij,nj->ni", matrices, vectors)


class DashpotSystem:
    """Matrices of the bonds that hold in a simulation by ``ImplicitDashpots``, started.

    In NumPy, to check the kernels' solution and to compare ways that they do not have. A bond
    answers its twist (velocity and spin of one body against the other), (n, 6), with a wrench
    impulse; both bodies give way to it. motion: velocity and spin of the bodies, (bodies, 6).

    bodies: two of each bond, (2, n). onto: Jacobians from the twists of both to that of the bond,
    (2, n, 6, 6). gives: twist of a body per wrench impulse, (bodies, 6, 6). mobility: what both
    bodies of each bond give way by. law: inverse of the bonds' own blocks. last: twists answered.
    """

    def __init__(self, simulation):
        solver, model = simulation.advance.solver, simulation.model
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

    def twists(self, motion, some=ALL):
        """Twists of the bonds, or of some, at the bodies' motion."""
        return sum(applied(k[some], motion[body[some]]) for k, body in zip(self.onto, self.bodies))

    def pull(self, motion, impulse, some=ALL):
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

    def jacobi(self, motion, twist, momentum=False):
        """The same with all bonds at once, the mass of a body split among its bonds.

        momentum: Nesterov's, begun anew when it leads away (Macklin and others, 2014; Mazhar and
        others, 2015).
        """
        shares = np.bincount(self.bodies.ravel(), minlength=len(self.gives))
        parts = zip(self.bodies, self.mobility)
        solved = np.linalg.inv(
            self.law + sum(shares[body][:, None, None] * part for body, part in parts)
        )
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


class Solving:
    """Observer that solves the dashpots in every way at some times [s].

    found: by time, error after 0, 1, ... sweeps, an array by way.
    """

    def __init__(self, simulation, times):
        self.simulation, self.when, self.found = simulation, At(times), {}

    def observe(self, view):
        """Solve."""
        system, motion = DashpotSystem(self.simulation), view.motion()
        still = np.hstack([motion["velocity"], motion["spin"]])
        fastest = np.linalg.norm(motion["velocity"], axis=1).max()
        kicked, random = still.copy(), np.random.default_rng(0)
        kicked[:, :3] += KICK * fastest * random.standard_normal(motion["velocity"].shape)
        start = kicked, system.twists(still)
        exact = next(itertools.islice(system.gauss_seidel(*start), 200, None))
        ways = system.gauss_seidel(*start), system.jacobi(*start), system.jacobi(*start, True)

        def error(moving):
            return np.linalg.norm((moving - exact)[:, :3], axis=1).max() / fastest

        self.found[view.time_s] = {
            name: np.array([error(kicked), *map(error, itertools.islice(way, SWEEPS))])
            for name, way in zip(WAYS, ways)
        }


def sweeps_to(errors, tolerance):
    """Sweeps until the error is below a tolerance and stays there."""
    return int(np.flatnonzero(errors >= tolerance).max(initial=-1)) + 1


def draw(path, found):
    """Error over sweeps of every way, a line a time."""
    with picture(path, size=(6.0, 4.0)) as (_, axes):
        for name, (words, colour, dashes) in WAYS.items():
            lines = np.transpose([errors[name] for errors in found.values()])
            axes.semilogy(lines, color=colour, ls=dashes, alpha=0.7)[0].set_label(words)
        for tolerance in TOLERANCES:
            axes.axhline(tolerance, color=GREY, linewidth=0.8, linestyle=":")
        axes.lines[-1].set_label("errors of 5, 1 and 0.1 %")
        axes.set(xlabel="sweeps [1]", ylabel="error of velocities [1]", xticks=range(0, 21, 2))
        axes.set(xlim=(0, 20), ylim=(1e-9, 1), title="Each line: one time of the blast")
        axes.legend()


def run(options):
    """Go from time to time, solve in every way, compare."""
    scene, at = paper_scene(options.mesh), study.output_paths(options.out)
    simulation = Simulation(scene, ImplicitDashpots(refresh=4e-7))
    solving = Solving(simulation, options.times)
    looks = {"samples": 1, "title": "blast", "observers": [solving]}
    report = run_simulation(simulation, until=options.times[-1], **looks).report
    errors = pd.concat({time: pd.DataFrame(one) for time, one in solving.found.items()})
    errors.to_csv(at("sweeps.csv"), index_label=["time_s", "sweeps"])
    draw(at("sweeps.png"), solving.found)
    most = {
        f"sweeps_{way}_{t:g}": (max(sweeps_to(one[way], t) for one in solving.found.values()), "1")
        for way in WAYS
        for t in TOLERANCES
    }
    study.finish(options, NAME, most, [report])


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
