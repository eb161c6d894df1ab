"""What accuracy of the damper's response costs: automaton, spheres and RK45 on one scale.

    python experiments/cost_of_accuracy_damper.py          # about four minutes on one core
    python experiments/cost_of_accuracy_damper.py --quick

Automaton and spheres are different models, so each is compared with its own limit: the same method
at a step far below those of the sweep, with other seeds (kept in OUT/references). That reference is
checked twice: by the finest run of the sweep, and by the force measured on the container, from
which the transfer function gives the motion anew. How far the limits lie from the spheres' is a
figure of its own, and a second picture takes the spheres' curve for the truth. RK45 is compared
with the transfer function of the empty container.
"""

import os
import sys
import time
from dataclasses import dataclass, replace

import numpy as np

from _cache import cached
from _cli import figure, main, parser, print_figures, print_table, write_summary
from _cost_rk45 import WAYS as RK45_WAYS
from _cost_rk45 import rk45_points
from _damper_response import (
    OSCILLATOR,
    Job,
    distance,
    scene_steps,
    seed_variance,
    simulate,
)
from _work_precision import (
    ANSWER_HEADER,
    Point,
    answer_rows,
    answers,
    percent,
    picture_work_precision,
    write_answers,
    write_points,
)
from ca_damper import Automaton, SimulationDiverged, Spheres
from ca_damper.plot.cost import picture_curves
from taichi_dem import InputError
from taichi_dem.kit.files import output_folder, write_csv
from taichi_dem.kit.plot_style import STYLES, styles_of
from taichi_dem.kit.plot_style import seconds as seconds_in_words
from taichi_dem.kit.progress.progress_bar import ProgressBar

NAME = "cost_of_accuracy_damper"
SPHERES = "dem_tsuji"
CA_STEPS = (2e-3, 1.1e-3, 7e-4, 5e-4, 3e-4, 2e-4, 1e-4, 5e-5)
DEM_STEPS = (1e-4, 6e-5, 4e-5, 3e-5, 2e-5, 1.4e-5)
PRINTED_STEPS = (6e-5, 4e-5, 2e-5)
SOFT_STEPS = (4e-4, 2.5e-4, 2e-4, 1e-4, 5e-5)


@dataclass(frozen=True)
class Method:
    """A filling and its steps [s], coarse to fine, and that of its reference."""

    filling: object
    steps: tuple
    reference_step: float
    reference_seeds: int
    steps_of_quick: tuple


def automaton(accounting):
    """An automaton by its accounting."""
    return Method(Automaton(accounting=accounting), CA_STEPS, 1e-5, 6, (2e-3, 2e-4))


METHODS = {
    "ca_static": automaton("all"),
    "ca_ejection": automaton("landing+ejection"),
    "ca_landing": automaton("landing"),
    SPHERES: Method(Spheres(), DEM_STEPS, 5e-6, 3, (1e-4, 3e-5)),
    "dem_printed": Method(Spheres(damping="printed"), PRINTED_STEPS, 5e-6, 3, (4e-5,)),
    "dem_soft": Method(
        Spheres(young=5e6, wall_young=5e6),
        *(SOFT_STEPS, 2.5e-5, 3, (2e-4,)),
    ),
}
FULL = {
    "job": Job(30, (0.92, 0.95, 0.966, 0.98, 1.0, 1.04), 40, 40),
    "methods": tuple(METHODS),
    "twins": tuple(METHODS),
    "seeds": 3,
    "repeats": 5,
}
QUICK = {
    "job": Job(30, (0.95, 0.98, 1.0), 10, 10),
    "methods": ("ca_static", "ca_landing", SPHERES, "dem_soft"),
    "twins": (SPHERES,),
    "seeds": 2,
    "repeats": 2,
}
TARGETS = (0.1, 0.01, 0.001)
#: Equal scenes, seeds included, that differ by the last bit of the base's amplitude.
TWINS = (1, 1, 1)
#: Repeats of a point end when they took so long together [s].
ENOUGH = 1.5


def options_parser():
    """Options of this experiment; times are of one thread."""
    made = parser(NAME, __doc__)
    made.set_defaults(threads=1)
    return made


def run(options):
    """Measure all methods, write pictures and tables, answer what an error costs."""
    sizes = QUICK if options.quick else FULL
    output_folder(options.out)
    started = time.perf_counter()
    with ProgressBar("sweep") as bar:
        made = {name: Sweep(name, METHODS[name], sizes, options, bar) for name in sizes["methods"]}
    empty, empty_compile = rk45_points(sizes["job"], sizes["repeats"], options.quick)
    floors = {label: sweep.floor for label, sweep in made.items()}
    own = [point for sweep in made.values() for point in sweep.points]
    truth = made[SPHERES].reference["mean"]
    toward = [point for sweep in made.values() for point in sweep.against(truth)]
    names = {name: style.label for name, style in styles_of(made).items()}
    rows = answer_rows(own, TARGETS, floors, names)
    write_all(options.out, made, own, toward, empty, floors, rows)
    picture_all(options.out, made, own, toward, empty, floors, sizes)
    figures = figures_of(made, own, toward, empty, floors)
    compiling = empty_compile + sum(sweep.compile_s for sweep in made.values())
    spent = time.perf_counter() - started
    write_summary(
        options.out, NAME, figures, compile_seconds=compiling, run_seconds=spent - compiling
    )
    print_table(rows, ANSWER_HEADER)
    print()
    print_figures(figures)
    print(f"\nPictures and tables are in {options.out}")


