"""Which method solves the paper's blast, how fast, and how well?

Every method on the same scene: the paper's rule with one step for all and with a step for each,
steps controlled by what limits them, dashpots limited to what the step bears, and dashpots solved
together. Expect the paper's rule to take a hundred times as long as the solved dashpots for the
same answer: its displacement limit l is no accuracy need but an indirect rule of stability.

    python experiments/blast_methods.py                    # about eight minutes, most of it the
    python experiments/blast_methods.py --methods implicit,explicit_limited      # paper's uniform

The reference is the implicit method at a sixteenth of its step. Displacement: mean of the hole's
wall. The largest stable step is found by doubling, in runs to --stable-until that must end within
10 % of the reference. A bond on the edge of
breaking near 2e-4 s makes some runs go another way from there on, one per cent apart at the end.
Times are CPU seconds of stepping alone. Writes methods.png, the table as CSV, the history of every
method and summary.json to results/blast_methods/.
"""

import os
import sys

import numpy as np

from _blast import METHODS, paper_scene
from _cli import (
    BLAST_DRIVERS,
    PAPER_BLOCK,
    figure,
    main,
    number,
    parser,
    print_figures,
    print_table,
    several,
    whole,
    write_summary,
)
from taichi_dem import ImplicitDashpots, InputError, Simulation, SimulationDiverged, plot
from taichi_dem.kit.files import output_folder, write_csv
from taichi_dem.kit.progress.progress_bar import ProgressBar
from taichi_dem.output.record import Recorder
from taichi_dem.simulate import progress_of
from taichi_dem.simulation import macro_steps

NAME = "blast_methods"
REFERENCE = ImplicitDashpots(2.5e-8, sweeps=(6, 40))
QUICK = {"until": 1e-5, "stable_until": 1e-5, "samples": 10, "doublings": 0}
#: Error of the displacement beyond which a run counts as unstable though no body ran away.
USABLE = 0.1
FULL = {"until": 5e-4, "stable_until": 1e-4, "samples": 100, "doublings": 8}


def method_name(text):
    """Type of an option that names a method."""
    if text not in METHODS:
        raise InputError(f"method must be one of {', '.join(METHODS)}, got {text!r}")
    return text


def options_parser():
    """Options of this experiment."""
    made = parser(NAME, __doc__, BLAST_DRIVERS)
    made.add_argument("--mesh", default=PAPER_BLOCK, help="tetrahedra with a face group hole")
    made.add_argument("--until", type=number(0, 1), help="simulated time [s], 5e-4")
    made.add_argument("--stable-until", type=number(0, 1), help="for the stable step [s], 1e-4")
    made.add_argument("--samples", type=whole(1, 100000), help="rows of the time series, 100")
    made.add_argument("--doublings", type=whole(0, 20), help="tried for the largest stable step, 8")
    made.add_argument(
        "--methods", type=several(method_name), default=list(METHODS), help="by comma; all"
    )
    return made


def follow(scene, method, options, title):
    """Report and time series of one run."""
    last = macro_steps(options.until, method.dt0)
    seconds, evaluations = [], []
    with ProgressBar(title) as bar:
        simulation = Simulation(scene, method, options.driver)
        recorder = Recorder(simulation, "hole")
        simulation.start()
        for step in sorted({round(last * k / options.samples) for k in range(options.samples + 1)}):
            simulation.advance_to(step, lambda: bar(progress_of(simulation, options.until)))
            recorder.sample()
            seconds.append(simulation.run_cpu_seconds)
            evaluations.append(simulation.evaluations())
    return simulation.report(), {
        **recorder.history(),
        "cpu_s": seconds,
        "evaluations": evaluations,
    }


def serves(scene, method, exact, options):
    """Whether a method reaches the time for stability, undiverged and near the reference."""
    simulation = Simulation(scene, method, options.driver)
    recorder = Recorder(simulation, "hole")
    try:
        simulation.advance_to(macro_steps(options.stable_until, method.dt0))
    except SimulationDiverged:
        return False
    recorder.sample()
    moved = recorder.history()["hole_radial_displacement_mm"][-1]
    wanted = np.interp(simulation.time_s, exact["time_s"], exact["hole_radial_displacement_mm"])
    return abs(moved / wanted - 1.0) < USABLE


