"""Cost of accuracy of the damper's response: automaton, spheres and RK45 on one scale.

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

import _cost_damper_pictures as pictures
from _cost_rk45 import rk45_points
from _damper_response import OSCILLATOR, Job, distance, scene_steps, seed_variance, simulate
from ca_damper import Automaton, SimulationDiverged, Spheres
from taichi_dem import InputError
from taichi_dem.kit.files import output_folder
from taichi_dem.kit.plot_style import seconds as seconds_in_words
from taichi_dem.kit.progress.progress_bar import ProgressBar
from taichi_dem.kit.study import cached, figure, finish, main, parser, print_table, write_rows
from taichi_dem.kit.study.work_precision import (
    ANSWER_HEADER,
    Point,
    answer_rows,
    answers,
    cheapest,
    write_answers,
    write_points,
)

NAME = "cost_of_accuracy_damper"
SPHERES = "dem_tsuji"
CA_STEPS = (2e-3, 1.1e-3, 7e-4, 5e-4, 3e-4, 2e-4, 1e-4, 5e-5)
DEM_STEPS = (1e-4, 6e-5, 4e-5, 3e-5, 2e-5, 1.4e-5)
PRINTED_STEPS = (6e-5, 4e-5, 2e-5)
SOFT = Spheres(young=5e6, wall_young=5e6)
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
    "dem_soft": Method(SOFT, SOFT_STEPS, 2.5e-5, 3, (2e-4,)),
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
    """Measure all methods, write pictures and tables, find the cheapest method for an error."""
    sizes = QUICK if options.quick else FULL
    folder = output_folder(options.out)
    started = time.perf_counter()
    with ProgressBar("sweep") as bar:
        made = {name: Sweep(name, METHODS[name], sizes, options, bar) for name in sizes["methods"]}
    empty, compiling = rk45_points(sizes["job"], sizes["repeats"], options.quick)
    compiling += sum(sweep.compile_s for sweep in made.values())
    truth = made[SPHERES].mean
    own = [point for sweep in made.values() for point in sweep.against(sweep.mean)]
    toward = [point for sweep in made.values() for point in sweep.against(truth)]
    floors = {label: sweep.floor for label, sweep in made.items()}
    rows = answer_rows(own, TARGETS, floors, pictures.titles_of(made))
    write_points(os.path.join(folder, "points.csv"), own, floors)
    write_points(os.path.join(folder, "points_against_spheres.csv"), toward, floors)
    write_points(os.path.join(folder, "points_empty.csv"), empty, {})
    write_answers(os.path.join(folder, "answers.csv"), rows)
    write_curves(os.path.join(folder, "curves.csv"), made)
    pictures.draw_all(folder, made, own, toward, empty, floors)
    spent = time.perf_counter() - started - compiling
    print_table(rows, ANSWER_HEADER)
    print()
    finish(options, NAME, figures_of(made, own, toward, empty, floors), (compiling, spent))


class Sweep:
    """All runs of one method.

    curves: Curve by step; failures: the reason by step. reference: dict of the curve at the finest
    step: mean [m] over ratios, rms, compile_s, force_check. roundoff: spread of runs that differ by
    the last bit of the base's amplitude, None if not asked for. compile_s: of everything.
    """

    def __init__(self, label, method, sizes, options, bar):
        self.label, self.method, self.job = label, method, sizes["job"]
        self.seeds, self.bar = range(1, sizes["seeds"] + 1), bar
        self.curves, self.failures, self.roundoff = {}, {}, None
        steps = method.steps_of_quick if options.quick else method.steps
        finest = method.reference_step, method.reference_seeds
        if options.quick:
            finest = 0.5 * min(steps), 2
        folder = os.path.join(options.out, "references")
        self.reference, kept = self._reference(folder, *finest)
        self.mean, self.rms = (np.array(self.reference[name]) for name in ("mean", "rms"))
        for dt in steps:
            self._run(dt, sizes["repeats"])
        self.compile_s = sum(curve.compile_s for curve in self.curves.values())
        self.compile_s += 0.0 if kept else self.reference["compile_s"]
        if label in sizes["twins"] and self.curves:
            ulps = range(len(TWINS))
            twins = simulate(method.filling, self.job, max(self.curves), TWINS, ulps=ulps)
            self.compile_s += twins.compile_s
            self.roundoff = seed_variance(twins.rms) ** 0.5

    def _reference(self, folder, step, count):
        settings = (self.method.filling, OSCILLATOR, self.job, step, count)
        # Seeds of its own: a run that shares them would look better than it is.
        seeds = range(1001, 1001 + count)

        def compute():
            curve = simulate(self.method.filling, self.job, step, seeds, progress=self.bar)
            words = {"mean": curve.mean.tolist(), "rms": curve.rms.tolist(), "step": step}
            return {**words, "compile_s": curve.compile_s, "force_check": curve.force_check}

        return cached(folder, self.label, settings, ("ca_damper",), compute)

    def _run(self, dt, repeats):
        filling, timed = self.method.filling, {"repeats": repeats, "enough": ENOUGH}
        try:
            filling.check(self.job.particles, dt)
            run = simulate(filling, self.job, dt, self.seeds, progress=self.bar, **timed)
            self.curves[dt] = run
        except InputError:
            self.failures[dt] = "refused"
        except SimulationDiverged:
            self.failures[dt] = "diverged"

    def against(self, truth):
        """Points with errors against a curve [m]."""
        points = []
        for dt in sorted([*self.curves, *self.failures], reverse=True):
            work = self.job.particles * scene_steps(self.job, dt, len(self.seeds))
            point = Point(self.label, dt, seconds_in_words(dt), work)
            if dt in self.failures:
                points.append(replace(point, failure=self.failures[dt]))
                continue
            curve = self.curves[dt]
            error = distance(curve.mean, truth)
            points.append(replace(point, error=error, seconds=curve.timing, residual=curve.balance))
        return points

    @property
    def floor(self):
        """Error expected from seeds alone, of a run against a reference of the same method.

        The variance from seed to seed is the mean over all runs of the method, as a single run may
        see one of several steady motions only.
        """
        return self.seed_spread * (1.0 / len(self.seeds) + 1.0 / self.rms.shape[1]) ** 0.5

    @property
    def seed_spread(self):
        """Standard deviation from seed to seed of a response, as a share of the peak."""
        runs = [self.rms, *(curve.rms for curve in self.curves.values())]
        return float(np.mean([seed_variance(rms) for rms in runs]) ** 0.5)

    @property
    def check_step(self):
        """Distance of the reference to the finest run of the sweep, which has other seeds."""
        return distance(self.curves[min(self.curves)].mean, self.mean)


def write_curves(path, made):
    """A row a method, step, ratio and seed."""
    rows = []
    for label, sweep in made.items():
        runs = [(dt, curve.rms, 0) for dt, curve in sweep.curves.items()]
        for dt, rms, is_reference in [*runs, (sweep.reference["step"], sweep.rms, 1)]:
            for k, j in np.ndindex(*rms.shape):
                seed = j + (1001 if is_reference else 1)
                rows.append((label, sweep.job.ratios[k], dt, seed, rms[k, j], is_reference))
    write_rows(path, rows, "method ratio step_s seed rms_m reference")


def figures_of(made, own, toward, empty, floors):
    """Cheapest ways to an error, floors, checks of the references, distances of the models."""
    figures = {}
    for points, target, seconds_key, end in (
        (own, 0.01, "cheapest_seconds", "at_1_percent"),
        (own, 0.001, "seconds", "at_0.1_percent"),
        (toward, 0.02, "cheapest_seconds", "to_spheres_within_2_percent"),
    ):
        seconds, method = cheapest(points, target, floors)
        figures[f"{seconds_key}_{end}"] = figure(seconds, "s")
        figures[f"cheapest_method_{end}"] = figure(method, "")
    figures["chaos_floor"] = figure(min(floors.values()), "1")
    for label, sweep in made.items():
        seconds, _ = cheapest(own, 0.01, floors, label)
        figures[f"seconds_at_1_percent_{label}"] = figure(seconds, "s")
        values = {
            "chaos_floor": sweep.floor,
            "roundoff_spread": sweep.roundoff,
            "seed_spread": sweep.seed_spread,
            "check_step": sweep.check_step,
            "check_force": sweep.reference["force_check"],
            "distance_to_spheres": distance(sweep.mean, made[SPHERES].mean),
        }
        for name, value in values.items():
            if value is not None:
                figures[f"{name}_{label}"] = figure(value, "1")
    evaluations = answers(empty, 1e-6, {})[0].point.evaluations
    figures["rk45_evaluations_at_1e-6"] = figure(evaluations, "1")
    return figures


if __name__ == "__main__":
    sys.exit(main(run, options_parser()))
