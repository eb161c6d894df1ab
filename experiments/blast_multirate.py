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

import numpy as np

from _blast import paper_scene
from _cli import (
    BLAST_DRIVERS,
    PAPER_BLOCK,
    figure,
    main,
    number,
    parser,
    print_figures,
    print_table,
    whole,
    write_summary,
)
from _timing import Timing
from taichi_dem import (
    InputError,
    Multirate,
    Simulation,
    Uniform,
    plot,
)
from taichi_dem.kit.files import output_folder, write_csv
from taichi_dem.kit.plot_style import styles_of
from taichi_dem.kit.progress.progress_bar import ProgressBar
from taichi_dem.output.record import Recorder
from taichi_dem.simulate import progress_of
from taichi_dem.simulation import macro_steps

NAME = "blast_multirate"
METHODS = {
    "uniform": lambda dt0, distance: Uniform(dt0, distance),
    "multirate_held": lambda dt0, distance: Multirate(dt0, distance),
    "multirate_drifted": lambda dt0, distance: Multirate(dt0, distance, "drifted"),
}
QUICK = {"l": 1e-7, "early": 2e-5, "until": 6e-5, "repeats": 1, "samples": 12}
FULL = {"l": 1e-7, "early": 5e-5, "until": 5e-4, "repeats": 1, "samples": 100}
#: The paper's minutes at its two instants [s], and its displacements [mm] at the second.
PAPER_MINUTES = {
    "uniform": {5e-5: 16, 5e-4: 3897},
    "multirate_held": {5e-5: 14, 5e-4: 2702},
}
PAPER_MM = {"uniform": {5e-4: 2.16}, "multirate_held": {5e-4: 1.93}}


def options_parser():
    """Options of this experiment."""
    made = parser(NAME, __doc__, BLAST_DRIVERS)
    made.add_argument("--mesh", default=PAPER_BLOCK, help="tetrahedra with a face group hole")
    made.add_argument("--l", type=number(0, 1), help="largest way of a body in a step [m], 1e-7")
    made.add_argument("--dt0", type=number(0, 1), default=1e-8, help="largest step [s]")
    made.add_argument("--early", type=number(0, 1), help="first instant compared [s], 5e-5")
    made.add_argument("--until", type=number(0, 1), help="second instant compared [s], 5e-4")
    made.add_argument("--samples", type=whole(1, 100000), help="rows of the time series, 100")
    made.add_argument("--repeats", type=whole(1, 100), help="runs of every method, 1")
    return made


def follow(name, options, scene):
    """One run of a method: (report at the early instant, report at the end, series, seconds)."""
    method = METHODS[name](options.dt0, options.l)
    last = macro_steps(options.until, method.dt0)
    early = min(last, macro_steps(options.early, method.dt0))
    marks = {round(last * k / options.samples) for k in range(options.samples + 1)}
    reports, costs = {}, {"cpu_s": [], "evaluations": [], "level": []}
    with ProgressBar(styles_of([name])[name].label) as bar:
        simulation = Simulation(scene, method, options.driver)
        recorder = Recorder(simulation, "hole")
        simulation.start()
        try:
            for step in sorted(marks | {early}):
                simulation.advance_to(step, lambda: bar(progress_of(simulation, options.until)))
                reports[step] = simulation.report()
                recorder.sample()
                costs["cpu_s"].append(simulation.run_cpu_seconds)
                costs["evaluations"].append(reports[step].contact_evaluations)
                costs["level"].append(simulation.state.level.to_numpy())
        finally:
            # Also what a run that diverged, or was interrupted, had reached.
            write_csv(os.path.join(options.out, f"history_{name}.csv"), recorder.history())
    series = {**recorder.history(), **costs}
    series["row_early"] = sorted(marks | {early}).index(early)
    return reports[early], reports[last], series


def run(options):
    """Run all methods, compare, picture."""
    defaults = QUICK if options.quick else FULL
    for name, value in defaults.items():
        if getattr(options, name) is None and name != "early":
            setattr(options, name, value)
    if options.early is None:
        options.early = min(defaults["early"], options.until)
    if options.early > options.until:
        raise InputError(f"early must be at most until, {options.until:g} s, got {options.early:g}")
    scene = paper_scene(options.mesh)
    output_folder(options.out)
    runs = {
        name: [follow(name, options, scene) for _ in range(options.repeats)] for name in METHODS
    }
    rows = table_of(runs)
    write_csv(os.path.join(options.out, "comparison.csv"), columns_of(rows))
    series = {name: made[0][2] for name, made in runs.items()}
    picture(series, options)
    figures = figures_of(rows)
    compile_seconds = sum(one[1].compile_seconds for made in runs.values() for one in made)
    run_seconds = sum(one[1].run_seconds for made in runs.values() for one in made)
    write_summary(
        options.out, NAME, figures, compile_seconds=compile_seconds, run_seconds=run_seconds
    )
    print_comparison(rows, options)
    print()
    print_figures(figures)
    print(f"\nPictures and tables are in {options.out}")


