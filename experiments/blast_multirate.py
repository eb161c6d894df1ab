"""What do steps that differ from body to body save, and what do they change?

Konno et al., section 4.3: one step for all bodies (the smallest that any of them needs) against a
step for every body, neighbours held (the paper's) or drifted along, at equal l. Expect a small gain
at 5e-5 s, when few bodies move, and a large one at 5e-4 s; and a displacement that hardly differs.

    python experiments/blast_multirate.py             # l = 1e-7 m, ten times the paper's
    python experiments/blast_multirate.py --l 1e-8    # the paper's l: most of an hour (estimated)

The larger l scales all steps, and so the cost of all three runs alike; their ratio hardly changes.
At l = 2e-7 m the run on the paper's block diverges at 3.4e-4 s.
Times are CPU seconds of stepping alone, without compiling. Writes pictures, CSV of all plotted data
and summary.json to results/blast_multirate/.
"""

import sys
from functools import partial

from _blast import blast_parser, paper_scene, run_costs, run_options
from _drawing import plot_methods
from taichi_dem import At, InputError, Multirate, Uniform, simulate
from taichi_dem.kit import study
from taichi_dem.kit.files import write_csv
from taichi_dem.kit.plot_style import styles_of
from taichi_dem.output.hole_monitor import hole_of
from taichi_dem.plot.series import level_columns, level_shares, plot_levels

NAME = "blast_multirate"
METHODS = {
    "uniform": Uniform,
    "multirate_held": Multirate,
    "multirate_drifted": partial(Multirate, neighbour="drifted"),
}
SETTINGS = {
    "methods": (tuple(METHODS), ("uniform", "multirate_held")),
    "l": (1e-7, 1e-7, study.number(0, 1), "limit of a displacement in a step [m], default 1e-7"),
    "dt0": (1e-8, 1e-8, study.number(0, 1), "largest step [s], default 1e-8"),
    "early": (5e-5, 2e-5, study.number(0, 1), "first time compared [s], default 5e-5"),
    "until": (5e-4, 6e-5, study.number(0, 1), "second time compared [s], default 5e-4"),
    "samples": (100, 12),
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
    cpu_s=("report.run_cpu_seconds", "CPU [s]", ".3g", "s"),
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
    """Report and displacements [mm] at an instant: of the hole, and of the body watched."""

    def __init__(self, name, instant, time_s):
        self.name, self.instant, self.when = name, instant, At((time_s,))

    def observe(self, view):
        """Look at the run."""
        hole, place = hole_of(view.model, "hole"), view.motion()["position"]
        self.report, self.radial_mm = view.report(), 1e3 * float(hole.radial_displacement(place))
        self.moved_mm = 1e3 * float(hole.monitored_displacement(place))

    def compare(self, base):
        """Compare with the first method at the same instant."""
        spent = max(self.report.run_cpu_seconds, 1e-12)
        self.gain = base.report.run_cpu_seconds / spent
        self.difference = self.moved_mm / base.moved_mm - 1.0


def follow(name, options, scene):
    """One run of a method, drawn: both instants and its series."""
    costs, method = run_costs(), METHODS[name](options.dt0, options.l)
    times = {"early": options.early, "late": options.until}
    instants = [Instant(name, words, time_s) for words, time_s in times.items()]
    looks = {"title": styles_of([name])[name].label, "observers": [costs, *instants]}
    result = simulate(scene, method=method, **looks, **run_options(options))
    series = {**result.series, "cpu_s": costs["cpu_s"], "evaluations": costs["evaluations"]}
    shares = level_shares(costs.rows["level"])
    write_csv(f"{options.out}/{name}.csv", {**series, **level_columns(shares)})
    if not method.uniform:
        plot_levels(f"{options.out}/levels_{name}.png", series["time_s"], shares, options.dt0)
    return instants, series


def run(options):
    """Run all methods, compare, picture."""
    if options.early > options.until:
        raise InputError(f"early must be at most until, {options.until} s, got {options.early}")
    scene, at = paper_scene(options.mesh), study.output_paths(options.out)
    runs = {name: follow(name, options, scene) for name in options.methods}
    instants = [one for pair in zip(*(both for both, _ in runs.values())) for one in pair]
    for k, one in enumerate(instants):
        one.compare(instants[k - k % len(runs)])
    rows, figures = TABLE.rows(instants), {}
    study.write_rows(at("comparison.csv"), rows)
    series = {name: made for name, (_, made) in runs.items()}
    plot_methods(at("methods.png"), series, "monitor_displacement_mm")
    print(f"One step for all and a step for each, at l = {options.l:g} m\n")
    TABLE.show(rows)
    for row in rows:
        paper = PAPER.get((row["method"], f"{row['time_s']:.9g}"), {})
        made = TABLE.figures(row, "{method}_{instant}_{key}", paper)
        # One step for all gains nothing over itself.
        alone = row["method"] == "uniform"
        figures.update(
            (name, one)
            for name, one in made.items()
            if not (alone and name.endswith(("gain", "difference")))
        )
    study.finish(options, NAME, figures, [late.report for (_, late), _ in runs.values()])


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