class Sweep:
    """All runs of one method.

    points: against its own reference. curves: Curve by step. reference: dict of the curve at the
    finest step: mean [m] over ratios, rms, compile_s, force_check. roundoff: spread of runs that
    differ by the last bit of the base's amplitude, None if not asked for. compile_s: of everything.
    """

    def __init__(self, label, method, sizes, options, bar):
        self.label, self.method, self.job = label, method, sizes["job"]
        self.seeds, self.repeats = range(1, sizes["seeds"] + 1), sizes["repeats"]
        self.bar, self.quick = bar, options.quick
        self.curves, self.failures = {}, {}
        self.reference, kept = self._reference(os.path.join(options.out, "references"))
        for dt in method.steps_of_quick if options.quick else method.steps:
            self._run(dt)
        self.compile_s = sum(curve.compile_s for curve in self.curves.values())
        self.compile_s += 0.0 if kept else self.reference["compile_s"]
        self.roundoff = self._twins() if label in sizes["twins"] and self.curves else None
        self.points = self.against(self.reference["mean"])

    def _reference(self, folder):
        step, count = self.method.reference_step, self.method.reference_seeds
        if self.quick:
            step, count = 0.5 * min(self.method.steps_of_quick), 2
        settings = (self.method.filling, OSCILLATOR, self.job, step, count)
        # Seeds of its own: a run that shares them would look better than it is.
        seeds = range(1001, 1001 + count)

        def compute():
            curve = simulate(self.method.filling, self.job, step, seeds, progress=self.bar)
            words = {"mean": curve.mean.tolist(), "rms": curve.rms.tolist(), "step": step}
            words["seconds"], words["compile_s"] = curve.timing.low, curve.compile_s
            return {**words, "force_check": curve.force_check, "balance": curve.balance}

        return cached(folder, self.label, settings, ("ca_damper",), compute)

    def _run(self, dt):
        filling, job = self.method.filling, self.job
        try:
            filling.check(job.particles, dt)
        except InputError:
            self.failures[dt] = "refused"
            return
        try:
            self.curves[dt] = simulate(
                *(filling, job, dt, self.seeds),
                repeats=self.repeats,
                enough=ENOUGH,
                progress=self.bar,
            )
        except SimulationDiverged:
            self.failures[dt] = "diverged"

    def _twins(self):
        step, ulps = max(self.curves), range(len(TWINS))
        curve = simulate(self.method.filling, self.job, step, TWINS, ulps=ulps)
        self.compile_s += curve.compile_s
        return seed_variance(curve.rms) ** 0.5

    def against(self, truth):
        """Points with errors against a curve [m]."""
        points = []
        for dt in sorted([*self.curves, *self.failures], reverse=True):
            work = self.job.particles * scene_steps(self.job, dt, len(self.seeds))
            blank = Point(self.label, dt, seconds_in_words(dt), work)
            if dt in self.failures:
                points.append(replace(blank, failure=self.failures[dt]))
                continue
            curve = self.curves[dt]
            error = distance(curve.mean, truth)
            points.append(replace(blank, error=error, seconds=curve.timing, residual=curve.balance))
        return points

    @property
    def floor(self):
        """Error expected from seeds alone, of a run against a reference of the same method.

        The variance from seed to seed is the mean over all runs of the method, as a single run may
        see one of several steady motions only.
        """
        count = len(self.reference["rms"][0])
        return self.seed_spread * (1.0 / len(self.seeds) + 1.0 / count) ** 0.5

    @property
    def seed_spread(self):
        """Standard deviation from seed to seed of a response, as a share of the peak."""
        runs = [self.reference["rms"], *(curve.rms for curve in self.curves.values())]
        return float(np.mean([seed_variance(rms) for rms in runs]) ** 0.5)

    @property
    def check_step(self):
        """Distance of the reference to the finest run of the sweep, which has other seeds."""
        return distance(self.curves[min(self.curves)].mean, self.reference["mean"])


