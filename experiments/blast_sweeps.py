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

from _blast import paper_scene
from _cli import (
    PAPER_BLOCK,
    figure,
    main,
    parser,
    print_figures,
    print_table,
    write_summary,
)
from _dashpot_system import DashpotSystem
from taichi_dem import ImplicitDashpots, Simulation
from taichi_dem.kit.files import output_folder, write_csv
from taichi_dem.kit.plot_style import BROWN, GREY, STYLES, VIOLET, picture
from taichi_dem.kit.progress.progress_bar import ProgressBar
from taichi_dem.simulate import progress_of
from taichi_dem.simulation import macro_steps

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
    made = parser(NAME, __doc__)
    made.add_argument("--mesh", default=PAPER_BLOCK, help="tetrahedra with a face group hole")
    return made


def errors_at(simulation):
    """Error after 0, 1, ... sweeps, an array by way."""
    system, state = DashpotSystem(simulation), simulation.state.motion()
    still = np.hstack([state["velocity"], state["spin"]])
    fastest = np.linalg.norm(state["velocity"], axis=1).max()
    kicked = still.copy()
    random = np.random.default_rng(0)
    kicked[:, :3] += KICK * fastest * random.standard_normal(state["velocity"].shape)
    twist = system.twists(still)
    exact = next(itertools.islice(system.gauss_seidel(kicked, twist), 200, None))
    ways = {
        "gauss_seidel": system.gauss_seidel(kicked, twist),
        "jacobi": system.jacobi(kicked, twist),
        "momentum": system.jacobi(kicked, twist, momentum=True),
    }

    def error(motion):
        return np.linalg.norm((motion - exact)[:, :3], axis=1).max() / fastest

    return {
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
    found = {}
    times = QUICK_TIMES if options.quick else TIMES
    with ProgressBar("blast") as bar:
        simulation = Simulation(scene, ImplicitDashpots(refresh=4e-7))
        simulation.start()
        for time_s in times:
            last = macro_steps(time_s, simulation.method.dt0)
            simulation.advance_to(last, lambda: bar(progress_of(simulation, times[-1])))
            found[simulation.time_s] = errors_at(simulation)
    write_csv(
        os.path.join(options.out, "sweeps.csv"),
        {
            "time_s": np.repeat(list(found), SWEEPS + 1),
            "sweeps": np.tile(np.arange(SWEEPS + 1), len(found)),
            **{name: np.concatenate([errors[name] for errors in found.values()]) for name in WAYS},
        },
    )
    draw(os.path.join(options.out, "sweeps.png"), found)
    figures = figures_of(found)
    write_summary(
        options.out,
        NAME,
        figures,
        compile_seconds=simulation.compile_seconds,
        run_seconds=simulation.run_seconds,
    )
    print_rows(found)
    print()
    print_figures(figures)
    print(f"\nPicture and table are in {options.out}")


def figures_of(found):
    """Most sweeps over all times, by way and tolerance."""
    return {
        f"sweeps_{name}_{tolerance:g}": figure(
            max(sweeps_to(errors[name], tolerance) for errors in found.values()), "1"
        )
        for name in WAYS
        for tolerance in TOLERANCES
    }


def print_rows(found):
    """Sweeps to every tolerance, a row a time and way."""
    cells = [
        (f"{1e6 * time_s:.0f}", words, *(sweeps_to(errors[name], t) for t in TOLERANCES))
        for time_s, errors in found.items()
        for name, (words, _) in WAYS.items()
    ]
    print_table(cells, ["t [us]", "way", *(f"to {100 * t:g} %" for t in TOLERANCES)])


if __name__ == "__main__":
    sys.exit(main(run, options_parser()))
