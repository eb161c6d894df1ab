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
import os
import sys

import numpy as np

from _blast import blast_parser, paper_scene
from taichi_dem import At, ImplicitDashpots, Simulation
from taichi_dem.diagnostics.dashpot_system import DashpotSystem
from taichi_dem.kit.files import output_folder
from taichi_dem.kit.plot_style import BROWN, GREY, STYLES, VIOLET, picture
from taichi_dem.kit.progress.progress_bar import ProgressBar
from taichi_dem.kit.study import figure, finish, main, show_rows, write_rows
from taichi_dem.simulate import run_simulation

NAME = "blast_sweeps"
TIMES, QUICK_TIMES = (2e-5, 1e-4, 2e-4, 4e-4), (5e-6, 2e-5)
#: Way -> (words, colour); the first is that of the method with solved dashpots.
WAYS = {
    "gauss_seidel": ("Gauss-Seidel by colours", STYLES["implicit"].colour),
    "jacobi": ("Jacobi, split masses", BROWN),
    "momentum": ("Jacobi with momentum", VIOLET),
}
TOLERANCES = (0.05, 0.01, 1e-3)
KICK, SWEEPS = 0.05, 30


def options_parser():
    """Options of this experiment."""
    return blast_parser(NAME, __doc__, ())


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
        twist = system.twists(still)
        exact = next(itertools.islice(system.gauss_seidel(kicked, twist), 200, None))
        ways = {
            "gauss_seidel": system.gauss_seidel(kicked, twist),
            "jacobi": system.jacobi(kicked, twist),
            "momentum": system.jacobi(kicked, twist, momentum=True),
        }

        def error(moving):
            return np.linalg.norm((moving - exact)[:, :3], axis=1).max() / fastest

        self.found[view.time_s] = {
            name: np.array([error(kicked), *map(error, itertools.islice(way, SWEEPS))])
            for name, way in ways.items()
        }


def sweeps_to(errors, tolerance):
    """Sweeps until the error is below a tolerance and stays there."""
    return int(np.flatnonzero(errors >= tolerance).max(initial=-1)) + 1


def draw(path, found):
    """Error over sweeps of every way, a line a time."""
    with picture(path, size=(6.0, 4.0)) as (_, axes):
        for name, (words, colour) in WAYS.items():
            for place, errors in enumerate(found.values()):
                label = words if place == 0 else None
                axes.semilogy(errors[name], color=colour, alpha=0.7, label=label)
        for tolerance in TOLERANCES:
            axes.axhline(tolerance, color=GREY, linewidth=0.8, linestyle=":")
        axes.lines[-1].set_label("errors of 5, 1 and 0.1 %")
        axes.set(xlabel="sweeps [1]", ylabel="error of velocities [1]")
        axes.set(xlim=(0, 20), ylim=(1e-9, 1))
        axes.set_xticks(range(0, 21, 2))
        axes.set_title("Each line: one time of the blast")
        axes.legend()


def run(options):
    """Go from time to time, solve in every way, compare."""
    scene = paper_scene(options.mesh)
    output_folder(options.out)
    times = QUICK_TIMES if options.quick else TIMES
    with ProgressBar("blast") as bar:
        simulation = Simulation(scene, ImplicitDashpots(refresh=4e-7))
        solving = Solving(simulation, times)
        looks = {"samples": 1, "progress": bar, "observers": [solving]}
        report = run_simulation(simulation, until=times[-1], **looks).report
    found = solving.found
    rows = [
        {"time_s": time_s, "sweeps": k, **{way: errors[way][k] for way in WAYS}}
        for time_s, errors in found.items()
        for k in range(SWEEPS + 1)
    ]
    write_rows(os.path.join(options.out, "sweeps.csv"), rows)
    draw(os.path.join(options.out, "sweeps.png"), found)
    rows = [
        {"t": 1e6 * time_s, "way": way, **{t: sweeps_to(errors[way], t) for t in TOLERANCES}}
        for time_s, errors in found.items()
        for way in WAYS
    ]
    figures = {
        f"sweeps_{way}_{t:g}": figure(max(row[t] for row in rows if row["way"] == way), "1")
        for way in WAYS
        for t in TOLERANCES
    }
    rows = [{**row, "way": WAYS[row["way"]][0]} for row in rows]
    tolerances = {f"to {100 * t:g} %": (t, "") for t in TOLERANCES}
    show_rows(rows, {"t [us]": ("t", ".0f"), "way": ("way", ""), **tolerances})
    finish(options, NAME, figures, [report])


if __name__ == "__main__":
    sys.exit(main(run, options_parser()))