def write_all(folder, made, own, toward, empty, floors, rows):
    """CSV of points, references, curves and answers."""
    write_points(os.path.join(folder, "points.csv"), own, floors)
    write_points(os.path.join(folder, "points_against_spheres.csv"), toward, floors)
    write_points(os.path.join(folder, "points_empty.csv"), empty, {})
    write_answers(os.path.join(folder, "answers.csv"), rows)
    names = ("method", "ratio", "step_s", "seed", "rms_m", "reference")
    columns = {name: [] for name in names}
    for label, sweep in made.items():
        runs = [(dt, curve.rms, 0) for dt, curve in sweep.curves.items()]
        runs.append((sweep.reference["step"], np.array(sweep.reference["rms"]), 1))
        for dt, rms, is_reference in runs:
            for k, j in np.ndindex(*rms.shape):
                seed = j + (1001 if is_reference else 1)
                row = (label, sweep.job.ratios[k], dt, seed, float(rms[k, j]), is_reference)
                for name, value in zip(names, row):
                    columns[name].append(value)
    write_csv(os.path.join(folder, "curves.csv"), columns)


def picture_all(folder, made, own, toward, empty, floors, sizes):
    """Work-precision diagrams and the curves that they are about."""
    job = sizes["job"]
    scenes = (
        f"{job.particles} particles, f/f0 = {', '.join(f'{r:g}' for r in job.ratios)}, "
        f"{sizes['seeds']} seeds, {job.transient} + {job.measured} cycles"
    )
    names = {name: style.label for name, style in styles_of(made).items()}
    shared = {"titles": names, "floors": floors, "work_name": "particle steps [1]"}
    truth = seconds_in_words(made[SPHERES].reference["step"])
    shorter = max(sweep.reference["step"] / min(sweep.curves) for sweep in made.values())
    error = "Error: RMS over the frequencies of (response - reference), mean over seeds,"
    picture_work_precision(
        os.path.join(folder, "work_precision.png"),
        own,
        error_name="error of the response curve / its peak [1]",
        residual_names=(
            "step [µs]",
            "mean force on the container: missing share of the weight [1]",
        ),
        step_unit=1e-6,
        caption=f"{scenes}. {error} as a share of the peak.\nReference of each method: itself with "
        f"other seeds, at {shorter:.2g} of its finest step or less. Dotted: what seeds alone make "
        "of it.",
        **shared,
    )
    picture_work_precision(
        os.path.join(folder, "against_spheres.png"),
        toward,
        error_name="difference to the spheres' curve / its peak [1]",
        caption=f"{scenes}. {error} as a share of the peak.\n"
        f"Reference of all: spheres, p = 1/4, at {truth}.",
        **shared,
    )
    picture_work_precision(
        os.path.join(folder, "rk45.png"),
        empty,
        {name: STYLES[name].label for name in RK45_WAYS},
        floors={},
        order=5,
        error_name="error of the response curve / its peak [1]",
        work_name="evaluations of the right-hand side [1]",
        caption="Empty container. Error: RMS over the frequencies of (response - transfer "
        "function), as a share of the peak. Steps are at most 3.9 ms; rtol 0.01 where the longest "
        "step is swept, free steps in Python.",
    )
    curves = {
        name: (job.ratios, 1e3 * np.array(sweep.reference["rms"])) for name, sweep in made.items()
    }
    picture_curves(os.path.join(folder, "curves.png"), curves, OSCILLATOR)


def figures_of(made, own, toward, empty, floors):
    """Cheapest ways to an error, floors, checks of the references, distances of the models."""
    figures = {}
    for target in (0.01, 0.001):
        words = percent(target).replace(" %", "_percent")
        best = answers(own, target, floors)[0]
        seconds = best.point.seconds.low if best.point else None
        prefix = "cheapest_seconds_at_" if target == 0.01 else "seconds_at_"
        figures[f"{prefix}{words}"] = figure(seconds, "s")
        figures[f"cheapest_method_at_{words}"] = figure(best.method if best.point else None, "")
    best = answers(toward, 0.02, floors)[0]
    seconds = best.point.seconds.low if best.point else None
    figures["cheapest_seconds_to_spheres_within_2_percent"] = figure(seconds, "s")
    name = best.method if best.point else None
    figures["cheapest_method_to_spheres_within_2_percent"] = figure(name, "")
    figures["chaos_floor"] = figure(min(floors.values()), "1")
    for label, sweep in made.items():
        best = next(a for a in answers(own, 0.01, floors) if a.method == label)
        seconds = best.point.seconds.low if best.point else None
        figures[f"seconds_at_1_percent_{label}"] = figure(seconds, "s")
        figures[f"chaos_floor_{label}"] = figure(sweep.floor, "1")
        if sweep.roundoff is not None:
            figures[f"roundoff_spread_{label}"] = figure(sweep.roundoff, "1")
        figures[f"seed_spread_{label}"] = figure(sweep.seed_spread, "1")
        figures[f"check_step_{label}"] = figure(sweep.check_step, "1")
        figures[f"check_force_{label}"] = figure(sweep.reference["force_check"], "1")
        gap = distance(sweep.reference["mean"], made[SPHERES].reference["mean"])
        figures[f"distance_to_spheres_{label}"] = figure(gap, "1")
    best = answers(empty, 1e-6, {})[0]
    figures["rk45_evaluations_at_1e-6"] = figure(best.point.evaluations, "1")
    return figures


if __name__ == "__main__":
    sys.exit(main(run, options_parser()))
