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

import sys
from functools import partial
from types import SimpleNamespace

from _blast import blast_parser, paper_scene, run_options
from _method_costs import RunCosts, plot_methods
from taichi_dem import At, InputError, Multirate, Uniform, simulate
from taichi_dem.kit import study
from taichi_dem.kit.files import write_csv
from taichi_dem.kit.plot_style import styles_of
from taichi_dem.kit.validation import told_apart
from taichi_dem.output.hole_monitor import HoleMonitor
from taichi_dem.plot.series import level_columns, level_shares, plot_levels

NAME = "blast_multirate"
METHODS = {
    "uniform": Uniform,
    "multirate_held": Multirate,
    "multirate_drifted": partial(Multirate, neighbour="drifted"),
}
SETTINGS = {
    "methods": (tuple(METHODS), ("uniform", "multirate_held")),
    "l": (1e-7, 1e-7, study.number(0, 1), "largest way of a body in a step [m], 1e-7"),
    "dt0": (1e-8, 1e-8, study.number(0, 1), "largest step [s], 1e-8"),
    "early": (None, None, study.number(0, 1), "first instant compared [s], 5e-5"),
    "until": (5e-4, 6e-5, study.number(0, 1), "second instant compared [s], 5e-4"),
    "samples": (100, 12, study.whole(1, 100000), "rows of the time series, 100"),
    "repeats": (1, 1, study.whole(1, 100), "runs of every method, 1"),
}
#: The paper's figures by method and instant [s]: its minutes, its displacement, what follows.
PAPER = {
    ("uniform", "5e-05"): {"cpu_s": 16 * 60.0},
    ("uniform", "0.0005"): {"cpu_s": 3897 * 60.0, "displacement_mm": 2.16},
    ("multirate_held", "5e-05"): {"cpu_s": 14 * 60.0, "realised_gain": 16 / 14},
    ("multirate_held", "0.0005"): {
        **{"cpu_s": 2702 * 60.0, "realised_gain": 3897 / 2702},
        **{"displacement_mm": 1.93, "displacement_difference": 1.93 / 2.16 - 1.0},
    },
}
TABLE = study.Table(
    method=("name", "method"),
    instant=("instant",),
    time_s=("report.until_s", "time [s]", ".3g"),
    cpu_s=("timing.median", "CPU [s]", ".3g", "s"),
    cpu_spread=("timing.spread",),
    substeps=("report.substeps",),
    evaluations=("report.contact_evaluations", "evaluations", ",", "1"),
    ideal_gain=("report.ideal_gain", "ideal", ".2f", "1"),
    boundary_gain=("report.boundary_gain", "boundary", ".2f", "1"),
    displacement_mm=("moved_mm", "displacement [mm]", ".4f", "mm"),
    radial_mm=("radial_mm",),
    broken_faces=("report.broken_faces", "broken"),
    residual_fraction=("report.energy_residual_fraction", "residual", ".2g%"),
    realised_gain=("gain", "realised", ".2f", "1"),
    displacement_difference=("difference", "difference", "+.2f%", "1"),
)
options_parser = partial(blast_parser, NAME, __doc__, settings=SETTINGS)


class Instant:
    """Report and displacements [mm] at an instant [s]: of the hole, and of the body watched."""

    def __init__(self, time_s):
        self.when = At((time_s,))

    def observe(self, view):
        """Look at the run."""
        hole, place = HoleMonitor(view.model, "hole"), view.motion()["position"]
        self.report, self.radial_mm = view.report(), 1e3 * float(hole.radial_displacement(place))
        self.moved_mm = 1e3 * float(hole.monitored_displacement(place))


def follow(name, options, scene):
    """One run of a method: what is measured early and late, its series, levels of its bodies."""
    method, costs = METHODS[name](options.dt0, options.l), RunCosts()
    made = {"early": Instant(options.early), "late": Instant(options.until)}
    looks = {"title": styles_of([name])[name].label, "observers": [costs, *made.values()]}
    try:
        result = simulate(scene, method=method, **looks, **run_options(options))
    finally:
        # Also what a run that diverged, or was interrupted, had reached.
        if costs.view is not None:
            history = costs.view.history()
            write_csv(f"{options.out}/history_{name}.csv", history)
    return SimpleNamespace(**made, series={**result.series, **costs.columns}, levels=costs.levels)


def run(options):
    """Run all methods, compare, picture."""
    early = 2e-5 if options.quick else 5e-5
    options.early = options.early or min(early, options.until)
    if options.early > options.until:
        got, most = told_apart(options.early, options.until)
        raise InputError(f"early must be at most until, {most} s, got {got}")
    scene, at = paper_scene(options.mesh), study.output_paths(options.out)
    runs = {
        name: [follow(name, options, scene) for _ in range(options.repeats)]
        for name in options.methods
    }
    rows = TABLE.rows(compared(runs, "early") + compared(runs, "late"))
    study.write_rows(at("comparison.csv"), rows)
    draw(at, {name: made[0] for name, made in runs.items()}, options.dt0)
    print(f"One step for all against a step for each, all at l = {options.l:g} m\n")
    TABLE.show(rows)
    if options.repeats > 1:
        spread = max(row["cpu_spread"] for row in rows)
        print(f"CPU times: medians of {options.repeats} runs, spread up to {spread:.0%}\n")
    reports = [one.late.report for made in runs.values() for one in made]
    study.finish(options, NAME, figures_of(rows), reports)


def compared(runs, instant):
    """A subject of ``TABLE`` for each method; the first run's counts, all runs' times."""
    made = []
    for name, repeats in runs.items():
        instants = [getattr(one, instant) for one in repeats]
        first = SimpleNamespace(**vars(instants[0]), name=name, instant=instant)
        first.timing = study.Timing.of(one.report.run_cpu_seconds for one in instants)
        made.append(first)
        first.gain = made[0].timing.median / max(first.timing.median, 1e-12)
        first.difference = first.moved_mm / made[0].moved_mm - 1.0
    return made


def figures_of(rows):
    """Figures for summary.json: times, gains and displacements beside the paper's."""
    figures = {}
    for row in rows:
        paper = PAPER.get((row["method"], f"{row['time_s']:.9g}"), {})
        made = TABLE.figures(row, "{method}_{instant}_{key}", paper)
        # One step for all gains nothing over itself.
        compares = row["method"] != "uniform"
        alone = (name for name in made if compares or not name.endswith(("gain", "difference")))
        figures.update((name, made[name]) for name in alone)
    return figures


def draw(at, runs, dt0):
    """Draw and write all that is plotted."""
    for name, made in runs.items():
        shares = level_shares(made.levels)
        write_csv(at(f"{name}.csv"), {**made.series, **level_columns(shares)})
        if name != "uniform":
            plot_levels(at(f"levels_{name}.png"), made.series["time_s"], shares, dt0)
    series = {name: made.series for name, made in runs.items()}
    plot_methods(at("methods.png"), series, "monitor_displacement_mm")


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