def largest_stable_step(scene, make, step, exact, options):
    """Largest step [s], a power of two from the one in use, with which a method serves."""
    with ProgressBar("largest stable step") as bar:
        for tried in range(options.doublings):
            bar.count(tried, options.doublings)
            if not serves(scene, make(2.0 * step), exact, options):
                return step
            step *= 2.0
    return step


def row_of(name, report, series, wanted, stable, step):
    """One row of the table; wanted: displacement of the reference [mm]."""
    moved = float(series["hole_radial_displacement_mm"][-1])
    return {
        "method": name,
        "step_s": step,
        "smallest_step_s": float(np.min(series["smallest_step_s"])),
        "seconds": report.run_cpu_seconds,
        "evaluations": report.contact_evaluations,
        "displacement_mm": moved,
        "displacement_error": abs(moved / wanted - 1.0),
        "broken_faces": report.broken_faces,
        "ledger_residual_fraction": report.energy_residual_fraction,
        "largest_stable_step_s": stable,
        "bound_by": max(report.bound_by, key=report.bound_by.get),
    }


def run(options):
    """Run the reference and all methods, compare, picture."""
    for name, value in (QUICK if options.quick else FULL).items():
        if getattr(options, name) is None:
            setattr(options, name, value)
    scene = paper_scene(options.mesh)
    output_folder(options.out)
    best, exact = follow(scene, REFERENCE, options, "reference")
    write_csv(os.path.join(options.out, "history_reference.csv"), exact)
    wanted = float(exact["hole_radial_displacement_mm"][-1])
    rows, reports, histories = [], [best], {}
    for name in options.methods:
        make, step = METHODS[name]
        report, series = follow(scene, make(step), options, name)
        write_csv(os.path.join(options.out, f"history_{name}.csv"), series)
        stable = largest_stable_step(scene, make, step, exact, options)
        rows.append(row_of(name, report, series, wanted, stable, step))
        reports.append(report)
        histories[name] = series
    write_csv(
        os.path.join(options.out, "methods.csv"),
        {key: [row[key] for row in rows] for key in rows[0]},
    )
    path, moved = os.path.join(options.out, "methods.png"), "hole_radial_displacement_mm"
    plot.plot_methods(path, {"reference": exact, **histories}, moved)
    figures = figures_of(rows, best, wanted)
    write_summary(
        options.out,
        NAME,
        figures,
        compile_seconds=sum(report.compile_seconds for report in reports),
        run_seconds=sum(report.run_seconds for report in reports),
    )
    print_rows(rows, best, wanted)
    print()
    print_figures(figures)
    print(f"\nPictures and tables are in {options.out}")


def figures_of(rows, best, wanted):
    """Figures for summary.json: the table's, by method, and the reference's."""
    units = {
        "seconds": "s",
        "displacement_error": "1",
        "broken_faces": "1",
        "ledger_residual_fraction": "1",
        "largest_stable_step_s": "s",
        "evaluations": "1",
    }
    figures = {
        "reference_displacement_mm": figure(wanted, "mm"),
        "reference_broken_faces": figure(best.broken_faces, "1"),
        "reference_seconds": figure(best.run_cpu_seconds, "s"),
    }
    for row in rows:
        for key, unit in units.items():
            figures[f"{key}_{row['method']}"] = figure(row[key], unit)
    return figures


def print_rows(rows, best, wanted):
    """The comparison as a table."""
    print(
        f"Reference: {REFERENCE.name} at {REFERENCE.dt:g} s, {best.run_cpu_seconds:.3g} s of CPU: "
        f"hole {wanted:.4f} mm, {best.broken_faces} faces\n"
    )
    header = ["method", "step [s]", "smallest", "stable to", "CPU [s]", "evaluations"]
    header += ["hole [mm]", "error", "faces", "residual", "most bound by"]
    cells = [
        (
            row["method"],
            f"{row['step_s']:.2g}",
            f"{row['smallest_step_s']:.2g}",
            f"{row['largest_stable_step_s']:.2g}",
            f"{row['seconds']:.3g}",
            f"{row['evaluations']:,}",
            f"{row['displacement_mm']:.4f}",
            f"{100 * row['displacement_error']:.2g} %",
            row["broken_faces"],
            f"{100 * row['ledger_residual_fraction']:.2g} %",
            row["bound_by"],
        )
        for row in rows
    ]
    print_table(cells, header)


if __name__ == "__main__":
    sys.exit(main(run, options_parser()))
