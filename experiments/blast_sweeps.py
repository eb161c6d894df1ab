"""Which way of sweeping solves the dashpots of all bonds in the fewest sweeps?

At several times of the paper's blast the velocities of all bodies are disturbed by 5 % of the
largest, as springs and loads do in a step, and the dashpots are solved from what the step before
has left: bond by bond in the order of their colours (Gauss-Seidel, what ``ImplicitDashpots`` does),
or all at once with the masses split (Jacobi), without and with momentum. Expect Gauss-Seidel to
need a half of the sweeps or fewer: a bond sees at once what its neighbours have done. As bonds of
one colour share no body, they may be visited side by side, and no bit depends on the threads; so
nothing is left for Jacobi but fewer launches on a GPU, one a sweep where colours take five.

    python experiments/blast_sweeps.py

Error: largest of a body's velocity against a solution to round-off, over the largest speed. Writes
sweeps.png, sweeps.csv and summary.json to results/blast_sweeps/.
"""

import itertools
import sys
from functools import partial

import numpy as np

from _blast import blast_parser, paper_scene
from _dashpot_system import DashpotSystem
from taichi_dem import At, ImplicitDashpots, Simulation
from taichi_dem.kit import study
from taichi_dem.kit.plot_style import BROWN, GREY, STYLES, VIOLET, picture
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
KICK, SWEEPS = 0.05, 30
options_parser = partial(blast_parser, NAME, __doc__, (), settings=SETTINGS)


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
    errors = [
        {"time_s": time_s, "sweeps": k, **{way: found[way][k] for way in WAYS}}
        for time_s, found in solving.found.items()
        for k in range(SWEEPS + 1)
    ]
    study.write_rows(at("sweeps.csv"), errors)
    draw(at("sweeps.png"), solving.found)
    rows = [
        {"t": 1e6 * time_s, "way": words, **{t: sweeps_to(found[way], t) for t in TOLERANCES}}
        for time_s, found in solving.found.items()
        for way, (words, *_) in WAYS.items()
    ]
    tolerances = {f"to {100 * t:g} %": (t, "") for t in TOLERANCES}
    study.show_rows(rows, {"t [us]": ("t", ".0f"), "way": ("way", ""), **tolerances})
    most = {
        f"sweeps_{way}_{t:g}": (max(row[t] for row in rows if row["way"] == words), "1")
        for way, (words, *_) in WAYS.items()
        for t in TOLERANCES
    }
    study.finish(options, NAME, most, [report])


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
