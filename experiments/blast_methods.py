"""Which method solves the paper's blast, how fast, and how well?

All methods run the same scene: the paper's rule with one step for all and with a step for each
body, controlled steps, dashpots limited to what is stable at the step, and dashpots solved
together. Expect the paper's rule to take a hundred times as long as the solved dashpots for the
same answer: its displacement limit l is an indirect stability rule, not a measure of accuracy.

    python experiments/blast_methods.py                    # about eight minutes, most of it the
    python experiments/blast_methods.py --methods implicit,explicit_limited      # paper's uniform

The reference is the implicit method at a sixteenth of its step. The displacement is the mean of the
hole's wall. One bond nearly breaks at 2e-4 s; it breaks in some runs, which end one per cent away.
Times are CPU seconds of stepping alone. Writes methods.png, levels_NAME.png for every method with a
step for each body, the table as CSV, the history of every method and summary.json to
results/blast_methods/.
"""

import sys
from functools import partial
from operator import itemgetter
from types import SimpleNamespace

import numpy as np

from cases.blast import METHODS, blast_parser, paper_scene, run_costs, run_options
from taichi_dem import ImplicitDashpots, simulate
from taichi_dem.kit import study
from taichi_dem.kit.files import write_csv
from taichi_dem.kit.plot_style import picture, styles_of
from taichi_dem.plot.series import level_shares, plot_levels

NAME = "blast_methods"
REFERENCE = "reference", partial(ImplicitDashpots, sweeps=(6, 40)), 2.5e-8
#: Those of the quick job, long enough for faces to break: the paper's rule would take minutes.
QUICK_METHODS = ["explicit_limited", "implicit"]
SETTINGS = {
    "methods": ([*METHODS], QUICK_METHODS, study.several(study.one_of(METHODS)), "default all"),
    "until": (5e-4, 6e-5, study.number(0, 1), "simulated time [s], default 5e-4"),
    "samples": (100, 10),
}
#: CPU seconds of the paper's runs to 0.5 ms, section 4.3.
PAPER = {"paper_uniform": 3897 * 60.0, "paper_multirate": 2702 * 60.0}
MOVED = "hole_radial_displacement_mm"
TABLE = study.Table(
    method=("name", "method"),
    step_s=("step", "step [s]", ".2g"),
    smallest_step_s=(lambda one: float(one.series["smallest_step_s"].min()), "smallest", ".2g"),
    seconds=("report.run_cpu_seconds", "CPU [s]", ".3g", "s"),
    evaluations=("report.contact_evaluations", "evaluations", ",", "1"),
    displacement_mm=("moved", "hole [mm]", ".4f"),
    displacement_error=("error", "error", ".2g%", "1"),
    broken_faces=("report.broken_faces", "faces", "", "1"),
    ledger_residual_fraction=("report.energy_residual_fraction", "residual", ".2g%", "1"),
    bound_by=(lambda one: max(one.report.bound_by.items(), key=itemgetter(1))[0], "most bound by"),
)
options_parser = partial(blast_parser, NAME, __doc__, settings=SETTINGS)


def follow(scene, name, make, step, options):
    """One run of a method with a step [s]; writes its time series."""
    costs, method = run_costs(), make(step)
    result = simulate(scene, method=method, title=name, observers=[costs], **run_options(options))
    series = {**result.series, "cpu_s": costs["cpu_s"], "evaluations": costs["evaluations"]}
    write_csv(f"{options.out}/history_{name}.csv", series)
    if not method.uniform:
        shares, path = level_shares(costs.rows["level"]), f"{options.out}/levels_{name}.png"
        plot_levels(path, series["time_s"], shares, step)
    made = {"report": result.report, "series": series, "moved": float(series[MOVED][-1])}
    return SimpleNamespace(name=name, make=make, step=step, **made)


def draw(path, series):
    """Cost, work and displacement of the hole over time, its difference from the first method.

    series: by method, columns of its history.
    """
    with picture(path, 2, 2, size=(9.0, 6.4)) as (_, ((cost, work), (moved, words))):
        first, styles = next(iter(series.values())), styles_of(series)
        for name, made in series.items():
            style, time = styles[name], 1e3 * made["time_s"]
            look = {"color": style.colour, "linestyle": style.line, "label": style.label}
            # A run begins with nothing done, where a logarithm has no end.
            cost.plot(time[1:], made["cpu_s"][1:], **look)
            work.plot(time[1:], 1e-6 * np.asarray(made["evaluations"][1:]), **look)
            # Largest steps differ, and with them the times of the samples.
            there = np.interp(time, 1e3 * first["time_s"], first[MOVED])
            there = np.where(there > 1e-3 * there.max(), there, np.nan)
            moved.plot(time, 100.0 * (made[MOVED] / there - 1.0), **look)
        cost.set(yscale="log", ylabel="CPU time of stepping [s]")
        work.set(yscale="log", ylabel="evaluations of bonds\nand contact pairs [10⁶]")
        base = next(iter(styles.values())).label
        moved.set_ylabel(f"displacement of the hole,\ndifference from\n{base} [%]")
        for axes in (cost, work, moved):
            axes.set(xlabel="time [ms]", xlim=(0.0, time[-1]))
        words.set_axis_off()
        words.legend(*moved.get_legend_handles_labels(), loc="center left", handlelength=4.0)


def run(options):
    """Run the reference and all methods, compare, picture."""
    scene, at = paper_scene(options.mesh), study.output_paths(options.out)
    reference = follow(scene, *REFERENCE, options)
    runs = [follow(scene, name, *METHODS[name], options) for name in options.methods]
    for one in runs:
        one.error = abs(one.moved / reference.moved - 1.0)
    rows, best = TABLE.rows(runs), reference.report
    study.write_rows(at("methods.csv"), rows)
    TABLE.show(rows)
    draw(at("methods.png"), {one.name: one.series for one in (reference, *runs)})
    figures = {
        "reference_displacement_mm": (reference.moved, "mm"),
        "reference_broken_faces": (best.broken_faces, "1"),
        "reference_seconds": (best.run_cpu_seconds, "s"),
    }
    for row in rows:
        paper = {"seconds": PAPER.get(row["method"]) if options.until == 5e-4 else None}
        figures.update(TABLE.figures(row, "{key}_{method}", paper))
    study.finish(options, NAME, figures, [one.report for one in (reference, *runs)])


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
