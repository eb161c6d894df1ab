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
from dataclasses import replace
from pathlib import Path

import numpy as np

from _cost_rk45 import OSCILLATOR, rk45_points
from ca_damper import (
    Automaton,
    InputError,
    ProgressBar,
    SimulationDiverged,
    Spheres,
    frequency_response,
)
from ca_damper.force_check import checked_response
from ca_damper.measures import curve_distance, seed_variance
from ca_damper.plot import picture_compared
from taichi_dem.kit import study
from taichi_dem.kit.files import output_folder
from taichi_dem.kit.plot_style import seconds, styles_of
from taichi_dem.kit.study.work_precision import Point, answers, write_points
from taichi_dem.kit.study.work_precision_picture import picture_work_precision

NAME = "cost_of_accuracy_damper"
TARGETS = (0.1, 0.01, 0.001)
PARTICLES, SPHERES = 30, "dem_tsuji"
CA_STEPS = (2e-3, 1.1e-3, 7e-4, 5e-4, 3e-4, 2e-4, 1e-4, 5e-5)
DEM_STEPS = (1e-4, 6e-5, 4e-5, 3e-5, 2e-5, 1.4e-5)
SOFT, SOFT_STEPS = Spheres(young=5e6, wall_young=5e6), (4e-4, 2.5e-4, 2e-4, 1e-4, 5e-5)
PRINTED = Spheres(damping="printed")
#: A filling, its steps [s] from coarse to fine, those of the quick job, step and seeds of the
#: reference.
METHODS = {
    "ca_static": (Automaton(accounting="all"), CA_STEPS, (2e-3, 2e-4), 1e-5, 6),
    "ca_ejection": (Automaton(accounting="landing+ejection"), CA_STEPS, (), 1e-5, 6),
    "ca_landing": (Automaton(accounting="landing"), CA_STEPS, (2e-3, 2e-4), 1e-5, 6),
    SPHERES: (Spheres(), DEM_STEPS, (1e-4, 3e-5), 5e-6, 3),
    "dem_printed": (PRINTED, (6e-5, 4e-5, 2e-5), (), 5e-6, 3),
    "dem_soft": (SOFT, SOFT_STEPS, (2e-4,), 2.5e-5, 3),
}
SETTINGS = {
    "ratios": ((0.92, 0.95, 0.966, 0.98, 1.0, 1.04), (0.95, 0.98, 1.0)),
    "cycles": ((40, 40), (10, 10)),
    "twins": (tuple(METHODS), (SPHERES,)),
    "seeds": (range(1, 4), range(1, 3)),
    "repeats": (5, 2),
}
#: Repeats of a point end when they took so long together [s].
ENOUGH = 1.5
RK45 = ("rk45_tolerance", "rk45_step", "rk45_python")


def options_parser():
    """Options of this experiment; times are of one thread."""
    return study.add_settings(study.parser(NAME, __doc__), {}, threads=1)


def run(options):
    """Measure all methods, write pictures and tables, find the cheapest method for an error."""
    study.take_settings(options, SETTINGS)
    folder = Path(output_folder(options.out))
    with ProgressBar("sweep") as bar:
        made = {
            name: Sweep(name, options, bar)
            for name, (_, _, quick, *_) in METHODS.items()
            if quick or not options.quick
        }
    frequency = np.array(options.ratios) * OSCILLATOR.natural_frequency
    empty, compiling = rk45_points(frequency, options.repeats, options.quick)
    compiling += sum(sweep.compile_s for sweep in made.values())
    truth = made[SPHERES].mean
    own = [point for sweep in made.values() for point in sweep.points(sweep.mean)]
    toward = [point for sweep in made.values() for point in sweep.points(truth)]
    floors = {name: sweep.floor for name, sweep in made.items()}
    titles = {name: style.label for name, style in styles_of(made).items()}
    study.give_answers(options.out, own, TARGETS, floors, titles)
    write_points(folder / "points_against_spheres.csv", toward, floors)
    write_points(folder / "points_empty.csv", empty, {})
    rows = [row for sweep in made.values() for row in sweep.rows()]
    study.write_rows(folder / "curves.csv", rows, "method ratio step_s seed rms_m reference")
    draw_all(folder, options, made, own, toward, empty, {"titles": titles, "floors": floors})
    study.finish(options, NAME, figures_of(made, own, toward, empty, floors), compiling)


