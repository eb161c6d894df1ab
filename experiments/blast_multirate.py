"""What do steps that differ from body to body save, and what do they change?

Konno et al., section 4.3: one step for all bodies (the smallest that any of them needs) against a
step for every body, neighbours held (the paper's) or drifted along, at equal l. Expect a small gain
at 5e-5 s, when few bodies move, and a large one at 5e-4 s; and a displacement that hardly differs.

    python experiments/blast_multirate.py             # l = 1e-7 m, ten times the paper's
    python experiments/blast_multirate.py --l 1e-8    # the paper's l: most of an hour (estimated)

The larger l scales all steps and thereby the cost of all three runs alike, and hardly their ratio.
At l = 2e-7 m the run on the paper's block ends as diverged, at 3.4e-4 s.
Times are CPU seconds of stepping alone, without compiling. Writes pictures, CSV of all that is
plotted and summary.json to results/blast_multirate/.
"""

import math
import os
import sys

from _blast import Costs, blast_parser, level_shares, paper_scene
from taichi_dem import (
    At,
    InputError,
    Multirate,
    ProgressBar,
    Uniform,
    plot,
    simulate,
)
from taichi_dem.kit.files import output_folder, write_csv
from taichi_dem.kit.plot_style import styles_of
from taichi_dem.kit.study import (
    Timing,
    figure,
    finish,
    main,
    number,
    show_rows,
    take_defaults,
    whole,
    write_rows,
)
from taichi_dem.output.hole_monitor import HoleMonitor

NAME = "blast_multirate"
METHODS = {
    "uniform": Uniform,
    "multirate_held": Multirate,
    "multirate_drifted": lambda dt0, distance: Multirate(dt0, distance, "drifted"),
}
QUICK = {"l": 1e-7, "until": 6e-5, "repeats": 1, "samples": 12}
FULL = {"l": 1e-7, "until": 5e-4, "repeats": 1, "samples": 100}
EARLY, QUICK_EARLY = 5e-5, 2e-5
#: The paper's minutes at its two instants [s], and its displacements [mm] at the second.
PAPER_MINUTES = {
    "uniform": {5e-5: 16, 5e-4: 3897},
    "multirate_held": {5e-5: 14, 5e-4: 2702},
}
PAPER_MM = {"uniform": {5e-4: 2.16}, "multirate_held": {5e-4: 1.93}}
TABLE = {
    "method": ("method", ""),
    "time [s]": ("time_s", ".3g"),
    "CPU [s]": ("cpu_s", ".3g"),
    "evaluations": ("evaluations", ","),
    "ideal": ("ideal_gain", ".2f"),
    "boundary": ("boundary_gain", ".2f"),
    "realised": ("realised_gain", ".2f"),
    "displacement [mm]": ("displacement_mm", ".4f"),
    "difference": ("displacement_difference", "+.2f%"),
    "broken": ("broken_faces", ""),
    "residual": ("residual_fraction", ".2g%"),
}


def options_parser():
    """Options of this experiment."""
    made = blast_parser(NAME, __doc__)
    made.add_argument("--l", type=number(0, 1), help="largest way of a body in a step [m], 1e-7")
    made.add_argument("--dt0", type=number(0, 1), default=1e-8, help="largest step [s]")
    made.add_argument("--early", type=number(0, 1), help="first instant compared [s], 5e-5")
    made.add_argument("--until", type=number(0, 1), help="second instant compared [s], 5e-4")
    made.add_argument("--samples", type=whole(1, 100000), help="rows of the time series, 100")
    made.add_argument("--repeats", type=whole(1, 100), help="runs of every method, 1")
    return made


class Instant:
    """Report and displacements [mm] at an instant [s]: of the hole, and of the body watched."""

    def __init__(self, time_s):
        self.when = At((time_s,))

    def observe(self, view):
        """Look at the run."""
        hole, place = HoleMonitor(view.model, "hole"), view.motion()["position"]
        self.report, self.radial_mm = view.report(), 1e3 * hole.radial_displacement(place)
        self.moved_mm = 1e3 * hole.monitored_displacement(place)


def follow(name, options, scene):
    """One run of a method: an Instant each for early and late, and the series."""
    method, costs = METHODS[name](options.dt0, options.l), Costs()
    instants = [Instant(time_s) for time_s in (options.early, options.until)]
    with ProgressBar(styles_of([name])[name].label) as bar:
        try:
            result = simulate(
                scene,
                method=method,
                until=options.until,
                driver=options.driver,
                samples=options.samples,
                progress=bar,
                observers=[costs, *instants],
            )
        finally:
            # Also what a run that diverged, or was interrupted, had reached.
            if costs.view is not None:
                history = costs.view.history()
                write_csv(os.path.join(options.out, f"history_{name}.csv"), history)
    return (*instants, {**result.history, **costs.columns}, costs.levels)