def table_of(runs):
    """A row, as a dict, for every method and instant; the first run's counts, all runs' times."""
    rows = []
    for place, instant in enumerate(("early", "late")):
        for name, made in runs.items():
            report, series = made[0][place], made[0][2]
            at = series["row_early"] if instant == "early" else -1
            timing = Timing.of([one[place].run_cpu_seconds for one in made])
            rows.append(
                {
                    "method": name,
                    "instant": instant,
                    "time_s": report.until_s,
                    "cpu_s": timing.median,
                    "cpu_spread": timing.spread,
                    "substeps": report.substeps,
                    "evaluations": report.contact_evaluations,
                    "ideal_gain": report.ideal_gain,
                    "boundary_gain": report.boundary_gain,
                    "displacement_mm": float(series["monitor_displacement_mm"][at]),
                    "radial_mm": float(series["hole_radial_displacement_mm"][at]),
                    "broken_faces": report.broken_faces,
                    "residual_fraction": report.energy_residual_fraction,
                }
            )
    for row in rows:
        one = reference(rows, row["instant"])
        row["realised_gain"] = one["cpu_s"] / max(row["cpu_s"], 1e-12)
        row["displacement_difference"] = row["displacement_mm"] / one["displacement_mm"] - 1.0
    return rows


def reference(rows, instant):
    """The row of the uniform run at an instant."""
    return next(row for row in rows if (row["method"], row["instant"]) == ("uniform", instant))


def columns_of(rows):
    """Rows as columns."""
    return {name: [row[name] for row in rows] for name in rows[0]}


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
        if name == "uniform":
            continue
        figures[f"{key}_ideal_gain"] = figure(row["ideal_gain"], "1")
        figures[f"{key}_boundary_gain"] = figure(row["boundary_gain"], "1")
        gain = minutes and base / minutes
        figures[f"{key}_realised_gain"] = figure(row["realised_gain"], "1", gain)
        difference = moved and moved / base_moved - 1.0
        figures[f"{key}_displacement_difference"] = figure(
            row["displacement_difference"], "1", difference
        )
    return figures


def paper(values, name, row):
    """The paper's value for a method at the instant of a row; None where it names none."""
    found = [v for t, v in values.get(name, {}).items() if math.isclose(t, row["time_s"])]
    return found[0] if found else None


def print_comparison(rows, options):
    """The comparison as a table."""
    header = ["method", "time [s]", "CPU [s]", "evaluations", "ideal", "boundary", "realised"]
    header += ["displacement [mm]", "difference", "broken", "residual"]
    cells = [
        (
            row["method"],
            f"{row['time_s']:.3g}",
            f"{row['cpu_s']:.3g}",
            f"{row['evaluations']:,}",
            *(f"{row[name]:.2f}" for name in ("ideal_gain", "boundary_gain", "realised_gain")),
            f"{row['displacement_mm']:.4f}",
            f"{100 * row['displacement_difference']:+.2f} %",
            row["broken_faces"],
            f"{100 * row['residual_fraction']:.2g} %",
        )
        for row in rows
    ]
    print(f"One step for all against a step for each, all at l = {options.l:g} m\n")
    print_table(cells, header)
    if options.repeats > 1:
        print(f"CPU times: medians of {options.repeats} runs, spread up to ", end="")
        print(f"{100 * max(row['cpu_spread'] for row in rows):.0f} %")


def picture(series, options):
    """Draw and write all that is plotted."""

    def at(name):
        return os.path.join(options.out, name)

    for name, made in series.items():
        shares = level_shares(made.pop("level"))
        made.pop("row_early")
        levels = {f"level_{k}": column for k, column in enumerate(shares.T)}
        write_csv(at(f"{name}.csv"), {**made, **levels})
        if name != "uniform":
            plot.plot_levels(at(f"levels_{name}.png"), made["time_s"], shares, options.dt0)
    plot.plot_methods(at("methods.png"), series, "monitor_displacement_mm")


def level_shares(levels):
    """Share of bodies on each level: rows (sample, level) that sum to 1."""
    count = max(int(level.max()) for level in levels) + 1
    return np.array([np.bincount(level, minlength=count) / len(level) for level in levels])


if __name__ == "__main__":
    sys.exit(main(run, options_parser()))
