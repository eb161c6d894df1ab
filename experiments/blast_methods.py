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

from _blast import METHODS, Costs, blast_parser, paper_scene
from taichi_dem import (
    ImplicitDashpots,
    InputError,
    ProgressBar,
    SimulationDiverged,
    plot,
    simulate,
)
from taichi_dem.kit.files import output_folder, write_csv
from taichi_dem.kit.study import (
    figure,
    figures_from,
    finish,
    main,
    number,
    several,
    show_rows,
    take_defaults,
    whole,
    write_rows,
)

NAME = "blast_methods"
REFERENCE = ImplicitDashpots(2.5e-8, sweeps=(6, 40))
QUICK = {"until": 1e-5, "stable_until": 1e-5, "samples": 10, "doublings": 0}
FULL = {"until": 5e-4, "stable_until": 1e-4, "samples": 100, "doublings": 8}
#: Error of the displacement beyond which a run counts as unstable though no body ran away.
USABLE = 0.1
MOVED = "hole_radial_displacement_mm"
UNITS = {
    "seconds": "s",
    "displacement_error": "1",
    "broken_faces": "1",
    "ledger_residual_fraction": "1",
    "largest_stable_step_s": "s",
    "evaluations": "1",
}
TABLE = {
    "method": ("method", ""),
    "step [s]": ("step_s", ".2g"),
    "smallest": ("smallest_step_s", ".2g"),
    "stable to": ("largest_stable_step_s", ".2g"),
    "CPU [s]": ("seconds", ".3g"),
    "evaluations": ("evaluations", ","),
    "hole [mm]": ("displacement_mm", ".4f"),
    "error": ("displacement_error", ".2g%"),
    "faces": ("broken_faces", ""),
    "residual": ("ledger_residual_fraction", ".2g%"),
    "most bound by": ("bound_by", ""),
}


def method_name(text):
    """Type of an option that names a method."""
    if text not in METHODS:
        raise InputError(f"method must be one of {', '.join(METHODS)}, got {text!r}")
    return text


def options_parser():
    """Options of this experiment."""
    made = blast_parser(NAME, __doc__)
    made.add_argument("--until", type=number(0, 1), help="simulated time [s], 5e-4")
    made.add_argument("--stable-until", type=number(0, 1), help="for the stable step [s], 1e-4")
    made.add_argument("--samples", type=whole(1, 100000), help="rows of the time series, 100")
    made.add_argument("--doublings", type=whole(0, 20), help="tried for the largest stable step, 8")
    made.add_argument(
        "--methods", type=several(method_name), default=list(METHODS), help="by comma; all"
    )
    return made


def follow(scene, method, options, name):
    """Report and time series of one run; writes the series."""
    costs = Costs()
    with ProgressBar(name) as bar:
        result = simulate(
            scene,
            method=method,
            until=options.until,
            driver=options.driver,
            samples=options.samples,
            progress=bar,
            observers=[costs],
        )
    series = {**result.history, **costs.columns}
    write_csv(os.path.join(options.out, f"history_{name}.csv"), series)
    return result.report, series


def serves(scene, method, exact, options):
    """Whether a method reaches the time for stability, undiverged and near the reference."""
    until, driver = options.stable_until, options.driver
    try:
        found = simulate(
            scene, method=method, until=until, driver=driver, samples=1, progress=None
        ).history
    except SimulationDiverged:
        return False
    wanted = np.interp(found["time_s"][-1], exact["time_s"], exact[MOVED])
    return abs(found[MOVED][-1] / wanted - 1.0) < USABLE


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
    moved = float(series[MOVED][-1])
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
    take_defaults(options, FULL, QUICK)
    scene = paper_scene(options.mesh)
    output_folder(options.out)
    best, exact = follow(scene, REFERENCE, options, "reference")
    wanted = float(exact[MOVED][-1])
    rows, reports, histories = [], [best], {"reference": exact}
    for name in options.methods:
        make, step = METHODS[name]
        report, histories[name] = follow(scene, make(step), options, name)
        stable = largest_stable_step(scene, make, step, exact, options)
        rows.append(row_of(name, report, histories[name], wanted, stable, step))
        reports.append(report)
    write_rows(os.path.join(options.out, "methods.csv"), rows)
    plot.plot_methods(os.path.join(options.out, "methods.png"), histories, MOVED)
    figures = {
        "reference_displacement_mm": figure(wanted, "mm"),
        "reference_broken_faces": figure(best.broken_faces, "1"),
        "reference_seconds": figure(best.run_cpu_seconds, "s"),
    }
    for row in rows:
        figures.update(figures_from(row, UNITS, f"{{}}_{row['method']}"))
    print(
        f"Reference: {REFERENCE.name} at {REFERENCE.dt:g} s, {best.run_cpu_seconds:.3g} s of CPU: "
        f"hole {wanted:.4f} mm, {best.broken_faces} faces\n"
    )
    show_rows(rows, TABLE)
    finish(options, NAME, figures, reports)


if __name__ == "__main__":
    sys.exit(main(run, options_parser()))