def run(options):
    """Run all methods, compare, picture."""
    take_defaults(options, FULL, QUICK)
    if options.early is None:
        options.early = min(QUICK_EARLY if options.quick else EARLY, options.until)
    if options.early > options.until:
        raise InputError(f"early must be at most until, {options.until:g} s, got {options.early:g}")
    scene = paper_scene(options.mesh)
    output_folder(options.out)
    runs = {
        name: [follow(name, options, scene) for _ in range(options.repeats)] for name in METHODS
    }
    rows = table_of(runs)
    write_rows(os.path.join(options.out, "comparison.csv"), rows)
    picture(runs, options)
    print(f"One step for all against a step for each, all at l = {options.l:g} m\n")
    show_rows(rows, TABLE)
    if options.repeats > 1:
        spread = max(row["cpu_spread"] for row in rows)
        print(f"CPU times: medians of {options.repeats} runs, spread up to {spread:.0%}\n")
    reports = [one[1].report for made in runs.values() for one in made]
    finish(options, NAME, figures_of(rows), reports)


def table_of(runs):
    """A row, as a dict, for every method and instant; the first run's counts, all runs' times."""
    rows = []
    for place, instant in enumerate(("early", "late")):
        base = len(rows)
        for name, made in runs.items():
            first = made[0][place]
            report, moved = first.report, float(first.moved_mm)
            timing = Timing.of([one[place].report.run_cpu_seconds for one in made])
            row = {
                "method": name,
                "instant": instant,
                "time_s": report.until_s,
                "cpu_s": timing.median,
                "cpu_spread": timing.spread,
                "substeps": report.substeps,
                "evaluations": report.contact_evaluations,
                "ideal_gain": report.ideal_gain,
                "boundary_gain": report.boundary_gain,
                "displacement_mm": moved,
                "radial_mm": float(first.radial_mm),
                "broken_faces": report.broken_faces,
                "residual_fraction": report.energy_residual_fraction,
            }
            rows.append(row)
            row["realised_gain"] = rows[base]["cpu_s"] / max(row["cpu_s"], 1e-12)
            row["displacement_difference"] = moved / rows[base]["displacement_mm"] - 1.0
    return rows


def figures_of(rows):
    """Figures for summary.json: times, gains and displacements beside the paper's."""
    figures = {}
    for row in rows:
        name, key = row["method"], f"{row['method']}_{row['instant']}"
        minutes, base = paper(PAPER_MINUTES, name, row), paper(PAPER_MINUTES, "uniform", row)
        moved, base_moved = paper(PAPER_MM, name, row), paper(PAPER_MM, "uniform", row)
        figures[f"{key}_cpu_s"] = figure(row["cpu_s"], "s", minutes and 60.0 * minutes)
        figures[f"{key}_evaluations"] = figure(row["evaluations"], "1")
        figures[f"{key}_displacement_mm"] = figure(row["displacement_mm"], "mm", moved)
        papers = {
            "ideal_gain": None,
            "boundary_gain": None,
            "realised_gain": minutes and base / minutes,
            "displacement_difference": moved and moved / base_moved - 1.0,
        }
        if name != "uniform":
            figures.update({f"{key}_{k}": figure(row[k], "1", v) for k, v in papers.items()})
    return figures


def paper(values, name, row):
    """The paper's value for a method at the instant of a row; None where it names none."""
    found = [v for t, v in values.get(name, {}).items() if math.isclose(t, row["time_s"])]
    return found[0] if found else None


def picture(runs, options):
    """Draw and write all that is plotted."""

    def at(name):
        return os.path.join(options.out, name)

    series = {name: made[0][2] for name, made in runs.items()}
    for name, made in series.items():
        shares = level_shares(runs[name][0][3])
        levels = {f"level_{k}": column for k, column in enumerate(shares.T)}
        write_csv(at(f"{name}.csv"), {**made, **levels})
        if name != "uniform":
            plot.plot_levels(at(f"levels_{name}.png"), made["time_s"], shares, options.dt0)
    plot.plot_methods(at("methods.png"), series, "monitor_displacement_mm")


if __name__ == "__main__":
    sys.exit(main(run, options_parser()))
