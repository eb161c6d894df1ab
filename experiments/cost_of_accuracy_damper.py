"""Cost of accuracy of the damper's response: automaton, spheres and RK45 on one scale.

    python experiments/cost_of_accuracy_damper.py          # about four minutes on one core
    python experiments/cost_of_accuracy_damper.py --quick

Automaton and spheres are different models, so each is compared with its own limit: the same method
at a step far below those of the sweep, with other seeds (kept in OUT/references). The reference is
checked twice: by the finest run of the sweep, and by the force measured on the container, from
which the transfer function gives the motion. A second picture takes the spheres' curve as the
truth. RK45 is compared with the transfer function of the empty container.
"""

import sys
import time
from dataclasses import replace
from functools import partial

import numpy as np
from scipy.integrate import solve_ivp

from ca_damper import Automaton, Batch, Empty, Oscillator, ProgressBar, SceneTable, Spheres
from ca_damper.accuracy.step_study import StepStudy
from ca_damper.plot.curves import picture_compared
from ca_damper.report.measures import curve_distance
from taichi_dem.kit import study
from taichi_dem.kit.plot_style import power, seconds, styles_of
from taichi_dem.kit.study.work_precision import Point, answers
from taichi_dem.kit.study.work_precision_picture import picture_work_precision

NAME = "cost_of_accuracy_damper"
OSCILLATOR = Oscillator()
PARTICLES, SPHERES = 30, "dem_tsuji"
CA_STEPS = (2e-3, 1.1e-3, 7e-4, 5e-4, 3e-4, 2e-4, 1e-4, 5e-5)
DEM_STEPS = (1e-4, 6e-5, 4e-5, 3e-5, 2e-5, 1.4e-5)
SOFT, SOFT_STEPS = Spheres(young=5e6, wall_young=5e6), (4e-4, 2.5e-4, 2e-4, 1e-4, 5e-5)
PRINTED, PAPER = Spheres(damping="printed"), Automaton(rules="paper")
#: A filling, its steps [s] from coarse to fine, those of the quick job, step and seeds of the
#: reference.
METHODS = {
    "ca_static": (PAPER, CA_STEPS, (2e-3, 2e-4), 1e-5, 6),
    "ca_ejection": (replace(PAPER, accounting="landing+ejection"), CA_STEPS, (), 1e-5, 6),
    "ca_landing": (replace(PAPER, accounting="landing"), CA_STEPS, (2e-3, 2e-4), 1e-5, 6),
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
#: RK45 on the empty container: relative tolerances in the kernel and in Python.
TOLERANCES = {"kernel": (1e-6, 1e-8, 1e-10, 1e-12), "python": (0.1, 0.01, 1e-3, 1e-4, 1e-6, 1e-8)}
#: A Batch takes at least 40 steps a cycle: the first is the longest [s].
RK45_STEPS, RK45_CYCLES = (3.9e-3, 1e-3, 2e-4), 30
#: Samples a cycle from which the RMS of a sine is exact.
SAMPLES = 8
#: Times are of one thread.
options_parser = partial(study.parser, NAME, __doc__, settings=SETTINGS, threads=1)


def sweep_of(name, options, folder, bar):
    """All runs of a method: a ``StepStudy``."""
    filling, steps, quick, finest, count = METHODS[name]
    steps = quick if options.quick else steps
    finest, count = (0.5 * min(steps), 2) if options.quick else (finest, count)
    cycles = dict(zip(("transient_cycles", "measured_cycles"), options.cycles))
    job = {"ratios": options.ratios, "start": "rigid", "progress": bar, **cycles}
    made = StepStudy(name, filling, PARTICLES, options.seeds, **job)
    settings = filling, PARTICLES, OSCILLATOR, options.ratios, options.cycles, finest, count
    place = folder / "references", name, settings, ("ca_damper",)
    made.reference, kept = study.cached(*place, lambda: made.make_reference(finest, count))
    made.compile_s += 0.0 if kept else made.reference["compile_s"]
    for dt in steps:
        made.run(dt, options.repeats, ENOUGH)
    if name in options.twins and made.runs:
        made.measure_roundoff(max(made.runs))
    return made


def rk45_points(frequency, repeats, quick):
    """(Points of all ways, seconds of compiling) at frequencies [Hz]; quick: every other point."""
    every, points, compiling = 2 if quick else 1, [], 0.0
    jobs = [("rk45_tolerance", rtol, RK45_STEPS[0], rtol) for rtol in TOLERANCES["kernel"][::every]]
    jobs += [("rk45_step", dt, dt, 1e-2) for dt in RK45_STEPS[::every]]
    for method, swept, dt, rtol in jobs:
        table = SceneTable(0, 1, dt, frequency, OSCILLATOR.base_amplitude)
        batch, spent = Batch(Empty(), table, measured_cycles=1, rtol=rtol, atol=1e-3 * rtol), []
        # The first run compiles.
        for _ in range(1 + repeats):
            started = time.perf_counter()
            batch.start("empty")
            rms = batch.run(RK45_CYCLES - 1, 1).rms
            spent.append(time.perf_counter() - started)
        error = curve_distance(rms, OSCILLATOR.rms(frequency))
        found = 6 * int(batch.attempts().sum()), error, study.Timing.of(spent[1:])
        label = power(swept) if swept == rtol else f"{1e3 * dt:g} ms"
        points.append(Point(method, swept, label, *found))
        compiling += batch.compile_seconds
    for rtol in TOLERANCES["python"][::every]:
        points.append(Point("rk45_python", rtol, power(rtol), *rk45_in_python(frequency, rtol)))
    return points, compiling


def rk45_in_python(frequency, rtol):
    """(Evaluations, error, timing) of the last cycle, begun in the steady state."""
    started, found = time.perf_counter(), []
    cycles = RK45_CYCLES - 1 + np.arange(SAMPLES) / SAMPLES
    for f in frequency:
        job = OSCILLATOR.right_hand_side(f), (0.0, RK45_CYCLES / f), OSCILLATOR.steady_state(f)
        found.append(solve_ivp(*job, rtol=rtol, atol=1e-3 * rtol, t_eval=cycles / f))
    spent = study.Timing.of([time.perf_counter() - started])
    x, evaluations = zip(*((one.y[0], one.nfev) for one in found))
    return sum(evaluations), curve_distance(np.std(x, axis=1), OSCILLATOR.rms(frequency)), spent


def draw(folder, options, made, own, toward, empty, floors):
    """Work-precision diagrams: by method, toward the spheres, of the empty container; curves."""
    ratios, (transient, measured) = options.ratios, options.cycles
    shared = {"floors": floors, "work_name": "particle steps [1]"}
    shorter = max(sweep.reference["step"] / min(sweep.runs) for sweep in made.values())
    scenes = (
        f"{PARTICLES} particles, f/f0 = {', '.join(f'{r:g}' for r in ratios)}, "
        f"{len(options.seeds)} seeds, {transient} + {measured} cycles. Error: RMS over the "
        "frequencies of (response - reference), mean over seeds, as a share of the peak.\n"
    )
    force = "mean force on the container: missing share of the weight [1]"
    picture_work_precision(
        *(folder / "work_precision.png", own),
        error_name="error of the response curve / its peak [1]",
        **{"residual_names": ("step [µs]", force), "step_unit": 1e-6},
        caption=f"{scenes}Reference of each method: itself with other seeds, at {shorter:.2g} of "
        "its finest step or less. Dotted: spread from seed to seed alone.",
        **shared,
    )
    finest = seconds(made[SPHERES].reference["step"])
    caption = f"{scenes}Reference of all: spheres, p = 1/4, at {finest}."
    words = {"error_name": "difference to the spheres' curve / its peak [1]", "caption": caption}
    picture_work_precision(folder / "against_spheres.png", toward, **words, **shared)
    picture_work_precision(
        *(folder / "rk45.png", empty),
        **{"floors": {}, "order": 5},
        error_name="error of the response curve / its peak [1]",
        work_name="evaluations of the right-hand side [1]",
        caption="Empty container. Error: RMS over the frequencies of (response - transfer "
        "function), as a share of the peak. Steps are at most 3.9 ms; rtol 0.01 where the longest "
        "step is swept, free steps in Python.",
    )
    curves = {name: (ratios, sweep.rms) for name, sweep in made.items()}
    picture_compared(folder / "curves.png", curves, OSCILLATOR)


def run(options):
    """Measure all methods, write pictures and tables, find the cheapest method for an error."""
    folder = study.begin(options)
    with ProgressBar("sweep") as bar:
        names = [name for name, one in METHODS.items() if one[2] or not options.quick]
        made = {name: sweep_of(name, options, folder, bar) for name in names}
    frequency = np.array(options.ratios) * OSCILLATOR.natural_frequency
    empty, compiling = rk45_points(frequency, options.repeats, options.quick)
    truth = made[SPHERES].mean
    own = [point for sweep in made.values() for point in sweep.points(sweep.mean)]
    toward = [point for sweep in made.values() for point in sweep.points(truth)]
    floors = {name: sweep.floor for name, sweep in made.items()}
    titles = {name: style.label for name, style in styles_of(made).items()}
    figures = study.give_answers(options.out, own, floors, titles)
    draw(folder, options, made, own, toward, empty, floors)
    near = "cheapest_seconds", "to_spheres_within_2_percent"
    figures.update(study.cheapest_figures(toward, 0.02, floors, *near))
    figures["chaos_floor"] = min(floors.values()), "1"
    figures["rk45_evaluations_at_1e-6"] = answers(empty, 1e-6, {})[0].point.evaluations, "1"
    for label, sweep in made.items():
        values = {
            "chaos_floor": sweep.floor,
            "roundoff_spread": sweep.roundoff,
            "seed_spread": sweep.seed_spread,
            "check_step": curve_distance(sweep.curve(), sweep.mean),
            "check_force": sweep.reference["force_check"],
            "distance_to_spheres": curve_distance(sweep.mean, truth),
        }
        figures |= {f"{key}_{label}": (one, "1") for key, one in values.items() if one is not None}
    study.finish(options, NAME, figures, compiling + sum(one.compile_s for one in made.values()))


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