class Sweep:
    """All runs of one method.

    runs: Responses by step, one a repeat; failures: the reason by step. reference: dict of the
    curve at the finest step: rms [m], (ratios, seeds), step, compile_s, force_check. mean: of it
    over the seeds. roundoff: spread of runs that differ by the last bit of the base's amplitude,
    None if not asked for. compile_s: of everything.
    """

    def __init__(self, name, options, bar):
        self.name, self.options = name, options
        self.filling, steps, quick, finest, count = METHODS[name]
        steps = quick if options.quick else steps
        finest, count = (0.5 * min(steps), 2) if options.quick else (finest, count)
        transient, measured = options.cycles
        job = {"particles": PARTICLES, "ratios": options.ratios, "start": "rigid", "progress": bar}
        self.job = {**job, "transient_cycles": transient, "measured_cycles": measured}
        settings = self.filling, OSCILLATOR, options.ratios, options.cycles, finest, count
        place = os.path.join(options.out, "references"), name, settings, ("ca_damper",)
        self.reference, kept = study.cached(*place, lambda: self.checked(finest, count))
        self.rms = np.array(self.reference["rms"])
        self.mean, self.roundoff = self.rms.mean(axis=1), None
        self.runs, self.failures = {}, {}
        for dt in steps:
            self.run(dt)
        twins = self.twins(max(self.runs)) if name in options.twins and self.runs else []
        if twins:
            self.roundoff = seed_variance(np.hstack([one.rms[0] for one in twins])) ** 0.5
        every = [*twins, *(one for repeats in self.runs.values() for one in repeats)]
        self.compile_s = sum(one.report.compile_seconds for one in every)
        self.compile_s += 0.0 if kept else self.reference["compile_s"]

    def checked(self, dt, count):
        """The reference; its seeds are its own: a run that shares them would look too good."""
        seeds = range(1001, 1001 + count)
        found, mismatch = checked_response(self.filling, dt=dt, seeds=seeds, **self.job)
        spent = found.report.compile_seconds
        rms = found.rms[0].tolist()
        return {"rms": rms, "step": dt, "compile_s": spent, "force_check": mismatch}

    def run(self, dt):
        """Run a step of the sweep, again and again for its timing, or note why it failed."""
        repeats, job = [], {"dt": dt, "seeds": self.options.seeds, **self.job}
        try:
            self.filling.check(PARTICLES, dt)
            while len(repeats) < self.options.repeats and sum(map(run_seconds, repeats)) < ENOUGH:
                repeats.append(frequency_response(self.filling, **job))
            self.runs[dt] = repeats
        except (InputError, SimulationDiverged) as error:
            self.failures[dt] = "refused" if isinstance(error, InputError) else "diverged"

    def twins(self, dt):
        """Responses to bases whose amplitudes differ by their last bits."""
        bit = np.spacing(OSCILLATOR.base_amplitude)
        bases = [
            replace(OSCILLATOR, base_amplitude=OSCILLATOR.base_amplitude + k * bit)
            for k in range(3)
        ]
        job = {"dt": dt, "seeds": 1, **self.job}
        return [frequency_response(self.filling, oscillator=base, **job) for base in bases]

    def curve(self, dt):
        """Mean over the seeds at a step [m]."""
        return self.runs[dt][0].rms[0].mean(axis=1)

    def points(self, truth):
        """Points with errors against a curve [m]."""
        weight = PARTICLES * self.filling.particle_mass * self.filling.gravity
        scenes = PARTICLES * len(self.options.seeds) * sum(self.options.cycles)
        frequency, found = np.array(self.options.ratios) * OSCILLATOR.natural_frequency, []
        for dt in sorted([*self.runs, *self.failures], reverse=True):
            work = scenes * int(np.ceil(1.0 / (frequency * dt) * (1.0 - 1e-12)).sum())
            point = Point(self.name, dt, seconds(dt), work, failure=self.failures.get(dt, ""))
            if dt in self.runs:
                timing = study.Timing.of(map(run_seconds, self.runs[dt]))
                missing = abs(float(self.runs[dt][0].mean_force.mean()) + weight) / weight
                error = curve_distance(self.curve(dt), truth)
                point = replace(point, error=error, seconds=timing, residual=missing)
            found.append(point)
        return found

    def rows(self):
        """A row a step, ratio and seed."""
        runs = [(dt, repeats[0].rms[0], 0, 1) for dt, repeats in self.runs.items()]
        for dt, rms, is_reference, first in [*runs, (self.reference["step"], self.rms, 1, 1001)]:
            for (k, j), value in np.ndenumerate(rms):
                yield self.name, self.options.ratios[k], dt, first + j, value, is_reference

    @property
    def floor(self):
        """Error expected from seeds alone, of a run against a reference of the same method.

        The variance from seed to seed is the mean over all runs of the method, as a single run may
        see one of several steady motions only.
        """
        return self.seed_spread * (1.0 / len(self.options.seeds) + 1.0 / self.rms.shape[1]) ** 0.5

    @property
    def seed_spread(self):
        """Standard deviation from seed to seed of a response, as a share of the peak."""
        runs = [self.rms, *(repeats[0].rms[0] for repeats in self.runs.values())]
        return float(np.mean([seed_variance(rms) for rms in runs]) ** 0.5)


def run_seconds(response):
    """Seconds that a response took without compiling."""
    return response.report.run_seconds


def draw_all(folder, options, made, own, toward, empty, shared):
    """Work-precision diagrams: by method, toward the spheres, of the empty container; curves."""
    ratios, (transient, measured) = options.ratios, options.cycles
    shorter = max(sweep.reference["step"] / min(sweep.runs) for sweep in made.values())
    scenes = (
        f"{PARTICLES} particles, f/f0 = {', '.join(f'{r:g}' for r in ratios)}, "
        f"{len(options.seeds)} seeds, {transient} + {measured} cycles. Error: RMS over the "
        "frequencies of (response - reference), mean over seeds, as a share of the peak.\n"
    )
    balance = "mean force on the container: missing share of the weight [1]"
    picture_work_precision(
        folder / "work_precision.png",
        own,
        error_name="error of the response curve / its peak [1]",
        work_name="particle steps [1]",
        residual_names=("step [µs]", balance),
        step_unit=1e-6,
        caption=f"{scenes}Reference of each method: itself with other seeds, at {shorter:.2g} of "
        "its finest step or less. Dotted: what seeds alone make of it.",
        **shared,
    )
    picture_work_precision(
        folder / "against_spheres.png",
        toward,
        error_name="difference to the spheres' curve / its peak [1]",
        work_name="particle steps [1]",
        caption=f"{scenes}Reference of all: spheres, p = 1/4, at "
        f"{seconds(made[SPHERES].reference['step'])}.",
        **shared,
    )
    picture_work_precision(
        folder / "rk45.png",
        empty,
        {name: style.label for name, style in styles_of(RK45).items()},
        floors={},
        order=5,
        error_name="error of the response curve / its peak [1]",
        work_name="evaluations of the right-hand side [1]",
        caption="Empty container. Error: RMS over the frequencies of (response - transfer "
        "function), as a share of the peak. Steps are at most 3.9 ms; rtol 0.01 where the longest "
        "step is swept, free steps in Python.",
    )
    curves = {name: (ratios, sweep.rms) for name, sweep in made.items()}
    picture_compared(folder / "curves.png", curves, OSCILLATOR)


def figures_of(made, own, toward, empty, floors):
    """Cheapest ways to an error, floors, checks of the references, distances of the models."""
    figures = {
        **study.cheapest_figures(own, 0.01, floors, "cheapest_seconds"),
        **study.cheapest_figures(own, 0.001, floors, "seconds"),
        **study.cheapest_figures(
            toward, 0.02, floors, "cheapest_seconds", "to_spheres_within_2_percent"
        ),
        **study.figures_by_method(own, 0.01, floors),
        "chaos_floor": study.figure(min(floors.values()), "1"),
    }
    for label, sweep in made.items():
        values = {
            "chaos_floor": sweep.floor,
            "roundoff_spread": sweep.roundoff,
            "seed_spread": sweep.seed_spread,
            "check_step": curve_distance(sweep.curve(min(sweep.runs)), sweep.mean),
            "check_force": sweep.reference["force_check"],
            "distance_to_spheres": curve_distance(sweep.mean, made[SPHERES].mean),
        }
        for name, value in values.items():
            if value is not None:
                figures[f"{name}_{label}"] = study.figure(value, "1")
    evaluations = answers(empty, 1e-6, {})[0].point.evaluations
    figures["rk45_evaluations_at_1e-6"] = study.figure(evaluations, "1")
    return figures


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
